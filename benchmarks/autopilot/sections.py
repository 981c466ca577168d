"""The sections of the page: each measures, and returns its text."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from subzero import autopilot
from subzero.autopilot.manoeuvres import MANOEUVRES

from .trials import FLIGHTS, Wrong, flown, lacking, trial, tuning

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
        + "\nPoles in the vehicle's time scale, λ L/U (actuators included; of a pair the upper one):\n\n"
        + table(("speed [m/s]", "cable [m]", *autopilot.SUBSYSTEMS), poles)
    )


def all_margins() -> str:
    """Margins of every loop."""
    estimates, rows = autopilot.estimates(tuning(), 0.1), []
    for loop in ("speed", "heading", "heading, LQR", "pitch", "roll"):
        for speed in SPEEDS:
            for length in LENGTHS:
                found = autopilot.loop_margins(
                    tuning(), loop.partition(",")[0], speed=speed, wet_length=length,
                    estimates=estimates if "LQR" in loop else None,
                )  # fmt: skip
                rows.append(
                    (
                        loop,
                        speed,
                        length,
                        found.gain,
                        float(np.degrees(found.phase)),
                        found.delay,
                        found.crossover,
                    )
                )
    head = ("loop", "speed [m/s]", "cable [m]", "gain", "phase [degree]", "delay [s]", "crossover [rad/s]")
    return (
        "## Stability margins\n\nOpened at the plant's input, as flown: sampled at 10 Hz, with servo and shaft, sway"
        " and heave, estimator, and the cable in steady motion. Gains are those of the bare hull.\n\n"
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
        " heading in `wide_turn`. The formula has one angle for the whole cable (`autopilot/behind.py`): of the heading"
        " error in the wide turn it takes less than the model does.\n\n" + table(head, rows)
    )


def transplant() -> str:
    """The step in heading, with and without the cable."""
    rows = []
    for name, line in autopilot.STEPS.items():
        for pilot in autopilot.AUTOPILOTS:
            for words, options in (
                ("cable, fed forward", {"feed_forward": "model"}),
                ("cable, feedback alone", {}),
                ("no cable", {"tethered": False}),
            ):
                _, found = autopilot.step(name, autopilot=pilot, tuning=tuning(), **options)
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
        "flight", "what is wrong", "knows of the cable", "speed error [mm/s]", "worst", "smaller by",
        "heading error [degree]", "worst", "smaller by",
    )  # fmt: skip
    runs = len(rows) * seeds
    return (
        f"## A wrong model\n\n{runs} seeded runs with the PID: medians over {seeds} seeds, the worst seed, and the"
        " median of how much smaller the error is than with feedback alone. The autopilot believes the model of the"
        " scenario and perfect sensors. The last line of each block has the same wrong and no cable: what is left there"
        " is no matter of the cable (noise of the sensors; a speed log that speaks of the ground, in a current), and"
        " nothing fed forward takes it away. A factor below 1 says that what was fed forward made it worse: in a wide"
        " turn through a current that is not known, the cable lies elsewhere than believed.\n\n"
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
