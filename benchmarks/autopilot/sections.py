"""The sections of the page: each measures, and returns its text."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from subzero import autopilot
from subzero.autopilot.manoeuvres import MANOEUVRES

from . import disturbed
from .raised import Raised
from .trials import FLIGHTS, Wrong, flown, lacking, trial, tuning

if TYPE_CHECKING:
    import control

CABLES, NO_CABLE = ("none", "formula", "model"), "no cable at all"
SPEEDS, LENGTHS = (0.6, 1.0, 1.4), (0.0, 20.0, 40.0)
SEEDS = 10


def table(head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Return a table in Markdown; numbers to three digits."""
    head = list(head)
    lines = [f"| {' | '.join(head)} |", "|" + "---|" * len(head)]
    lines += ["| " + " | ".join(cell(one) for one in row) + " |" for row in rows]
    return "\n".join(lines) + "\n"


def cell(value: object) -> str:
    """Return a cell."""
    if not isinstance(value, float):
        return str(value)
    return "–" if np.isnan(value) else "∞" if np.isinf(value) else f"{value:.3g}"


def steady_motion() -> str:
    """Trims and poles."""
    model = tuning().model
    rows, poles = [], []
    for speed in SPEEDS:
        for length in LENGTHS:
            steady = autopilot.trim(model, speed=speed, wet_length=length)
            linear = autopilot.linearise(model, steady)
            unlike = 0.5 * (steady.state[15] - steady.state[14])
            rows.append((speed, length, steady.propeller_rps, -steady.wrench[0], float(np.degrees(unlike))))
            found = [
                ", ".join(
                    f"{mode.scaled:.2f}".replace("+0.00j", "")
                    for mode in autopilot.modes(autopilot.subsystem(linear, name), steady)
                    if hulls_share(autopilot.subsystem(linear, name), mode.pole) > 0.5
                )
                for name in autopilot.SUBSYSTEMS
            ]
            poles.append((speed, length, *found))
    head = (
        "speed [m/s]",
        "cable [m]",
        "propeller [rev/s]",
        "pull of the cable [N]",
        "planes against roll [degree]",
    )
    return (
        "## Steady motion, and poles about it\n\n"
        + table(head, rows)
        + "\nPoles in the vehicle's time scale, λ L/U (actuators included; of a pair the upper one). With a cable those"
        " of the hull: the poles in which its states have more than half (participation factors); the others are"
        " transverse modes of the cable, hardly damped, and the bearing from the drum. Without a cable the heading"
        " integrates, 0. On a cable it does not: the cable pulls it back to the line from the drum, and the hull"
        " swings about that line. What is left at 0 is that everything, the cable with it, may be turned about the"
        " drum. (The 0 of pitch_heave is the depth.)\n\n"
        + table(("speed [m/s]", "cable [m]", *autopilot.SUBSYSTEMS), poles)
    )


def hulls_share(part: control.StateSpace, pole: complex) -> float:
    """Return how much the hull's own states take part in a pole, from 0 to 1."""
    poles, right = np.linalg.eig(np.asarray(part.A))
    k = int(np.argmin(np.abs(poles - pole)))
    factors = np.abs(right[:, k] * np.linalg.pinv(right)[k])
    own = [not label.startswith("cable") for label in part.state_labels]
    return float(np.sum(factors[own]) / np.sum(factors))


