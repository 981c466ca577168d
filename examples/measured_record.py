"""Lay a measured record over a simulation, and say how far the simulation is from it."""

import numpy as np

import subzero

# In place of a log of your own: a vehicle with 10 % more thrust, its sensors noisy and read five times a second.
trial = subzero.load_scenario("fig6")
thrust = subzero.Model.of(trial).vehicle.propeller.thrust_constant
true = subzero.simulate(trial.with_changes({"vehicle.propeller.thrust_constant": 1.1 * thrust}))
time, noise = np.arange(0.0, 30.0, 0.2), np.random.default_rng(0)
speed = np.interp(time, true["time"], true["surge_speed"]) + noise.normal(0.0, 0.01, time.size)
heading = np.interp(time, true["time"], true["heading"]) + noise.normal(0.0, 0.3, time.size)
rows = np.column_stack([time, speed, heading])
np.savetxt("record.csv", rows, "%.4f", ",", header="time_s,surge_speed_m_s,heading_deg", comments="")

record = subzero.read_record("record.csv")
comparison = subzero.compare("fig6")
for name, run in comparison.runs.items():
    error = np.interp(record.time, run["time"], run["surge_speed"]) - record.values["surge_speed"]
    print(f"{name}: speed off by {np.sqrt(np.mean(error**2)):.3f} m/s (root mean square)")

figure = subzero.draw(comparison.runs, record)["fig6"]
figure.savefig("measured_record.png")
