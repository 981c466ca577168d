"""Make values of everything that a user can make, good, at the edge and absurd: run as a child process by the tests.

    python tests/robustness/values.py SEED COUNT LOG        # random cases
    python tests/robustness/values.py every 0 LOG           # each odd value in each place, one by one

Hypothesis draws the cases: some thing that can be made or called, with one to three of its values exchanged. What is
accepted is run for a moment. Prints, as JSON, how often what came out, and what should not have: an exception that is
no `UserError`, a message that nobody can read, a result that is completed and not finite or ends elsewhere than asked.
Each case is written to LOG before it is tried, so that it is known if this process dies of it.
"""

from __future__ import annotations

import dataclasses
import datetime
import decimal
import fractions
import json
import math
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TextIO

import numpy as np
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st

import cable
import scenarios
import subzero
from scenarios.parameters import with_vehicle
from subzero import autopilot
from subzero.external_force import MissingForce, Term
from vehicle import Vehicle, from_mapping
from vehicle.cross_flow import HullSection
from vehicle.rigid_body import ProductsOfInertia

ROWS = 5
"""So many results of a run are enough to see whether it stands."""
MOST_WORK = 20_000
"""More segments or hull steps than this would take seconds a case: accepted, but not run."""


class WorkError(Exception):
    """A case that is accepted and too long to run here."""


class NobodyKnows:
    """A value whose very text is a mistake."""

    def __repr__(self) -> str:
        raise RuntimeError("no text")

    def __float__(self) -> float:
        raise RuntimeError("no number")


NUMBERS = (
    *(math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1.0, 1e-12, 5e-324, 1e-300, 1e300, -1e300, 1e308, 27.0),
    *(0, 1, -1, 3, 10**400, -(10**400), 2**63, 2**31, 60.05, 1e-3, 0.1, 10.0),
    *(np.float32(0.1), np.float64("nan"), np.int64(2), np.uint8(3), np.float16(1.0), np.longdouble("1e4000")),
    *(fractions.Fraction(1, 3), decimal.Decimal("0.1"), decimal.Decimal("NaN")),
)
ODD = (
    *(
        None,
        True,
        False,
        np.True_,
        "",
        "1",
        "nan",
        "moving_end",
        "paper",
        "paper_drum",
        "lumped",
        "brake",
        "é" * 500,
    ),
    *(
        "\x1b[31m",
        b"1",
        1j,
        [],
        (),
        {},
        set(),
        [1.0],
        (1.0, 2.0, 3.0),
        [[1.0]],
        [math.nan] * 3,
        (0.0, 0.0, 0.0),
    ),
    *(
        np.array(1.0),
        np.array([0.1]),
        np.zeros(3),
        np.zeros((2, 3)),
        np.zeros(0),
        np.full(3, np.nan),
        np.eye(3),
    ),
    *(np.array([1, "a", None], dtype=object), np.array(["1", "2", "3"]), np.zeros(3, dtype=complex)),
    *(datetime.date(2004, 1, 1), np.datetime64("2004-01-01"), float, object(), NobodyKnows(), lambda *_: 1.0),
    *({"value": 1.0}, [10**400, 0, 0], (1, 2), [(0.0, 0.0, 0.0)] * 2, iter([1.0, 2.0, 3.0]), range(3)),
)
SCALES = (0.0, -1.0, 0.5, 2.0, 0.999999, 1.0 + 1e-12, 0.1, 10.0, 1e3, 1e-3, 1e9)


def others(good: Any) -> st.SearchStrategy[Any]:
    """Return values to put in the place of a good one: near it, at the edge, and of any other kind."""
    ways = [st.sampled_from(NUMBERS), st.sampled_from(ODD)]
    if isinstance(good, bool) or good is None or callable(good):
        return st.one_of(*ways)
    if isinstance(good, (int, float)):
        near = st.sampled_from(SCALES).map(lambda scale: good * scale + (scale == 0.0) * 1e-9)
        return st.one_of(ways[0], near, near, near, near, st.floats(), ways[1])
    if isinstance(good, np.ndarray):
        return st.one_of(_array(good), _array(good), _array(good), *ways)
    if isinstance(good, (tuple, list)) and good:
        return st.one_of(_sequence(tuple(good)), _sequence(tuple(good)), _sequence(tuple(good)), *ways)
    if isinstance(good, Mapping) and good:
        return st.one_of(_mapping(good), _mapping(good), _mapping(good), *ways)
    return st.one_of(*ways)