def linear_models() -> str:
    """How well linear models do what the simulation does."""
    pulses = []
    for length in (10.0, 20.0, 40.0):
        for speed in (0.5, 1.0, 1.5):
            command, row = disturbed.held(speed, length), [length, speed]
            steady = disturbed.in_the_middle(speed, length, command)
            for part in disturbed.INPUTS:
                change = disturbed.pulse(part)
                expected = disturbed.deviations(speed, length, command, change)
                nominal = disturbed.run_with(speed, length, np.tile(command, (len(change), 1)))
                along = autopilot.linearise_along(nominal).respond(change)
                frozen, names = disturbed.frozen(part, steady, change), disturbed.SEEN[part]
                row += [
                    100.0 * max(disturbed.error(found[name], expected(name)) for name in names)
                    for found in ({name: along[name].values for name in names}, frozen)
                ]
            pulses.append(row)
    sines = []
    for length, speed in ((10.0, 0.5), (20.0, 0.5), (40.0, 0.5), (20.0, 1.0), (40.0, 1.0), (30.0, 1.4)):
        for frequency in (0.3, 0.5, 0.8, 1.2, 2.0, 4.0):
            growth = 2.0 * np.pi * speed / frequency / length
            if growth > 1.05 or 2.2 * np.pi / frequency * speed > 1.5 * length:
                continue
            row = [length, speed, frequency, growth]
            for part in disturbed.INPUTS:
                ratio = disturbed.frozen_answer(speed, length, part, frequency)
                ratio /= disturbed.answer(speed, length, part, frequency)
                row += [abs(ratio), float(np.degrees(np.angle(ratio)))]
            sines.append(row)
    parts = tuple(disturbed.INPUTS)
    return (
        "## What the linear models are worth\n\nAgainst half the difference of two coupled simulations that are"
        " disturbed by as much either way, a hundredth of a degree or of a revolution a second. A pulse of 2 s on"
        " propeller, rudder or planes, 12 s long looked at: the largest error of speed, heading and yaw rate, or pitch"
        " and pitch rate, in percent of the largest deviation. *Along* is `linearise_along`, in which the cable grows;"
        " *frozen* is `linearise` at the length and speed in the middle. (On 40 m the vehicle is slower than 1.5 m/s.)"
        "\n\n"
        + table(
            ("cable [m]", "speed [m/s]", *(f"{part}, {kind}" for part in parts for kind in ("along", "frozen"))),
            pulses,
        )
        + "\nA sine, the cable growing through the length in its middle: gain of the frozen model over that of the"
        " simulation, and what its phase is ahead. *Growth* is how much the cable grows in a period, as a share of its"
        " length: the frozen model holds to 10 % and 10° up to two fifths. Beyond that nothing frozen has an answer;"
        " `linearise_along` has.\n\n"
        + table(
            (
                "cable [m]", "speed [m/s]", "frequency [rad/s]", "growth",
                *(f"{part}, {kind}" for part in parts for kind in ("gain", "phase [degree]")),
            ),
            sines,
        )
        + "\n"
        + large_motions()
    )  # fmt: skip


def large_motions() -> str:
    """How much of that is left when the motion is large."""
    rows, command = [], disturbed.held(1.0, 20.0)
    steady = disturbed.in_the_middle(1.0, 20.0, command)
    for degrees in (0.01, 0.1, 0.5, 2.0, 5.0):
        change = disturbed.pulse("yaw_sway", np.radians([0.0, degrees, 0.0, 0.0]))
        expected = disturbed.deviations(1.0, 20.0, command, change)("heading")
        largest, row = float(np.max(expected)), [degrees, float(np.degrees(np.max(expected)))]
        for drag in (0.0, 0.5 * steady.speed * largest):
            found = disturbed.frozen("yaw_sway", steady, change, cross_flow=drag)["heading"]
            row.append(100.0 * disturbed.error(found, expected))
        rows.append((*row, float(np.degrees(expected[-1])), float(np.degrees(found[-1]))))
    head = (
        "rudder [degree]", "largest heading [degree]", "error [%]", "error with cross_flow = U ε/2 [%]",
        "heading after 12 s [degree]", "the same, with cross_flow [degree]",
    )  # fmt: skip
    return (
        "How small is small, 2 s of rudder at 1 m/s on 20 m of cable. The drag across a straight cable has no linear"
        " part, and outweighs its inertia from some 5 mm/s on: motions of a tenth of a degree are linear, those of"
        " degrees are not. For them there is `linearise(model, steady, cross_flow=W)`, the drag across made linear for"
        " a swing of ±W; half of U ε does, with ε the largest heading.\n\n" + table(head, rows)
    )


