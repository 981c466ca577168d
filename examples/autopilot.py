"""Let a shipped autopilot take a new heading and depth, and see what it gains by knowing the cable."""

import matplotlib.pyplot as plt
import numpy as np

import subzero
from subzero import autopilot

trial = subzero.load_scenario("fig6")
goal = autopilot.Wanted(speed=1.0, heading=trial.start.heading + np.radians(20.0), depth=3.0)  # [m/s, rad, m]

figure, panels = plt.subplots(2, layout="constrained", sharex=True)
for feed_forward, line in (("none", "-"), ("model", "--")):
    pilot = autopilot.make("lqr", trial, feed_forward=feed_forward)
    run = autopilot.fly(trial, pilot, lambda time: goal)
    panels[0].plot(run["time"], run["surge_speed"] - run["wanted_speed"], line, label=feed_forward)
    panels[1].plot(run["time"], run["depth"] - run["wanted_depth"], line)
    print(
        f"feed-forward {feed_forward}: {1000 * float(run['surge_speed'][-1] - goal.speed):+.2f} mm/s off at the end"
    )

panels[0].set(ylabel="speed error [m/s]", ylim=(-0.02, 0.06), title="LQR autopilot on a growing cable")
panels[0].legend(title="feed-forward of the cable")
panels[1].set(xlabel="time [s]", ylabel="depth error [m]")
figure.savefig("autopilot.png", dpi=150)
