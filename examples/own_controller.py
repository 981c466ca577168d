"""Steer a simulation step by step with a control law of your own, with the cable and without."""

import math

import matplotlib.pyplot as plt

import subzero

TURN = math.radians(60.0)


def rudder(observation, wanted):
    """Return a rudder angle [rad]: proportional to the heading error, damped by the yaw rate, limited."""
    error = wanted - observation.heading
    return max(-0.26, min(0.26, 1.2 * error - 0.8 * observation.yaw_rate))


trial = subzero.load_scenario("fig6").with_changes({"start.wet_length_m": 30.0})
figure, axes = plt.subplots(layout="constrained")
for tethered in (True, False):
    simulator = subzero.Simulator(trial, tethered=tethered)
    seen = simulator.observation
    wanted = seen.heading + TURN
    while simulator.time < 40.0:
        seen = simulator.step((25.0, rudder(seen, wanted), 0.0, 0.0))  # propeller [rev/s], fins [rad]
    run = simulator.result()
    axes.plot(run["time"], run["heading"], label="on 30 m of cable and more" if tethered else "without cable")

axes.axhline(math.degrees(wanted), color="black", linestyle=":", label="wanted")
axes.set(xlabel="time [s]", ylabel="heading [°]", title="A heading law without an integral")
axes.legend()
axes.grid(alpha=0.3)
figure.savefig("own_controller.png", dpi=150)