@st.composite
def _array(draw: Any, good: np.ndarray) -> Any:
    """An array with a number exchanged, of another shape or order, or of another kind."""
    how = draw(
        st.sampled_from(
            ("number", "number", "shorter", "longer", "turned", "list", "int", "reversed", "view")
        )
    )
    array = np.array(good, dtype=float)
    if how == "number":
        array.flat[draw(st.integers(0, array.size - 1))] = draw(
            st.one_of(st.floats(), st.sampled_from((-1.0, 1e300)))
        )
    kinds = {
        "shorter": lambda: array[:-1],
        "longer": lambda: np.concatenate([array, array[-1:]]),
        "turned": lambda: array.T if array.ndim > 1 else array[:, None],
        "list": array.tolist,
        "int": lambda: array.astype(int),
        "reversed": lambda: array[::-1],
        "view": lambda: np.repeat(array, 2, axis=0)[::2],
    }
    return kinds[how]() if how in kinds else array


@st.composite
def _sequence(draw: Any, good: tuple[Any, ...]) -> Any:
    """A tuple with one of its members exchanged, dropped or doubled."""
    at, how = (
        draw(st.integers(0, len(good) - 1)),
        draw(st.sampled_from(("other", "other", "drop", "twice", "list"))),
    )
    if how == "other":
        return (*good[:at], draw(others(good[at])), *good[at + 1 :])
    return {
        "drop": (*good[:at], *good[at + 1 :]),
        "twice": (*good[:at], good[at], *good[at:]),
        "list": list(good),
    }[how]


@st.composite
def _mapping(draw: Any, good: Mapping[str, Any]) -> Any:
    """A mapping with one of its values exchanged, one dropped, or one too many."""
    name, how = (
        draw(st.sampled_from(sorted(good))),
        draw(st.sampled_from(("other", "other", "other", "drop", "more"))),
    )
    if how == "other":
        return {**good, name: draw(others(good[name]))}
    if how == "drop":
        return {key: value for key, value in good.items() if key != name}
    return {**good, draw(st.sampled_from(("masss", "", 3, None, "mass"))): 1.0}


def ahead(_: float) -> tuple[float, float, float]:
    return (1.0, 0.1, 0.0)


FIG6, UMBILICAL, CURRENT, MOVED = (
    dataclasses.replace(subzero.load_scenario(name), duration=0.4)
    for name in ("fig6", "rov_umbilical", "current", "fig5")
)
FIG6 = dataclasses.replace(FIG6, start=dataclasses.replace(FIG6.start, wet_length=4.0))
PAPER = dataclasses.replace(FIG6, scheme="paper")
MODEL = subzero.Model.of(FIG6)
TUNING = autopilot.tune(MODEL, speeds=(0.8, 1.2))
SPEED = np.array([0.0, 1.0, 2.0])


LISTED = {
    section: getattr(from_mapping(with_vehicle(FIG6, name)[0].vehicle), section)[0][1]
    for section, name in (
        ("thrusters", "bluerov2_heavy"),
        ("fins", "xfin_auv"),
        ("moving_masses", "seawing"),
        ("buoyancy_engines", "seawing"),
    )
}
"""A listed actuator of each kind."""
NPS = from_mapping(with_vehicle(FIG6, "nps_auv2")[0].vehicle)
FURTHER = {"products_of_inertia": ProductsOfInertia(xy=0.01, xz=0.02, yz=-0.01), "race": NPS.race}
"""Sections that the vehicle of fig6 does not have."""
STATIONS = NPS.sections
"""Stations of a hull, by name."""


def fields_of(value: Any) -> dict[str, Any]:
    """Return the fields of a dataclass as they are."""
    return {one.name: getattr(value, one.name) for one in dataclasses.fields(value) if one.init}


