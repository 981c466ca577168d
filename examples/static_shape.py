"""Find where a heavy cable rests between two ends, in still water and in currents across it."""

import matplotlib.pyplot as plt
import numpy as np

import cable

heavy = cable.CableProperties(mass_per_length=0.02)  # all else as in Table 1 of the paper [kg/m]
ends = [(30.0, 0.0, 5.0), (0.0, 0.0, 5.0)]  # vehicle and drum: north, east, down [m]

figure, (side, top) = plt.subplots(2, layout="constrained", sharex=True)
for current in (0.0, 0.2, 0.4):  # to the east [m/s]
    rest = cable.hold(ends, 32.0, (0.0, current, 0.0), cable=heavy)
    north, east, down = rest.shape.T
    pull = np.linalg.norm(rest.tow_force)
    side.plot(north, down, label=f"{current:.1f} m/s, pulls with {pull:.2f} N")
    top.plot(north, east)

side.set(ylabel="depth [m]", title="32 m of cable between two ends 30 m apart")
side.invert_yaxis()
side.legend(title="current to the east")
top.set(xlabel="north [m]", ylabel="east [m]")
figure.savefig("static_shape.png", dpi=150)
