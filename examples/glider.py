"""Fly a glider by its bladder and battery: a dive, a climb, and a dive in a spiral."""

import matplotlib.pyplot as plt

import subzero

trial = subzero.load_scenario("glider_sawtooth")
run = subzero.simulate(trial, tethered=False)

figure = plt.figure(figsize=(9, 4), layout="constrained")
track = figure.add_subplot(1, 2, 1, projection="3d")
track.plot(run["east"], run["north"], run["depth"])
track.set(xlabel="east [m]", ylabel="north [m]", zlabel="depth [m]", title="Track", aspect="equal")
track.invert_zaxis()

angles = figure.add_subplot(1, 2, 2)
angles.plot(run["time"], run["pitch"], label="pitch [°]")
angles.plot(run["time"], run["roll_angle"], label="roll [°]")
angles.plot(run["time"], 100.0 * run["surge_speed"], label="speed [cm/s]")
angles.set(xlabel="time [s]", title="Pitch by the battery's slide, roll by its turn")
angles.grid(alpha=0.3)
angles.legend()
figure.savefig("glider.png", dpi=150)
