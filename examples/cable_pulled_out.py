"""Pull the cable of the paper off its drum without any vehicle: one turn, and the tension at both ends."""

import matplotlib.pyplot as plt
import numpy as np

import cable


def velocity(time):
    """Return the velocity of the tow point: 1 m/s, turning from north to east between 20 and 40 s."""
    heading = np.radians(90.0) * np.clip((time - 20.0) / 20.0, 0.0, 1.0)
    return np.cos(heading), np.sin(heading), 0.0


run = cable.pull_out(velocity, 60.0)
print(run.outcome.message)
print("how far to trust it:", run.diagnostics())

figure, (above, below) = plt.subplots(2, layout="constrained", figsize=(6.4, 7.0))
above.plot(run.time, run.tow_tension, label="at the vehicle")
above.plot(run.time, run.drum_tension, "--", label="at the drum")
above.set(xlabel="time [s]", ylabel="tension [N]")
above.legend()
for time in (20.0, 40.0, 60.0):
    north, east, _ = run.shape(time).T
    below.plot(east, north, label=f"{time:.0f} s")
below.set(xlabel="east [m]", ylabel="north [m]", aspect="equal")
below.legend(title="shape after")
figure.savefig("cable_pulled_out.png", dpi=150)
