"""Fig. 5 (c) at the end of the turn, at three steps: ``python -m benchmarks.jolt``.

The pitch rate ends at 20 s, and with it the sideways speed of the tow point, at once. Shown is the tension just before,
0.1 s behind, and where it differs most from that of the shortest step between 1 s and 30 s.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import subzero

STEPS = (0.5, 0.1, 0.02)
"""[s]"""


def tensions(step: float) -> tuple[np.ndarray, np.ndarray]:
    """Return times [s] and tensions at the tow point [N] of Fig. 5."""
    trial = replace(subzero.load_scenario("fig5"), cable_step=step, hull_step=min(step, 0.02))
    run = subzero.simulate(trial)
    return run["time"].values, run["cable_tension"].values


def main() -> None:
    """Print a row a step."""
    found = {step: tensions(step) for step in STEPS}
    fine_time, fine = found[STEPS[-1]]
    print("step [s]  T(20 s) [N]  T(20.5 s) [N]  largest difference from the shortest step")
    for step, (time, tension) in found.items():
        gap = np.abs(tension / np.interp(time, fine_time, fine) - 1.0)[time > 1.0].max()
        at, behind = np.interp((20.0, 20.5), time, tension)
        print(f"{step:8g}  {at:11.4f}  {behind:13.4f}  {100.0 * gap:.2f} %")


if __name__ == "__main__":
    main()
