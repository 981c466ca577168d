"""Follow the advice of runs that stop, and count how many it cures:  python -m benchmarks.stops [COUNT]

Random trials that are made to stop: heavy and stiff cables, coarse steps and segments, winches that pay out too little
or reel in, drums on boats, reversals, motions that jump, commands beyond reason, the paper's schemes. Each message is
read as a person in a hurry would: "a shorter x" halves x, "a longer x" and "more x" double it, "a higher x" adds to it,
"x = value" sets it; up to `TRIES` times, then the next thing that is named. A stop is cured if the run then reaches its
end.
"""

from __future__ import annotations

import random
import re
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

import scenarios
import subzero

DURATION_S = 8.0
TRIES = 4
"""How often one change is made before the next is tried."""
KINDS = ("heavy", "stiff", "winch", "tension", "reverse", "absurd", "motion", "paper", "hull", "vessel")
CHANGE = re.compile(r"(shorter|longer|more|higher) (\w+)|(\w+) = (\"\w+\"|[\d.e-]+)")
ADDED = {"wet_length_m": 5.0, "pay_out_rate_m_s": 1.0, "friction_torque": 0.01}
"""What "more" and "higher" add, where doubling nothing would leave nothing."""


@dataclass(frozen=True)
class Followed:
    """A trial that stopped, what was said, and which of the changes that it names, in order, cured it; None: none."""

    kind: str
    message: str
    cured_by: int | None


def commands(rng: random.Random, wild: float = 1.0) -> scenarios.Commands:
    """Return commands that jump, reverse and turn hard."""
    times = sorted({0.0, *(round(rng.uniform(0.2, DURATION_S), 2) for _ in range(4))})
    rows = [
        (wild * rng.choice((-40, -20, 0, 20, 30, 45)), *(rng.uniform(-0.6, 0.6) for _ in range(3)))
        for _ in times
    ]
    return scenarios.Commands(time=np.array(times), values=np.array(rows))


def motion(rng: random.Random) -> scenarios.Motion:
    """Return a prescribed motion of jerks."""
    times = np.array(sorted({0.0, *(round(rng.uniform(0.1, DURATION_S), 2) for _ in range(6))}))
    return scenarios.Motion(
        time=times,
        surge_speed=np.array([rng.choice((-2.0, 0.0, 0.5, 1.0, 3.0)) for _ in times]),
        pitch=np.radians([rng.uniform(-80.0, 80.0) for _ in times]),
        heading=np.radians([rng.uniform(-360.0, 360.0) for _ in times]),
    )


def trial(kind: str, rng: random.Random) -> scenarios.Trial:
    """Return a random trial of a kind that likes to stop."""
    fig6 = subzero.load_scenario("fig6")
    step = rng.choice((0.1, 0.2, 0.5, 1.0, 2.0))
    heavy = {"mass_per_length": rng.choice((0.02, 0.05, 0.2, 1.0))}
    made: dict[str, Any] = {
        "duration": DURATION_S,
        "rtol": 0.0,  # finer runs beside it say how right a run is, not whether it stops
        "cable_step": step,
        "segment_length": rng.choice((0.5, 1.0, 2.0, 5.0)),
        "commands": commands(rng, rng.choice((3.0, 4.4)) if kind == "absurd" else 1.0),
        "start": replace(
            fig6.start, wet_length=rng.choice((0.0, 5.0, 20.0)), surge_speed=rng.choice((0.0, 1.0))
        ),
        "cable": dict(fig6.cable) | ({} if kind in ("absurd", "paper") else heavy),
    }
    made |= special(kind, rng, made)
    return replace(fig6, **made)


def special(kind: str, rng: random.Random, made: dict[str, Any]) -> dict[str, Any]:
    """Return what makes a trial of its kind; what is in `made` already may be changed there."""

    def three() -> tuple[float, float, float]:
        return (rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0), rng.uniform(-2.0, 2.0))

    if kind == "stiff":
        made["cable"] |= {"bending_stiffness": rng.choice((1e-3, 1e-2, 0.1, 1.0))}
    if kind == "motion":
        made["commands"] = None
        return {"motion": motion(rng)}
    if kind == "winch":
        return {"winch": scenarios.Winch(control="pay_out_rate", time=(0.0, 3.0, 6.0), setpoint=three())}
    if kind == "tension":
        pull = (rng.uniform(0.02, 50.0), rng.uniform(0.02, 50.0))
        return {"winch": scenarios.Winch(control="constant_tension", time=(0.0, 5.0), setpoint=pull)}
    if kind == "vessel":
        return {"vessel": scenarios.Vessel(time=(0.0, 3.0, 6.0), velocity=(three(), three(), three()))}
    if kind in ("absurd", "hull"):
        return {"hull_step": min(made["cable_step"], 1.0) / rng.choice((1, 2))}
    return {"scheme": rng.choice(("paper_tangent", "paper_drum"))} if kind == "paper" else {}