def run_trial(trial: Any, model: Any = None, tethered: bool = True, later: Any = ()) -> str:
    """Run the first rows of a trial, or all of them if there are few."""
    shorter = (ROWS - 0.4) * trial.cable_step
    if trial.duration > shorter:
        trial = dataclasses.replace(trial, duration=shorter)
    work = max(trial.start.wet_length / trial.segment_length, trial.cable_step / trial.hull_step)
    if work > MOST_WORK:
        raise WorkError
    result = subzero.simulate(trial, model=model, tethered=tethered, later=later)
    if result.attrs["outcome"] != "completed":
        check_message(result.attrs["outcome_message"])
        return "stopped"
    assert float(result["time"][-1]) == trial.duration, "the run ends elsewhere than asked"
    for name in (
        "north",
        "depth",
        "heading",
        "surge_speed",
        "cable_length",
        "drum_tension",
        "cable_force_forward",
    ):
        if name in result:
            assert np.isfinite(result[name].values).all(), f"{name} is not finite"
    return "ran"


def check_history(history: Any, duration: Any) -> str:
    """A history of a cable ends as asked, with finite numbers, or says why not."""
    assert np.isfinite(history.tow_force).all(), "a force that is not finite"
    if not history.outcome.completed:
        check_message(history.outcome.message)
        return "stopped"
    assert math.isclose(float(history.time[-1]), float(duration), rel_tol=1e-12), (
        "the run ends elsewhere than asked"
    )
    return "ran"


def check_message(message: str) -> None:
    """A message says something, on few lines that can be printed."""
    assert 10 < len(message) < 5000, f"a message of {len(message)} characters"
    assert message.replace("\n", "").isprintable(), f"a message with control characters: {message!r}"


def of_trial(name: str) -> Callable[[Any], str]:
    return lambda part: run_trial(dataclasses.replace(CURRENT if name == "profile" else FIG6, **{name: part}))


def short_pull(**arguments: Any) -> str:
    """Pull a cable out; what would take long is only accepted."""
    velocity, duration = (arguments.pop(name) for name in ("tow_velocity", "duration"))
    arguments["scheme"] = scheme_of(arguments, duration, 2.0 + number(arguments.get("start", 0.0)))
    return check_history(cable.pull_out(velocity, duration, **arguments), duration)


def short_tow(**arguments: Any) -> str:
    velocity, length, duration = (arguments.pop(name) for name in ("tow_velocity", "length", "duration"))
    arguments["scheme"] = scheme_of(arguments, duration, number(length))
    return check_history(cable.tow(velocity, length, duration, **arguments), duration)


def scheme_of(arguments: dict[str, Any], duration: Any, length: float) -> Any:
    """Take the options of the default scheme out of the arguments; return it with them, or another scheme."""
    options = {name: arguments.pop(name) for name in list(arguments) if name in OPTIONS}
    check_work(duration, options.get("time_step", 0.1), options.get("segment_length", 0.5), length)
    scheme = arguments.get("scheme", "moving_end")
    return cable.MovingEnd(**options) if isinstance(scheme, str) and scheme == "moving_end" else scheme


def number(value: Any) -> float:
    """Return a number, 1 for what is none."""
    plain = isinstance(value, (int, float)) and -1e300 < value < 1e300
    return float(value) if plain else 1.0


def check_work(duration: Any, step: Any, segment: Any, length: float) -> None:
    """Leave out what would be accepted and then takes long."""
    rows, segments = number(duration) / (number(step) or 1.0), length / (number(segment) or 1.0)
    if not (min(number(duration), number(step), number(segment)) > 0.0):
        return  # refused, or of no use
    if 300.0 < rows < 1e7 or 300.0 < segments < 1e7:
        raise WorkError


def held(**arguments: Any) -> str:
    ends, length = arguments.pop("ends"), arguments.pop("length")
    segment = arguments.get("segment_length")
    if segment is not None and number(segment) > 0.0 and 300.0 < number(length) / number(segment) < 100_000:
        raise WorkError
    found = cable.hold(ends, length, **arguments)
    assert np.isfinite(found.shape).all(), "a place that is not finite"
    return "ran"


def stepped(**arguments: Any) -> str:
    command = arguments.pop("command")
    sim = subzero.Simulator(FIG6, **arguments)
    if sim.sample_time > 5.0:
        raise WorkError
    seen = sim.step(command)
    assert math.isclose(seen.time, sim.sample_time), "the step is not as long as asked"
    sim.result()
    return "ran"


