"""Drive the hull alone, with no cable: turning circles at three rudder angles."""

import matplotlib.pyplot as plt
import numpy as np

import subzero
import vehicle

hull = subzero.Model.of(subzero.load_scenario("fig6")).vehicle
start = vehicle.initial_state(velocity=(1.0, 0.0, 0.0, 0.0, 0.0, 0.0), propeller_speed=25.0)  # [m/s, rev/s]

figure, axes = plt.subplots(layout="constrained")
for angle in (5.0, 10.0, 15.0):  # [°]
    commands = (25.0, np.radians(angle), 0.0, 0.0)  # propeller [rev/s], rudder and both stern-planes [rad]
    run = vehicle.free_run(hull, start, commands, duration=60.0)
    north, east, _ = run.states[:, :3].T
    speed = np.linalg.norm(run.states[-1, 7:10])
    axes.plot(east, north, label=f"{angle:.0f}°, {speed:.2f} m/s at the end")

axes.set(xlabel="east [m]", ylabel="north [m]", title="Turning circles, 60 s", aspect="equal")
figure.legend(title="rudder", loc="outside right upper")
axes.grid(alpha=0.3)
figure.savefig("vehicle_alone.png", dpi=150)
