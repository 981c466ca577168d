"""Random coupled trials, each drawn from its number alone: what `benchmarks.trust` judges.

Free drums with and without inertia and friction, cables lighter and several times heavier than water, small umbilicals
on winches of all three controls, vessels, still, uniform and sheared water, reversals and stops.
"""

from __future__ import annotations

import dataclasses

import numpy as np

import scenarios
import subzero
from scenarios import CONTROLS

WATER = 1000.0
"""Density of the water. [kg/m³]"""


def draw(seed: int) -> scenarios.Trial:
    """Return random trial number `seed`."""
    rng, base = np.random.default_rng(seed), subzero.load_scenario("fig6")
    kind = rng.choice(["light", "heavy", "umbilical"], p=[0.45, 0.2, 0.35])
    duration = round(float(rng.uniform(5.0, 20.0)), 1)
    on_winch = kind == "umbilical" or rng.random() < 0.1
    winch = _winch(rng, duration) if on_winch else None
    return dataclasses.replace(
        base,
        name=f"trust-{seed}",
        duration=duration,
        cable_step=float(rng.choice([0.1, 0.1, 0.1, 0.04, 0.2])),
        segment_length=float(rng.choice([0.5, 0.5, 0.5, 0.25, 1.0])),
        start=_start(rng, winch),
        cable=base.cable | _cable(rng, kind),
        drum=base.drum | _drum(rng),
        winch=winch,
        vessel=_vessel(rng, duration) if rng.random() < 0.3 else None,
        commands=_commands(rng, duration),
        **_water(rng),
    )


def _cable(rng: np.random.Generator, kind: str) -> dict[str, float]:
    """Return a cable: about that of Table 1, several times heavier than water, or a small umbilical that stretches."""
    low, high = {"light": (0.0015, 0.004), "heavy": (0.0015, 0.004), "umbilical": (0.004, 0.012)}[kind]
    d = float(rng.uniform(low, high))
    area = 0.25 * np.pi * d * d
    ratio = rng.uniform(*{"light": (0.95, 1.25), "heavy": (1.5, 4.0), "umbilical": (1.0, 1.5)}[kind])
    stretch = 10.0 ** rng.uniform(-6.0, -3.0) if kind == "umbilical" or rng.random() < 0.3 else 0.0
    return {
        "diameter": d,
        "cross_section_area": area,
        "mass_per_length": float(ratio * WATER * area),
        "normal_drag_coefficient": float(rng.uniform(1.0, 1.5)),
        "tangential_drag_coefficient": float(rng.uniform(0.005, 0.02)),
        "compliance": float(stretch),
    }


def _drum(rng: np.random.Generator) -> dict[str, float]:
    """Return the inertia and friction of a drum, each of which half of them have."""
    inertia = 10.0 ** rng.uniform(-5.0, -2.0) if rng.random() < 0.5 else 0.0
    friction = rng.uniform(0.0, 0.02) if rng.random() < 0.5 else 0.0
    return {"inertia": float(inertia), "friction_torque": float(friction)}


def _winch(rng: np.random.Generator, duration: float) -> scenarios.Winch:
    """Return a winch of one of the three controls, with one to three setpoints."""
    control = str(rng.choice(CONTROLS))
    count = int(rng.integers(1, 4))
    time = tuple(np.linspace(0.0, 0.7 * duration, count).round(1).tolist())
    if control == "brake":
        return scenarios.Winch(control=control)
    low, high = (0.1, 1.4) if control == "pay_out_rate" else (0.1, 4.0)
    return scenarios.Winch(control=control, time=time, setpoint=tuple(rng.uniform(low, high, count).tolist()))