def flown(**arguments: Any) -> str:
    wanted = autopilot.Wanted(*(arguments.pop(name) for name in autopilot.Wanted._fields))
    sensor = autopilot.Sensor(channel="surge_speed", noise=arguments.pop("noise"))
    pilot = autopilot.make("pid", FIG6, tuning=TUNING, sample_time=arguments.pop("sample_time"))
    trial = dataclasses.replace(FIG6, duration=arguments.pop("duration"))
    if trial.duration > 60.0:
        raise WorkError
    sensors = autopilot.Sensors((sensor, *autopilot.PERFECT[1:]), seed=arguments.pop("seed"))
    run = autopilot.fly(trial, pilot, lambda _: wanted, sensors=sensors, **arguments)
    if run.attrs["outcome"] != "completed":
        check_message(run.attrs["outcome_message"])
        return "stopped"
    beyond = float(run["time"][-1]) - trial.duration
    assert -1e-9 < beyond <= pilot.sample_time, "the flight ends elsewhere than asked"
    return "ran"


def sensed(**arguments: Any) -> str:
    sensors = autopilot.Sensors((autopilot.Sensor(**arguments),))
    seen = subzero.Simulator(FIG6).observation
    sensors.read(seen)
    sensors.read(seen._replace(time=0.3))
    return "ran"


def trimmed(**arguments: Any) -> str:
    autopilot.trim(MODEL, **arguments)
    return "ran"


def stepping(**arguments: Any) -> str:
    sensors = autopilot.Sensors(autopilot.ESTIMATED, seed=arguments.pop("seed"))
    pilot = autopilot.Pilot(tuning=TUNING, sensors=sensors)
    run, _ = autopilot.step(scenario=FIG6, pilot=pilot, tethered=False, **arguments)
    return "ran" if run.attrs["outcome"] == "completed" else "stopped"


def manoeuvred(**arguments: Any) -> str:
    run, _ = autopilot.manoeuvre(scenario=FIG6, tethered=False, **arguments)
    return "ran" if run.attrs["outcome"] == "completed" else "stopped"


def sampled_current(**arguments: Any) -> str:
    cable.Current.sampled(lambda n, e, d, t: (0.1 * d, 0.0, 0.0), **arguments)
    return "ran"


def with_model(**parts: Any) -> Callable[[Any], str]:
    """Return what runs a model with a part of a name."""
    ((name, put),) = parts.items()
    return lambda part: run_trial(FIG6, model=dataclasses.replace(MODEL, **{name: put(part)}))


@dataclasses.dataclass(frozen=True)
class Target:
    """Something that can be made or called: its name, good values by name, and what is done with them."""

    name: str
    good: Mapping[str, Any]
    use: Callable[..., str]


def made(kind: type, good: Any, use: Callable[[Any], str]) -> Target:
    """Return a target that makes a value of a kind, and then uses it."""
    return Target(
        kind.__name__, good if isinstance(good, dict) else fields_of(good), lambda **v: use(kind(**v))
    )