def all_margins(speeds: Sequence[float] = SPEEDS, lengths: Sequence[float] = LENGTHS) -> str:
    """Margins of every loop."""
    estimates, rows = autopilot.estimates(tuning(), 0.1), []
    for loop in ("speed", "heading", "heading, LQR", "pitch", "roll"):
        for speed in speeds:
            for length in lengths:
                name, pilot = loop.partition(",")[0], "lqr" if "LQR" in loop else "pid"
                found = autopilot.loop_margins(
                    tuning(), name, speed=speed, wet_length=length,
                    estimates=estimates if pilot == "lqr" else None,
                )  # fmt: skip
                flown = Raised(loop=name, pilot=pilot, speed=speed, wet_length=length).margin(found.gain)
                degrees = float(np.degrees(found.phase))
                rows.append((loop, speed, length, found.gain, flown, degrees, found.delay, found.crossover))
    head = (
        "loop",
        "speed [m/s]",
        "cable [m]",
        "gain",
        "gain, flown",
        "phase [degree]",
        "delay [s]",
        "crossover [rad/s]",
    )
    return (
        "## Stability margins\n\nOpened at the plant's input, as flown: sampled at 10 Hz, with servo and shaft, sway"
        " and heave, estimator, and the cable's own motion (`linearise`). Gains are those of the bare hull. *Flown* is"
        " the same gain margin of the coupled simulation: the factor on one loop's command from which on a flight with"
        " that much cable out, set off by a twentieth of a degree or a tenth of a revolution a second, grows (found to"
        " 2 %; – where the propeller is at its limit already). The cable hardly changes how much"
        " gain heading, pitch and roll bear: that is decided at 6 to 13 rad/s, where a hull feels little of it.\n\n"
        + table(head, rows)
    )


def feed_forward() -> str:
    """What feed-forward is worth."""
    rows = []
    for name in FLIGHTS:
        for pilot in autopilot.AUTOPILOTS:
            alone = (np.nan, np.nan)
            for known in CABLES:
                speed, heading = lacking(flown(name, pilot, known))
                alone = (speed, heading) if known == "none" else alone
                rows.append((name, pilot, known, 1e3 * speed, alone[0] / speed, heading, alone[1] / heading))
            speed, heading = lacking(flown(name, pilot, "none", tethered=False))
            rows.append((name, pilot, NO_CABLE, 1e3 * speed, np.nan, heading, np.nan))
    head = (
        "flight",
        "autopilot",
        "knows of the cable",
        "speed error [mm/s]",
        "smaller by",
        "heading error [degree]",
        "smaller by",
    )
    return (
        "## The cable fed forward\n\nRoot mean squares after the transients, at equal gains. `fig6`: straight on at"
        " 1 m/s for 60 s; `wide_turn`: 200° at 8°/s, then straight on. The last line of each block is the transplant:"
        " the same feedback on board the bare hull. What is asked for: five times in speed on `fig6`, three times in"
        " heading in `wide_turn`. The formula has one angle for the whole cable (`subzero/autopilot/feed_forward.py`):"
        " of the heading error in the wide turn it takes less than the model does.\n\n" + table(head, rows)
    )


def transplant() -> str:
    """The step in heading, with and without the cable."""
    rows = []
    for name, line in autopilot.STEPS.items():
        for pilot in autopilot.AUTOPILOTS:
            for words, ahead, tethered in (
                ("cable, fed forward", "model", True),
                ("cable, feedback alone", "none", True),
                ("no cable", "none", False),
            ):
                who = autopilot.Pilot(autopilot=pilot, feed_forward=ahead, tuning=tuning())
                _, found = autopilot.step(name, pilot=who, tethered=tethered)
                rows.append((f"{name} ({line.size:g})", pilot, words, *found.values()))
    head = (
        "step",
        "autopilot",
        "vehicle",
        "rise [s]",
        "overshoot",
        "settling [s]",
        "steady error [degree, m, m/s]",
    )
    return "## Steps, and the transplant\n\n" + table(head, rows)