def outcome(one: scenarios.Trial) -> str:
    """Return why a trial stops, empty if it does not."""
    run = subzero.simulate(one)
    return "" if run.attrs["outcome"] == "completed" else str(run.attrs["outcome_message"])


def changes(message: str) -> Iterator[Callable[[scenarios.Trial], scenarios.Trial]]:
    """Give what a message tells to change, thing by thing."""
    advice = message[message.rindex("Try ") :]
    for how, name, key, value in CHANGE.findall(advice):
        if key:
            yield lambda one, key=key, value=value: setting(one, key, value.strip('"'))
        else:
            yield lambda one, name=name, how=how: scaled(one, name, how)


def setting(one: scenarios.Trial, key: str, value: str) -> scenarios.Trial:
    """Set something to a value."""
    if key == "control":
        return replace(one, winch=scenarios.Winch(control=value, time=(0.0,), setpoint=(1.0,)))
    if key == "scheme":
        return replace(one, scheme=value)
    return replace(one, cable={**one.cable, key: float(value)})


def scaled(one: scenarios.Trial, name: str, how: str) -> scenarios.Trial:
    """Halve, double, or add to something."""
    factor = 0.5 if how == "shorter" else 2.0
    if name == "cable_step_s":
        step = factor * one.cable_step
        return replace(one, cable_step=step, hull_step=scenarios.steps.fitting_step(step, one.hull_step))
    if name == "hull_step_s":
        return replace(one, hull_step=factor * one.hull_step)
    if name == "segment_length_m":
        return replace(one, segment_length=factor * one.segment_length)
    if name == "wet_length_m":
        return replace(one, start=replace(one.start, wet_length=one.start.wet_length + ADDED[name]))
    if name == "friction_torque":
        return replace(one, drum={**one.drum, name: one.drum.get(name, 0.0) + ADDED[name]})
    if name == "pay_out_rate_m_s" and one.winch is not None:
        rates = tuple(rate + ADDED[name] for rate in one.winch.setpoint)
        return replace(one, winch=replace(one.winch, setpoint=rates))
    raise ValueError(name)


def follow(kind: str, one: scenarios.Trial, message: str) -> Followed:
    """Follow the advice of a trial that stopped."""
    for number, change in enumerate(changes(message)):
        tried = one
        for _ in range(TRIES):
            try:
                changed = change(tried)
                if outcome(changed) == "":
                    return Followed(kind, message, number)
            except subzero.UserError:  # as far as this goes
                break
            tried = changed
    return Followed(kind, message, None)


def followed(count: int, seed: int = 1) -> list[Followed]:
    """Return what became of so many trials that stopped."""
    rng, found = random.Random(seed), []
    while len(found) < count:
        kind = KINDS[len(found) % len(KINDS)] if rng.random() < 0.7 else rng.choice(KINDS)
        one = trial(kind, rng)
        message = outcome(one)
        if message:
            found.append(follow(kind, one, message))
    return found


def main(count: int) -> None:
    found = followed(count)
    stops, cured, first = (Counter[str](), Counter[str](), Counter[str]())
    for one in found:
        stops[one.kind] += 1
        cured[one.kind] += one.cured_by is not None
        first[one.kind] += one.cured_by == 0
        if one.cured_by is None:
            print(f"not cured, {one.kind}: {one.message}")
    print(f"{'':10} stops  cured  by the first advice")
    for kind in sorted(stops):
        print(f"{kind:10} {stops[kind]:5} {cured[kind]:6} {first[kind]:6}")
    print(
        f"{'all':10} {stops.total():5} {cured.total():6} {first.total():6}   {cured.total() / stops.total():.0%}"
    )


if __name__ == "__main__":
    main(int(sys.argv[1]) if sys.argv[1:] else 100)