def targets() -> list[Target]:
    """Return all that can be made and called."""
    found = [made(type(trial), trial, run_trial) for trial in (FIG6, FIG6, UMBILICAL, CURRENT, MOVED, PAPER)]
    found += [
        made(scenarios.Start, FIG6.start, of_trial("start")),
        made(scenarios.Commands, FIG6.commands, of_trial("commands")),
        made(scenarios.Motion, MOVED.motion, lambda m: run_trial(dataclasses.replace(MOVED, motion=m))),
        made(
            scenarios.Profile,
            {"depth": (0.0, 5.0), "velocity": ((0.1, 0.0, 0.0), (0.2, 0.1, 0.0))},
            of_trial("profile"),
        ),
        made(
            scenarios.Winch,
            {"control": "pay_out_rate", "time": (0.0, 5.0), "setpoint": (1.0, 0.5)},
            of_trial("winch"),
        ),
        made(
            scenarios.Winch, {"control": "constant_tension", "time": (0.0,), "setpoint": (1.0,)}, of_trial("winch")
        ),
        made(
            scenarios.Vessel,
            {"time": (0.0, 5.0), "velocity": ((0.1, 0.0, 0.0), (0.2, 0.1, 0.0))},
            of_trial("vessel"),
        ),
        made(subzero.Model, MODEL, lambda model: run_trial(FIG6, model=model)),
        made(Vehicle, MODEL.vehicle, with_model(vehicle=lambda v: v)),
        made(cable.CableProperties, MODEL.cable, with_model(cable=lambda c: c)),
        made(cable.CableProperties, MODEL.cable, lambda c: short_pull(**PULL | {"cable": c})),
        made(cable.DrumProperties, MODEL.drum, with_model(drum=lambda d: d)),
        made(cable.DrumProperties, MODEL.drum, lambda d: short_pull(**PULL | {"drum": d})),
        made(Term, {"axis": "X", "feature": "u|u|", "coefficient": 0.1}, of_term),
        made(MissingForce, {"time": (0.0, 1.0), "wrench": ((0.1,) * 6,) * 2, "terms": ()}, with_model(missing=same)),
        made(cable.Current, GRID, lambda c: short_pull(**PULL | {"current": c})),
        made(cable.PayOutRate, {"rate": 1.0}, lambda w: short_pull(**PULL | {"drum": w})),
        made(cable.ConstantTension, {"tension": 1.0}, lambda w: short_pull(**PULL | {"drum": w})),
        Target("later", {"later": ((0.2, MODEL),)}, lambda later: run_trial(FIG6, later=later)),
        Target("tethered", {"tethered": True, "model": MODEL}, lambda **v: run_trial(FIG6, **v)),
        Target("Current.sampled", {"north": (0.0,), "down": (0.0, 5.0), "time": (0.0, 1.0)}, sampled_current),
        Target("pull_out", PULL, short_pull),
        Target("pull_out", PULL, short_pull),
        Target("pull_out lumped", PULL | {"scheme": "lumped"}, short_pull),
        Target("tow", TOW, short_tow),
        Target("hold", HOLD, held),
        Target("Simulator", {"sample_time": 0.1, "tethered": True, "command": (25.0, 0.1, 0.0, 0.0)}, stepped),
        Target("fly", FLY, flown),
        Target("Sensor", SENSOR, sensed),
        Target("trim", TRIM, trimmed),
        Target("step", {"name": "heading_step", "size": 5.0, "speed": 1.0, "seed": 0}, stepping),
        Target("manoeuvre", {"name": "crash_stop", "size": 1.0, "speed": 1.0}, manoeuvred),
    ]  # fmt: skip
    for name, section in fields_of(MODEL.vehicle).items():
        if name not in {*LISTED, *FURTHER, "sections"}:  # below
            found.append(made(type(section), section, with_section(name)))
    for name, section in FURTHER.items():
        found.append(made(type(section), section, with_section(name)))
    found.append(
        made(
            HullSection,
            STATIONS[0][1],
            lambda part: with_section("sections")((("first", part), *STATIONS[1:])),
        )
    )
    for name, part in LISTED.items():
        found.append(made(type(part), part, lambda part, name=name: with_section(name)((("first", part),))))
    return found


def same(part: Any) -> Any:
    return part


def of_term(term: Term) -> str:
    return run_trial(FIG6, model=dataclasses.replace(MODEL, missing=MissingForce(terms=(term,))))


def with_section(name: str) -> Callable[[Any], str]:
    return lambda part: run_trial(
        FIG6, dataclasses.replace(MODEL, vehicle=dataclasses.replace(MODEL.vehicle, **{name: part}))
    )