def wrongs(kind: str, seed: int) -> Wrong:
    """Return a random error of a kind."""
    rng = np.random.default_rng([seed, *kind.encode()])
    way = rng.uniform(0.0, 2.0 * np.pi)
    each = {
        "C_t": {"drag": float(rng.choice([0.7, 1.3]))},
        "current": {"current": (0.1 * np.cos(way), 0.1 * np.sin(way), 0.0)},
        "sensors": {"sensors": autopilot.ESTIMATED, "seed": seed},
        "dead band": {"dead_band": float(rng.uniform(0.0, np.radians(1.0)))},
    }
    chosen = each.values() if kind == "all of these" else [each[kind]]
    return Wrong(**{key: value for one in chosen for key, value in one.items()})


KINDS = {
    "C_t": "C_t off by 30 %",
    "current": "current of 0.1 m/s, any way",
    "sensors": "estimated sensors",
    "dead band": "fins dead up to 1°",
    "all of these": "all of these",
}


def wrong_models(seeds: int = SEEDS) -> str:
    """How much survives."""
    rows: list[tuple[object, ...]] = []
    for name in FLIGHTS:
        for kind in KINDS:
            rows += surviving(name, kind, seeds)
    head = (
        "flight", "error of the model", "knows of the cable", "speed error [mm/s]", "worst", "smaller by",
        "heading error [degree]", "worst", "smaller by",
    )  # fmt: skip
    runs = len(rows) * seeds
    return (
        f"## A wrong model\n\n{runs} seeded runs with the PID: medians over {seeds} seeds, the worst seed, and the"
        " median of how much smaller the error is than with feedback alone. The autopilot believes the model of the"
        " scenario and perfect sensors. The last line of each block has the same error and no cable: the error left"
        " there is no matter of the cable (noise of the sensors; a speed log that speaks of the ground, in a current),"
        " and nothing fed forward takes it away. A factor below 1 says that what was fed forward made it worse: in a"
        " wide turn through a current that is not known, the cable lies elsewhere than believed.\n\n"
        + table(head, rows)
    )


def surviving(name: str, kind: str, seeds: int) -> list[tuple[object, ...]]:
    """Return the rows of a flight with one kind of error."""
    ways = {known: (known, True) for known in CABLES} | {NO_CABLE: ("none", False)}
    errors = {
        words: np.array(
            [lacking(flown(name, "pid", known, wrongs(kind, seed), tethered)) for seed in range(seeds)]
        )
        for words, (known, tethered) in ways.items()
    }
    rows: list[tuple[object, ...]] = []
    for known, found in errors.items():
        middle, worst = np.median(found, axis=0), np.max(found, axis=0)
        is_fed = known in CABLES[1:]
        ratio = np.median(errors["none"] / found, axis=0) if is_fed else np.full(2, np.nan)
        speed = (1e3 * float(middle[0]), 1e3 * float(worst[0]), float(ratio[0]))
        heading = (float(middle[1]), float(worst[1]), float(ratio[1]))
        rows.append((name, KINDS[kind], known, *speed, *heading))
    return rows


def manoeuvres() -> str:
    """Indices with and without the cable."""
    text = "## Manoeuvres\n\n"
    for name, line in MANOEUVRES.items():
        for size in (10.0, 20.0) if name.endswith("zigzag") else (line.size,):
            found = [autopilot.manoeuvre(name, size=size, tethered=tethered)[1] for tethered in (True, False)]
            rows = [(key, *(one[key] for one in found)) for key in found[0]]
            unit = "°" if line.unit == "degree" else ""
            text += (
                f"**{name}, {size:g}{unit}**: {line.meaning}\n\n"
                + table(("index", "tethered", "untethered"), rows)
                + "\n"
            )
    return text


def gains() -> str:
    """The gains."""
    text = (
        f"## Gains\n\nOf the bare hull of `{trial('fig6').name}`'s vehicle, over speed; k of each measured state, k_I,"
        " b (see `subzero/autopilot/design.py`).\n\n"
    )
    for name, schedule in tuning().gains.items():
        measured = autopilot.WEIGHTS[name].measured
        rows = [
            (float(speed), *map(float, values))
            for speed, values in zip(schedule.speeds, schedule.values, strict=True)
        ]
        text += (
            f"{name}:\n\n"
            + table(("speed [m/s]", *(f"k of {one}" for one in measured), "k_I", "b"), rows)
            + "\n"
        )
    return text
