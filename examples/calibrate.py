"""Estimate numbers of a vehicle from a log, and lay the calibrated simulation over what was measured."""

import matplotlib.pyplot as plt
import numpy as np

import subzero

# In place of a log of your own; CSV files do as well: subzero.calibrate(["zigzag.csv", "dive.csv"], "fig6").
truth = {"vehicle.axial_drag.drag_coefficient": 0.30, "vehicle.rudder.lift_slope": 2.2}
true = subzero.simulate(subzero.load_scenario("zigzag").with_changes(truth))
noise = {
    "surge_speed": 0.015,
    "heading": 0.4,
    "yaw_rate": 0.3,
    "pitch": 0.2,
    "depth": 0.015,
}  # [m/s, °, °/s, °, m]
time, rng = np.arange(0.0, float(true["time"][-1]), 0.1), np.random.default_rng(1)
values = {
    name: np.interp(time, true["time"], true[name]) + rng.normal(0.0, level, time.size)
    for name, level in noise.items()
}
log = subzero.Record(source="a zigzag", time=time, values=values)

(logged,) = subzero.read_trials([log], scenario="zigzag")
found = subzero.calibrate(logged, free=list(truth), quick=True)
for number in found.estimates:
    print(f"{number.name}: {number.low:.3g} to {number.high:.3g}, truly {truth[number.name]:g}")

curves = next(iter(found.curves.values()))
figure, panels = plt.subplots(2, layout="constrained", sharex=True)
for axes, (name, unit) in zip(panels, {"surge_speed": "m/s", "heading": "°"}.items(), strict=True):
    axes.plot(curves.time, curves.measured[name], ".", markersize=2, color="grey", label="measured")
    for model, computed in curves.models.items():
        axes.plot(curves.time, computed[name], label=model)
    axes.set(ylabel=f"{name.replace('_', ' ')} [{unit}]")
panels[0].legend()
panels[1].set(xlabel="time [s]")
figure.savefig("calibrate.png", dpi=150)