OPTIONS: dict[str, Any] = {
    "time_step": 0.1, "segment_length": 0.5, "rtol": 0.0, "grading": 0.0, "run_in": 0.0, "tolerance": 1e-9,
}  # fmt: skip
PULL: dict[str, Any] = {
    "tow_velocity": ahead, "duration": 0.5, "cable": None, "drum": None, "current": (0.1, 0.0, 0.0),
    "start": 2.0, "scheme": "moving_end",
} | OPTIONS  # fmt: skip
TOW: dict[str, Any] = {
    "tow_velocity": ahead, "length": 5.0, "duration": 0.5, "cable": None, "current": (0.1, 0.0, 0.0),
    "drogue_drag_area": 0.0, "scheme": "moving_end",
} | OPTIONS  # fmt: skip
HOLD: dict[str, Any] = {
    "ends": ((0.0, 0.0, 0.0), (5.0, 0.0, 1.0)), "length": 8.0, "current": (0.2, 0.0, 0.0),
    "cable": cable.CableProperties(mass_per_length=0.02), "segment_length": 0.5, "start": None,
}  # fmt: skip
GRID: dict[str, Any] = {
    "velocity": np.zeros((1, 1, 1, 2, 3)), "north": np.zeros(1), "east": np.zeros(1), "down": np.array([0.0, 5.0]),
    "time": np.zeros(1),
}  # fmt: skip
FLY: dict[str, Any] = {
    "speed": 1.0, "heading": 0.1, "depth": 1.0, "roll": 0.0, "turn_rate": 0.0, "noise": 0.01, "sample_time": 0.1,
    "duration": 0.4, "seed": 0, "tethered": True,
}  # fmt: skip
SENSOR: dict[str, Any] = {
    "channel": "surge_speed", "period": 0.2, "noise": 0.01, "bias": 0.0, "drift": 0.01, "quantum": 0.01, "delay": 0.1,
    "drop_out": 0.1,
}  # fmt: skip
TRIM: dict[str, Any] = {
    "speed": 1.0, "depth_rate": 0.0, "turn_rate": 0.0, "wet_length": 10.0, "roll": 0.0, "cable": "formula",
}  # fmt: skip
TARGETS = targets()


@st.composite
def cases(draw: Any) -> tuple[Target, dict[str, Any]]:
    """A target, and values in the place of one to three of its good ones."""
    target = draw(st.sampled_from(TARGETS))
    names = draw(st.lists(st.sampled_from(sorted(target.good)), min_size=1, max_size=3, unique=True))
    return target, {name: draw(others(target.good[name])) for name in names}


def outcome(target: Target, changed: Mapping[str, Any]) -> str:
    """Return what came out; raises whatever should not have."""
    try:
        return target.use(**{**target.good, **changed})
    except subzero.UserError as error:
        check_message(str(error))
        return "refused"
    except WorkError:
        return "too long"


def text_of(target: Target, changed: Mapping[str, Any]) -> str:
    """Return a case as it can be read."""
    words = []
    for name, value in changed.items():
        try:
            words.append(f"{name}={value!r}")
        except Exception:
            words.append(f"{name}=<{type(value).__name__}>")
    return f"{target.name}({', '.join(words)})"[:500].replace("\n", " ")


class Tally:
    """Tries cases, and keeps what came out; each is written to a log before."""

    def __init__(self, file: TextIO) -> None:
        self.file = file
        self.counts: Counter[str] = Counter()
        self.by_target: Counter[str] = Counter()
        self.wrong: list[list[str]] = []

    def look(self, target: Target, changed: Mapping[str, Any]) -> None:
        self.file.write(text_of(target, changed) + "\n")
        self.file.flush()
        self.by_target[target.name] += 1
        try:
            self.counts[outcome(target, changed)] += 1
        except Exception as error:
            self.counts["wrong"] += 1
            where = traceback.extract_tb(error.__traceback__)[-1]
            place = f"{Path(where.filename).name}:{where.lineno}"
            self.wrong.append([text_of(target, changed), f"{type(error).__name__}: {error}"[:300], place])

    def drawn(self, number_of_seed: int, count: int) -> None:
        """Try so many random cases."""

        @seed(number_of_seed)
        @settings(
            max_examples=count, database=None, deadline=None, phases=[Phase.generate],
            suppress_health_check=list(HealthCheck),
        )  # fmt: skip
        @given(cases())
        def look(case: Any) -> None:
            self.look(*case)

        look()

    def every(self) -> None:
        """Put each odd value in each place of each target, one by one."""
        for target in TARGETS:
            for name in sorted(target.good):
                for value in ODD:
                    self.look(target, {name: value})


def main(which: str, count: int, log: Path) -> None:
    with open(log, "w", encoding="utf-8", errors="backslashreplace") as file:
        tally = Tally(file)
        if which == "every":
            tally.every()
        else:
            tally.drawn(int(which), count)
    print(json.dumps({"counts": tally.counts, "targets": tally.by_target, "wrong": tally.wrong[:200]}))


if __name__ == "__main__":
    main(sys.argv[1], int(sys.argv[2]), Path(sys.argv[3]))
