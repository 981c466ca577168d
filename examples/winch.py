"""Pay out and reel in a heavy cable that hangs between a vessel and a vehicle that does not move."""

import matplotlib.pyplot as plt
import numpy as np

import cable

heavy = cable.CableProperties(mass_per_length=0.02)  # all else as in Table 1 of the paper [kg/m]
ends = [(30.0, 0.0, 10.0), (0.0, 0.0, 0.0)]  # vehicle and drum: north, east, down [m]
rest = cable.hold(ends, 34.0, (0.0, 0.1, 0.0), cable=heavy)  # in a current to the east [m/s]
winch = cable.PayOutRate(rate=lambda time: 0.2 * np.sin(2.0 * np.pi * time / 40.0))  # [m/s]

run = cable.pull_out(lambda time: (0.0, 0.0, 0.0), 40.0, drum=winch, start=rest)
print(run.outcome.message, *run.warnings)

figure, (above, below) = plt.subplots(2, layout="constrained", figsize=(6.4, 7.0))
above.plot(run.time, run.tow_tension, label="at the vehicle")
above.plot(run.time, run.drum_tension, "--", label="at the drum")
above.set(xlabel="time [s]", ylabel="tension [N]")
above.legend()
for time in (0.0, 10.0, 20.0):
    north, _, depth = run.shape(time).T
    below.plot(north, depth, label=f"{time:.0f} s, {np.interp(time, run.time, run.length):.1f} m")
below.set(xlabel="north of the drum [m]", ylabel="below the drum [m]")
below.invert_yaxis()
below.legend(title="time, cable off the drum")
figure.savefig("winch.png", dpi=150)