def _start(rng: np.random.Generator, winch: scenarios.Winch | None) -> scenarios.Start:
    """Return a start: the cable laid straight, or, where a winch holds it, hanging with 2 to 50 % to spare."""
    depth, heading = float(rng.uniform(2.0, 20.0)), float(rng.uniform(-np.pi, np.pi))
    speed = float(rng.choice([0.0, 0.0, rng.uniform(0.2, 1.0)]))
    wet = float(rng.choice([0.0, rng.uniform(2.0, 30.0)]))
    place = {}
    if winch is not None:
        wet, speed = float(rng.uniform(5.0, 30.0)), 0.0
        azimuth, way = rng.uniform(-np.pi, np.pi), wet / rng.uniform(1.02, 1.5)
        down = -min(depth, way * rng.uniform(0.1, 0.9))
        flat = np.sqrt(way * way - down * down)
        place = {
            "drum_north": float(flat * np.cos(azimuth)),
            "drum_east": float(flat * np.sin(azimuth)),
            "drum_down": float(down),
        }
    return scenarios.Start(heading=heading, depth=depth, surge_speed=speed, wet_length=wet, **place)


def _vessel(rng: np.random.Generator, duration: float) -> scenarios.Vessel:
    """Return a vessel that changes its velocity smoothly, up to half a metre a second."""
    time = np.linspace(0.0, duration, 4)
    velocity = np.column_stack([rng.uniform(-0.35, 0.35, (4, 2)), np.zeros(4)])
    velocity[0] = 0.0
    return scenarios.Vessel(time=tuple(time.tolist()), velocity=tuple(map(tuple, velocity.tolist())))


def _water(rng: np.random.Generator) -> dict[str, object]:
    """Return still water, a uniform current, or one that changes with depth."""
    kind = rng.choice(["still", "uniform", "sheared"], p=[0.4, 0.3, 0.3])
    if kind == "still":
        return {}
    current = (*rng.uniform(-0.4, 0.4, 2).tolist(), 0.0)
    if kind == "uniform":
        return {"current": current}
    velocity = np.column_stack([rng.uniform(-0.3, 0.3, (3, 2)), np.zeros(3)])
    profile = scenarios.Profile(depth=(0.0, 10.0, 30.0), velocity=tuple(map(tuple, velocity.tolist())))
    return {"current": current, "profile": profile}


def _commands(rng: np.random.Generator, duration: float) -> scenarios.Commands:
    """Return one to five commands: ahead, sometimes a stop or a reversal; rudder and planes as a pilot moves them."""
    count = int(rng.integers(1, 6))
    values = np.zeros((count, 4))
    values[:, 0] = rng.uniform(12.0, 35.0, count)
    values[:, 1] = np.radians(rng.uniform(-15.0, 15.0, count)) * (rng.random(count) < 0.7)
    planes = np.radians(rng.uniform(-8.0, 8.0, count)) * (rng.random(count) < 0.5)
    values[:, 2] = values[:, 3] = planes
    if count > 1 and rng.random() < 0.25:
        values[-1, 0] = rng.choice([0.0, -rng.uniform(5.0, 25.0)])
    time = np.concatenate([[0.0], np.sort(rng.uniform(0.5, 0.9 * duration, count - 1)).round(1)])
    keep = np.concatenate([[True], np.diff(time) > 0.05])
    return scenarios.Commands(time=time[keep], values=values[keep])


def tags_of(trial: scenarios.Trial) -> tuple[str, ...]:
    """Return what there is in a trial, for the table."""
    cable, drum = trial.cable, trial.drum
    heavy = cable["mass_per_length"] / (WATER * cable["cross_section_area"])
    propeller, moving = trial.commands.values[:, 0], trial.vessel is not None
    tags = [
        f"winch, {trial.winch.control}"
        if trial.winch
        else "free drum, " + ("heavy" if heavy > 1.4 else "light")
    ]
    if trial.winch is None:
        tags += ["drum with inertia"] if drum["inertia"] else ["drum without inertia"]
        tags += ["drum with friction"] if drum["friction_torque"] else ["drum without friction"]
    tags += [
        "sheared current" if trial.profile else "uniform current" if any(trial.current) else "still water"
    ]
    tags += ["vessel"] if moving else []
    tags += ["stretch"] if cable["compliance"] else []
    tags += ["reversal"] if propeller.min() < 0.0 else ["stop"] if propeller.min() == 0.0 else []
    return tuple(tags)
