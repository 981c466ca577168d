"""Diagnose a vehicle from its log: the screening of a record of a vehicle with more thrust."""

import matplotlib.pyplot as plt
import numpy as np

import subzero

# In place of a log of your own; a CSV file does as well: subzero.diagnose("record.csv", "fig6").
trial = subzero.load_scenario("fig6")
thrust = subzero.Model.of(trial).vehicle.propeller.thrust_constant
true = subzero.simulate(trial.with_changes({"vehicle.propeller.thrust_constant": 1.3 * thrust}))
noise = {
    "surge_speed": 0.015,
    "heading": 0.4,
    "yaw_rate": 0.3,
    "pitch": 0.2,
    "depth": 0.015,
}  # [m/s, °, °/s, °, m]
time, rng = np.arange(0.0, 30.0, 0.1), np.random.default_rng(1)
values = {
    name: np.interp(time, true["time"], true[name]) + rng.normal(0.0, level, time.size)
    for name, level in noise.items()
}
log = subzero.Record(source="a log", time=time, values=values)

# "screen" only ranks the causes; "verdict" and "full" fit them and test the fits.
verdict = subzero.diagnose(log, "fig6", budget="screen")
print(verdict)

likely = sorted(verdict.probabilities.items(), key=lambda item: item[1])[-6:]
names = [name.replace("_", " ").replace(":", " of ") for name, _ in likely]
figure, axes = plt.subplots(layout="constrained", figsize=(6.4, 3.2))
axes.barh(names, [probability for _, probability in likely])
axes.set(xlabel="probability [1]", title="What explains the log", xlim=(0.0, 1.0))
figure.savefig("diagnose.png", dpi=150)
