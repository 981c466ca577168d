"""Compare cables of your own: the speed of the vehicle against time, for three diameters."""

import math

import matplotlib.pyplot as plt

import subzero

trial = subzero.load_scenario("fig6")
diameters = {"thin": 0.0015, "as in the paper": 0.0025, "thick": 0.0040}  # [m]

figure, axes = plt.subplots(layout="constrained")
for name, diameter in diameters.items():
    area = math.pi / 4.0 * diameter**2  # [m2]
    numbers = {
        "cable.diameter": diameter,
        "cable.cross_section_area": area,
        "cable.mass_per_length": 1000.0 * area,  # neutral in water [kg/m]
    }
    run = subzero.simulate(trial.with_changes(numbers))
    print(name, f"{float(run['cable_tension'].max()):.2f} N at most", *subzero.warnings_of(run))
    axes.plot(run["time"], run["surge_speed"], label=f"{name}, {1000 * diameter:.1f} mm")

axes.set(xlabel="time [s]", ylabel="surge speed [m/s]", title="Trial of Fig. 6 with three cables")
axes.legend(title="cable")
axes.grid(alpha=0.3)
figure.savefig("own_cable.png", dpi=150)
