"""Step a tether from a simulator of your own: a buoy in waves on a heavy line to an anchor, in a current."""

import matplotlib.pyplot as plt
import numpy as np

import cable

MASS, AREA, DRAG, DT = 60.0, 0.2, 60.0, 0.05  # of the buoy, with added water [kg, m², kg/m]; step [s]
AT_REST = np.zeros(3)
line = cable.CableProperties(mass_per_length=0.4, cross_section_area=8e-5, diameter=0.01, compliance=1e-5)
anchor, place, velocity = np.array([0.0, 0.0, 20.0]), np.array([6.0, 0.0, 0.0]), np.zeros(3)
current = cable.Current.profile(down=[0.0, 20.0], velocity=[[0.6, 0.0, 0.0], [0.1, 0.0, 0.0]])
tether = cable.Tether(line, length=22.0, ends=[place, anchor], current=current)

times, pulls, shapes = [], [], []
while tether.time < 60.0:
    surface = 0.5 * np.sin(2.0 * np.pi * tether.time / 5.0)  # positive down [m]
    force = tether.forces[0] - DRAG * np.abs(velocity - current.at(place)) * (velocity - current.at(place))
    force[2] -= 1025.0 * 9.81 * AREA * np.clip(place[2] - surface, -0.3, 0.3)
    velocity = velocity + DT * force / MASS
    place = place + DT * velocity
    forces = tether.step(DT, [(place, velocity), (anchor, AT_REST)])
    times.append(tether.time)
    pulls.append(np.linalg.norm(forces, axis=1))
    shapes.append(tether.shape)

figure, (above, below) = plt.subplots(2, layout="constrained", figsize=(6.4, 7.0))
above.plot(times, pulls, label=["at the buoy", "at the anchor"])
above.set(xlabel="time [s]", ylabel="force of the tether [N]")
above.legend()
for k in (0, 200, 600, 1199):
    below.plot(shapes[k][:, 0], shapes[k][:, 2], label=f"{times[k]:.0f} s")
below.set(xlabel="downstream of the anchor [m]", ylabel="depth [m]")
below.invert_yaxis()
below.legend(title="shape after")
figure.savefig("tether_buoy.png", dpi=150)
