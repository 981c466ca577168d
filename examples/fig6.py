"""Simulate the trial of Fig. 6 of Feng and Allen (2004) with the cable and without, and draw both."""

import subzero

comparison = subzero.compare("fig6")
for name, run in comparison.runs.items():
    speed = run["surge_speed"]
    print(f"{name}: at most {float(speed.max()):.3f} m/s, after {float(speed.idxmax()):.1f} s")
print("largest force of the cable:", comparison.summary()["tethered"]["largest_cable_force_N"], "N")
print("warnings:", subzero.warnings_of(comparison.tethered))

figure = subzero.draw(comparison.runs)["fig6"]
figure.savefig("fig6.png")
