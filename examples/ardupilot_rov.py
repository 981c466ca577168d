"""Fly the tethered ROV of ArduPilot's JSON back end without ArduPilot: thruster pulses in, its answers out."""

import json

import matplotlib.pyplot as plt
import numpy as np

from subzero.ardupilot import TetheredRov

STEP_S = 0.02  # as ArduPilot's frames at 50 Hz
rov = TetheredRov(length=25.0, depth=5.0, current=(0.0, 0.2, 0.0))
times, places, pulls = [], [], []
while rov.time < 40.0:
    pulses = np.full(6, 1500.0)  # each thruster stands [µs]
    ahead = 200.0 if rov.time < 25.0 else -200.0
    pulses[:4] += ahead * np.array([-1.0, -1.0, 1.0, 1.0])  # ArduSub's frame "vectored": surge
    pulses[4:] += np.clip(400.0 * (5.0 - rov.position[2]), -400.0, 400.0)  # down: hold the depth
    rov.step(pulses, STEP_S)
    state = json.loads(rov.answer())  # what ArduPilot reads
    times.append(state["timestamp"])
    places.append(state["position"])
    pulls.append(np.linalg.norm(rov.pull))

north, east, down = np.transpose(places)
figure, (above, below) = plt.subplots(2, layout="constrained", figsize=(6.4, 7.0))
above.plot(times, pulls)
above.set(xlabel="time [s]", ylabel="pull of the tether [N]")
below.plot(east, north, label="ROV")
below.plot(rov.tether.shape[:, 1], rov.tether.shape[:, 0], "--", label="tether at the end")
below.set(xlabel="east [m]", ylabel="north [m]")
below.legend()
figure.savefig("ardupilot_rov.png", dpi=150)
