"""Let a drifting vehicle of 40 kg come to the end of its tether, and compare the snap with that of a spring."""

import matplotlib.pyplot as plt
import numpy as np

import cable

MASS, SPEED, LENGTH, DT = 40.0, 0.85, 12.0, 0.005  # kg, m/s, m, s
AT_REST = np.zeros(3)


def drift(stiffness):
    """Return times and pulls of a tether of stiffness EA [N], for a host that steps by the velocity Verlet method."""
    line = cable.CableProperties(compliance=1.0 / stiffness)
    tether = cable.Tether(line, length=LENGTH, ends=[(11.0, 0.0, 0.0), AT_REST])
    place, velocity, pull = 11.0, SPEED, 0.0
    times, pulls = [], []
    while tether.time < 3.0:
        acceleration = -pull / MASS
        place += DT * velocity + 0.5 * DT**2 * acceleration
        state = (place, 0.0, 0.0), (velocity + DT * acceleration, 0.0, 0.0)
        pull = -tether.step(DT, [state, (AT_REST, AT_REST)])[0, 0]
        velocity += 0.5 * DT * (acceleration - pull / MASS)
        times.append(tether.time)
        pulls.append(pull)
    return times, pulls


figure, axes = plt.subplots(layout="constrained")
for colour, stiffness in zip(("tab:blue", "tab:orange", "tab:green"), (1e3, 1e4, 1e5), strict=True):
    axes.plot(*drift(stiffness), color=colour, label=f"EA = {stiffness:.0e} N")
    axes.axhline(SPEED * np.sqrt(MASS * stiffness / LENGTH), color=colour, linestyle=":")
axes.set(xlabel="time [s]", ylabel="pull on the vehicle [N]", title="dotted: v√(M·EA/L)")
axes.legend()
figure.savefig("tether_snap.png", dpi=150)
