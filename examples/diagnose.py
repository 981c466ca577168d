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

# "screen" ranks the causes and fits the first; "verdict" and "full" fit all that may be true, and test the fits.
verdict = subzero.diagnose(log, "fig6", budget="screen")
print(verdict)

(curves,) = verdict.curves.values()
figure, axes = plt.subplots(layout="constrained", figsize=(6.4, 3.2))
axes.plot(curves.time, curves.measured["surge_speed"], ".", markersize=2, color="0.6", label="measured")
for name, line in {"nominal": "--", "extended": "-"}.items():
    axes.plot(curves.time, curves.models[name]["surge_speed"], line, label=f"{name} model")
axes.set(xlabel="time [s]", ylabel="surge speed [m/s]", title=verdict.sentence)
axes.legend()
figure.savefig("diagnose.png", dpi=150)
