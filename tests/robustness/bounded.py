"""Run whatever is compiled with every index checked (NUMBA_BOUNDSCHECK=1): run as a child process by the tests.

    NUMBA_BOUNDSCHECK=1 python tests/robustness/bounded.py NAME

An index beyond its array raises an IndexError then, where it would read or spoil other memory silently.
"""

from __future__ import annotations

import dataclasses
import sys
from functools import partial

import numpy as np

import cable
import scenarios
import subzero
from scenarios import SCHEMES
from subzero.jit import compiled

COMMAND = (27.0, 0.2, 0.05, -0.05)


def shipped(name: str) -> None:
    """A scenario with the cable and without, as `subzero compare` runs it."""
    for run in subzero.compare(name).runs.values():
        assert run.outcome == "completed", run.outcome_message


def trial(scheme: str) -> None:
    """A trial with each scheme; the paper's stops with a message where its steps are short, as it is known to."""
    fig4, fig6 = subzero.load_scenario("fig4"), subzero.load_scenario("fig6")
    for one, step in ((fig6, 0.1), (fig6, 0.5), (fig4, 1.0)):
        run = subzero.simulate(dataclasses.replace(one, scheme=scheme, cable_step=step))
        assert run.outcome == "completed" or scheme != "moving_end", run.outcome_message


def stepped() -> None:
    with_cable = subzero.Simulator("fig6")
    for _ in range(600):
        with_cable.step(COMMAND)


def turning(t: float) -> tuple[float, float, float]:
    return np.cos(0.3 * t), np.sin(0.3 * t), 0.1


def back_and_forth(t: float) -> tuple[float, float, float]:
    """It comes back over its cable, which goes slack, and leaves again."""
    return np.cos(0.5 * t), 0.1, 0.05


def pulled_out(scheme: str) -> None:
    for way in (turning, back_and_forth):
        cable.pull_out(way, 20.0, scheme=scheme)
    if scheme in ("moving_end", "lumped"):
        stiff = cable.CableProperties(mass_per_length=0.02, bending_stiffness=1e-4)
        drums = (cable.ConstantTension(tension=5.0), cable.DrumProperties(friction_torque=0.05, inertia=0.02))
        for drum in drums:
            boat = cable.MovingDrum(velocity=lambda t: (0.1 * np.sin(t), 0.0, 0.0), drum=drum)
            cable.pull_out(
                turning, 20.0, cable=stiff, drum=boat, current=(0.1, 0.2, 0.0), start=3.0, scheme=scheme
            )
    if scheme == "moving_end":
        cable.pull_out(turning, 60.0, scheme=cable.MovingEnd(rtol=1e-3, grading=0.1))
        held = cable.hold([(0.0, 0.0, 0.0), (5.0, 0.0, 2.0)], 8.0)
        cable.pull_out(turning, 10.0, start=held)


def towed(scheme: str) -> None:
    for drogue in (0.0, 0.05):
        cable.tow(turning, 20.0, 20.0, drogue_drag_area=drogue, scheme=scheme)
    if scheme == "moving_end":
        cable.tow(back_and_forth, 20.0, 20.0, scheme=cable.MovingEnd(rtol=1e-3))


def held() -> None:
    for bending in (0.0, 1e-4):
        for length in (5.0, 8.0, 30.0):
            rope = cable.CableProperties(mass_per_length=0.02, bending_stiffness=bending)
            cable.hold([(0.0, 0.0, 0.0), (4.0, 1.0, 2.0)], length, (0.1, 0.2, 0.0), cable=rope)


def other_code() -> None:
    """The other formulation of a coupled run, which hides effects and checks diagnoses."""
    from subzero.diagnosis import Setting
    from subzero.synthetic.reference_run import truth_of

    fig6 = subzero.load_scenario("fig6")
    setting = Setting(trial=fig6, model=subzero.Model.of(fig6))
    truth_of(setting)
    truth_of(setting.with_start(wet_length=5.0).with_drum(friction_torque=0.02, inertia=0.03))


@compiled
def beyond(values: np.ndarray, at: int) -> float:
    return values[at]


def unbounded() -> None:
    """Read beyond an array: shows that indices are checked at all."""
    beyond(np.zeros(3), 3)


JOBS = {
    "unbounded": unbounded,
    **{f"scenario {name}": partial(shipped, name) for name in scenarios.names()},
    **{f"trial {scheme}": partial(trial, scheme) for scheme in SCHEMES},
    **{f"pull_out {scheme}": partial(pulled_out, scheme) for scheme in cable.SCHEMES},
    **{f"tow {scheme}": partial(towed, scheme) for scheme in ("moving_end", "lumped")},
    "hold": held,
    "simulator": stepped,
    "other code": other_code,
}

if __name__ == "__main__":
    JOBS[sys.argv[1]]()
