"""A vehicle from few numbers: all others follow from a complete vehicle, the *base*, by similarity.

    base = "torpedo"
    [known]
    length_m = 2.0
    mass_kg = 45.0

A hull that is stretched by λ_L = L/L₀ along its axis and by λ_D = D/D₀ across it has

    volumes, added mass ∝ ρ L D²     pitch inertia ∝ m L²     roll inertia ∝ m D²     fins ∝ D²     Y_uv ∝ ρ L D  …

`POWERS` has them all. Nose and tail are stretched by s more, so that the hull displaces what the vehicle weighs: with
C = ∇/(π/4 D² L),

    s = (1 − C)/(1 − C₀)

Masses and inertias then follow the moments of the hull, ∫R² dx, ∫x² R² dx, …, and Lamb's factors k₁, k₂, k′ of a
spheroid (Lamb 1932, section 114).

A speed at a command fixes the propeller: its diameter where both are known, else its command where the speed is,

    ρ D_p² (1 − t) (k_T0 n² D_p² − k_T1 n D_p u_a − k_T2 u_a²) = X_hull + 4 X_fin      at u, u_a = (1 − w) u

A number that the file gives itself stands as it is. One that is derived keeps the range of the base, scaled, and half
of its width is its tolerance: it is known no better than of a vehicle that was never measured. What does not depend on
the size (coefficients, servos) is that of the base, a guess.

`tail_angle_deg` turns the tail about the axis: a cross of rudder and stern-planes becomes a list of four fins.
Each fin keeps area, coefficients, station and arm of the one that it was, and follows rudder, mean and difference of
the stern-planes, behind their servos (`vehicle.fin_list`). At 45 degrees four fins of one shape turn and pitch as
the two of the cross did, as 4 sin² 45° = 2, and roll twice as much.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.files import Source
from scenarios.quantities import KNOWN
from subzero.errors import real

Leaf = Mapping[str, Any]

BASE, SECTION = "base", "known"

STANDS_FOR = {
    "length_m": ("hull.length",),
    "diameter_m": ("hull.diameter",),
    "mass_kg": ("rigid_body.mass",),
    "net_buoyancy_N": ("buoyancy.net_buoyancy",),
    "fin_area_m2": ("rudder.area", "stern_planes.area"),
    "fin_station_m": ("rudder.station", "stern_planes.station"),
    "propeller_diameter_m": ("propeller.diameter",),
    "tow_station_m": ("tow_point.x",),
    "water_density_kg_m3": ("water.density",),
}
"""Key of [known] → the numbers of the vehicle that it gives; the two others are a speed and its command."""


def _powers(table: str) -> dict[str, tuple[int, int]]:
    """Read lines ``powers of L and D ; keys`` into key → powers."""
    lines = [line.split(";") for line in table.strip().splitlines()]
    return {
        key: (int(powers.split()[0]), int(powers.split()[1]))
        for powers, keys in lines
        for key in keys.split()
    }


POWERS = _powers("""
1 0 ; hull.length hull.nose_station hull.nose_length hull.tail_length
0 1 ; hull.diameter
1 0 ; rigid_body.centre_of_gravity_x buoyancy.centre_of_buoyancy_x tow_point.x rudder.station stern_planes.station
0 1 ; rigid_body.centre_of_gravity_y rigid_body.centre_of_gravity_z tow_point.y tow_point.z rudder.arm stern_planes.arm
0 1 ; buoyancy.centre_of_buoyancy_y buoyancy.centre_of_buoyancy_z propeller.diameter
1 2 ; rigid_body.mass added_mass.surge added_mass.sway added_mass.heave buoyancy.net_buoyancy
1 4 ; rigid_body.roll_inertia
3 2 ; rigid_body.pitch_inertia rigid_body.yaw_inertia added_mass.pitch added_mass.yaw
0 5 ; added_mass.roll
2 2 ; added_mass.sway_yaw added_mass.heave_pitch
1 1 ; body_lift.sway_per_sway body_lift.heave_per_heave
2 1 ; body_lift.sway_per_yaw body_lift.heave_per_pitch body_lift.yaw_per_sway body_lift.pitch_per_heave
3 1 ; body_lift.yaw_per_yaw body_lift.pitch_per_pitch
1 1 ; linear_damping.surge linear_damping.sway linear_damping.heave
1 3 ; linear_damping.roll
3 1 ; linear_damping.pitch linear_damping.yaw
1 1 ; quadratic_damping.sway_per_sway quadratic_damping.heave_per_heave
3 1 ; quadratic_damping.sway_per_yaw quadratic_damping.heave_per_pitch
2 1 ; quadratic_damping.yaw_per_sway quadratic_damping.pitch_per_heave
4 1 ; quadratic_damping.yaw_per_yaw quadratic_damping.pitch_per_pitch
1 4 ; quadratic_damping.roll_per_roll
0 2 ; rudder.area stern_planes.area
""")
"""Number → the powers of length and diameter that it grows with. The origin is the hull's centre."""

CORNERS = {
    "lower_starboard": ("stern_planes", 0.0),
    "lower_port": ("rudder", 90.0),
    "upper_port": ("stern_planes", 180.0),
    "upper_starboard": ("rudder", -90.0),
}
"""Name of a fin → the section that it was in, and the direction of its span in the cross [degree]."""
SHAPE = (
    *("area", "lift_slope", "aspect_ratio", "span_efficiency"),
    *("profile_drag_coefficient", "normal_force_coefficient", "stall_angle"),
)
SHARES = ("rudder_share", "plane_share", "roll_share")
FULL_SPEED_MARGIN = 1.2
"""The motor reaches the known speed of the propeller with so much to spare: a drive is not sized without. [-]"""
FULLEST, LEAST = 0.98, 0.1
"""Nose and tail together are at most this share of the hull, and at least this share of the base's. [-]"""
SLICES = 2000
"""Midpoint slices of the hull's moments: relative errors under 1e-4. [-]"""
SMALLEST, LARGEST = 0.1, 1.5
"""A propeller is looked for between these diameters, of the hull's. [-]"""


@dataclass(frozen=True, kw_only=True)
class Given:
    """What a file says itself: the base's numbers, its own, and the speed with its command.

    Attributes:
        base: dotted key → the base's inline table.
        own: dotted key → the file's.
        speed: straight ahead. [m/s]
        rps: of the propeller at that speed. [rev/s]
    """

    base: Mapping[str, Leaf]
    own: Mapping[str, Leaf]
    speed: float | None
    rps: float | None

    def before(self, key: str) -> float:
        """Return the base's value."""
        return float(self.base[key]["value"])

    def said(self, key: str) -> float | None:
        """Return the file's own value; None if it has none, or no number."""
        return real(self.own.get(key, {}).get("value"))

    def now(self, key: str) -> float:
        """Return the file's own value, or that of the base."""
        value = self.said(key)
        return self.before(key) if value is None else value

    def times(self, key: str) -> float:
        """Return how many times the base's value the file's own is, 1 where it says none."""
        return self.now(key) / self.before(key)


def lamb_factors(slenderness: float) -> tuple[float, float, float]:
    """Return k₁, k₂, k′ of a prolate spheroid, length over diameter above 1 (Lamb 1932, section 114). [-]"""
    e2 = 1.0 - 1.0 / slenderness**2
    e = math.sqrt(e2)
    log = math.log((1.0 + e) / (1.0 - e))
    along, across = 2.0 * (1.0 - e2) / e**3 * (0.5 * log - e), 1.0 / e2 - (1.0 - e2) / (2.0 * e**3) * log
    turned = e2**2 * (across - along) / ((2.0 - e2) * (2.0 * e2 - (2.0 - e2) * (across - along)))
    return along / (2.0 - along), across / (2.0 - across), turned


def moments(hull: Mapping[str, float]) -> tuple[float, float, float, float]:
    """Return ∫R², ∫x R², ∫x² R² and ∫R⁴ dx of a Myring hull (`docs/hull.md` has its radius). [m3, m4, m5, m5]

    Args:
        hull: numbers of the section [hull], by key; x counts forward of its origin.
    """
    D, a, c, n = (hull[key] for key in ("diameter", "nose_length", "tail_length", "nose_exponent"))
    tan, step = math.tan(hull["tail_angle"]), hull["length"] / SLICES
    aft = step * (np.arange(SLICES) + 0.5)
    s = np.maximum(aft - (hull["length"] - c), 0.0)
    R = D / 2.0 - (1.5 * D / c**2 - tan / c) * s**2 + (D / c**3 - tan / c**2) * s**3
    R *= np.clip(1.0 - np.minimum((aft - a) / a, 0.0) ** 2, 0.0, None) ** (1.0 / n)
    x, square = hull["nose_station"] - aft, np.maximum(R, 0.0) ** 2
    zeroth, first, second = (float(np.sum(square * x**power)) * step for power in range(3))
    return zeroth, first, second, float(np.sum(square**2)) * step


def complete(source: Source, base: Mapping[str, Leaf], leaves: Mapping[str, Leaf]) -> Source:
    """Return a vehicle file with all of its numbers, each with range, tolerance and source.

    Args:
        source: the file, with ``base`` and [known].
        base: dotted key → inline table of the base, complete.
        leaves: the same of the file itself, without [known].

    Raises:
        ScenarioError: keys or numbers of [known] that cannot be, and a speed that no propeller reaches.
    """
    given = _given(source, base, leaves)
    named, (factors, added) = str(source.table[BASE]), _factors(source, given)
    table: dict[str, Any] = {}
    for key, leaf in base.items():
        section, _, name = key.rpartition(".")
        own = given.own.get(key)
        made = (
            {"source": "given in this file"} | dict(own)
            if own
            else _scaled(leaf, factors.get(key), added.get(key, 0.0), named)
        )
        table.setdefault(section, {})[name] = made
    for key, leaf in leaves.items():
        section, _, name = key.rpartition(".")
        # A key that the base does not have is of a listed actuator or a derivative, or is refused later.
        table.setdefault(section, {}).setdefault(name, leaf)
    if angle := real(source.table.get(SECTION, {}).get("tail_angle_deg")):
        _turn_tail(table, angle)
    return replace(source, table=table, text="\n".join(_text(source, table)) + "\n")


def _turn_tail(table: dict[str, dict[str, Any]], degrees: float) -> None:
    """Put four listed fins, turned by an angle from the cross, in the place of rudder and stern-planes.

    Args:
        table: section → key → inline table of a complete vehicle; changed, but for numbers of these fins that it has.
        degrees: how far the tail is turned, starboard down. [degree]
    """
    source = f"derived: of the cross, turned by {degrees:g} degrees"
    for name, (section, cross) in CORNERS.items():
        was, angle = table[section], math.radians(cross + degrees)
        servo = table["rudder_servo" if section == "rudder" else "stern_plane_port_servo"]
        arm = float(was["arm"]["value"])
        place = {"y": arm * math.cos(angle), "z": arm * math.sin(angle)}
        fin: dict[str, Any] = {key: was[key] for key in SHAPE} | {"x": was["station"]}
        fin |= {
            key: {"value": round(value, 9), "unit": "m", "source": source} for key, value in place.items()
        }
        fin["span_angle"] = {"value": round(angle, 9), "unit": "rad", "source": source}
        fin |= {
            key: {"value": 1.0, "unit": "1", "source": "derived: it follows as a tail does"} for key in SHARES
        }
        fin |= {key: servo[key] for key in ("lag", "rate_limit", "deflection_limit")}
        table[f"fins.{name}"] = fin | table.get(f"fins.{name}", {})
    for section in ("rudder", "stern_planes"):
        table[section]["area"] = {"value": 0.0, "unit": "m2", "source": "its fins are listed: [fins]"}


def _scaled(leaf: Leaf, factor: float | None, added: float, named: str) -> dict[str, Any]:
    """Return a number of the base, scaled and moved; as it is, and a guess, where it has no factor."""
    if factor is None or (leaf["value"] == 0.0 and "range" not in leaf):
        was = str(leaf.get("source", ""))
        guess = was if was.startswith("estimate") else f"estimate: as {named} ({was})"
        return {name: value for name, value in leaf.items() if name != "tolerance"} | {"source": guess}
    value, unit = factor * float(leaf["value"]) + added, leaf["unit"]
    made: dict[str, Any] = {"value": _rounded(value), "unit": unit}
    if "range" in leaf:
        low, high = sorted(factor * float(end) + added for end in leaf["range"])
        made["range"] = [_rounded(min(low, value)), _rounded(max(high, value))]
        half = _rounded(0.5 * (made["range"][1] - made["range"][0]))
        made |= {"tolerance": half} if half > 0.0 else {}
    return made | {"source": f"derived: {factor:.4g} times that of {named}, by similarity"}


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")


def _text(source: Source, table: Mapping[str, Mapping[str, Leaf]]) -> Iterator[str]:
    """Return the lines of a file that says all numbers itself, one a line."""
    yield from (line for line in source.text.splitlines() if line.startswith("#"))
    for section, numbers in table.items():
        yield f"\n[{section}]"
        for name, leaf in numbers.items():
            inside = ", ".join(
                f"{key} = {json.dumps(value, ensure_ascii=False)}" for key, value in leaf.items()
            )
            yield f"{name if name.isidentifier() else json.dumps(name)} = {{ {inside} }}"


def _given(source: Source, base: Mapping[str, Leaf], leaves: Mapping[str, Leaf]) -> Given:
    """Return what a file says itself, with [known] as numbers of the vehicle; refuse what cannot be."""
    known = source.table.get(SECTION, {})
    if not isinstance(known, Mapping):
        raise ScenarioError(
            [source.problem(SECTION, "this is not a section", "Write [known] above its keys.")]
        )
    rows = {quantity.name: quantity for quantity in KNOWN}
    problems: list[Problem] = []
    for key, value in known.items():
        place, number = f"{SECTION}.{key}", real(value)
        if key not in rows:
            problems.append(
                source.problem(place, "no such number is known", nearest_or_all(key, rows), found=value)
            )
        elif number is None or not rows[key].low <= number <= rows[key].high:
            problems.append(source.problem(place, "this cannot be", rows[key].allowed, found=value))
    if problems:
        raise ScenarioError(problems)
    said: dict[str, Leaf] = {}
    for key, places in STANDS_FOR.items():
        for place in places if key in known else ():
            unit, origin = base[place]["unit"], f"measured: {key} of [known]"
            said[place] = {"value": float(known[key]), "unit": unit, "source": origin}
    speed, rps = (real(known.get(key)) for key in ("speed_m_s", "propeller_rps"))
    return Given(base=base, own=said | dict(leaves), speed=speed, rps=rps)


def _factors(source: Source, given: Given) -> tuple[dict[str, float], dict[str, float]]:
    """Return how many times the base's value each derived number is, and an addend to some."""
    long, wide = given.times("hull.length"), given.times("hull.diameter")
    if given.said("hull.length") is None:
        long = wide  # of one size only: the whole hull is larger
    elif given.said("hull.diameter") is None:
        wide = long
    dense = given.times("water.density")
    factors = {key: long**L * wide**D for key, (L, D) in POWERS.items()}
    factors |= {key: f * dense for key, f in factors.items() if "kg" in given.base[key]["unit"]}
    slenderness = given.before("hull.length") / given.before("hull.diameter")
    lamb = zip(lamb_factors(max(slenderness * long / wide, 1.01)), lamb_factors(slenderness), strict=True)
    factors |= _ends(given, long, wide, factors)
    old, new = (moments(_hull(given, grown)) for grown in ({}, factors))
    volume, turned = (dense * new[i] / old[i] for i in (0, 2))
    k1, k2, k_turned = (now / then for now, then in lamb)
    factors["added_mass.surge"] = volume * k1
    factors |= dict.fromkeys(("added_mass.sway", "added_mass.heave"), volume * k2)
    factors |= dict.fromkeys(("added_mass.pitch", "added_mass.yaw"), turned * k_turned)
    lift = given.said("buoyancy.net_buoyancy")
    lift = volume * given.before("buoyancy.net_buoyancy") if lift is None else lift
    factors["buoyancy.net_buoyancy"] = volume
    rho, gravity, mass = (given.now(key) for key in ("water.density", "water.gravity", "rigid_body.mass"))
    if given.said("rigid_body.mass") is None:
        mass = math.pi * rho * new[0] - lift / gravity
    heavy = factors["rigid_body.mass"] = mass / given.before("rigid_body.mass")
    factors["rigid_body.roll_inertia"] = heavy * new[3] / old[3] * old[0] / new[0]
    pitch = heavy * _spread(new) / _spread(old)
    factors["rigid_body.pitch_inertia"] = factors["rigid_body.yaw_inertia"] = pitch
    moved = new[1] / new[0] - long * old[1] / old[0]
    coupled = moved * factors["added_mass.sway"] * given.before("added_mass.sway")
    added = {f"{key}_x": moved for key in ("rigid_body.centre_of_gravity", "buoyancy.centre_of_buoyancy")}
    added |= {"added_mass.sway_yaw": coupled, "added_mass.heave_pitch": -coupled}
    return factors | _drive(source, given, factors), added


def _spread(m: tuple[float, float, float, float]) -> float:
    """Return the square of the radius of gyration in pitch of a hull that is filled evenly. [m2]"""
    return (m[2] - m[1] ** 2 / m[0] + 0.25 * m[3]) / m[0]


def _hull(given: Given, factors: Mapping[str, float]) -> dict[str, float]:
    """Return the numbers of the hull; without factors those of the base."""
    names = [key for key in given.base if key.startswith("hull.")]
    own = {key: given.said(key) for key in names} if factors else {}
    return {
        key.removeprefix("hull."): own[key]
        if own.get(key) is not None
        else factors.get(key, 1.0) * given.before(key)  # type: ignore[misc]
        for key in names
    }


def _ends(given: Given, long: float, wide: float, factors: Mapping[str, float]) -> dict[str, float]:
    """Return the factors of nose and tail: such that the hull displaces the mass, if that is known."""
    base, mass, stretch = _hull(given, {}), given.said("rigid_body.mass"), 1.0
    ends = {"hull.nose_length", "hull.tail_length"}
    if mass is not None and not ends & set(given.own):
        box = math.pi / 4.0 * base["diameter"] ** 2 * base["length"]
        full, lift = math.pi * moments(base)[0] / box, given.said("buoyancy.net_buoyancy") or 0.0
        displaced = (mass + lift / given.now("water.gravity")) / given.now("water.density")
        most = FULLEST * base["length"] / (base["nose_length"] + base["tail_length"])
        stretch = min(max((1.0 - displaced / (box * long * wide**2)) / (1.0 - full), LEAST), most)
    angle = math.atan(math.tan(base["tail_angle"]) * wide / (long * stretch)) / base["tail_angle"]
    return dict.fromkeys(ends, stretch * long) | {"hull.tail_angle": angle}


def _drive(source: Source, given: Given, factors: dict[str, float]) -> dict[str, float]:
    """Return the factors of the propeller and its motor, of a vehicle whose speed is known."""
    if given.speed is None:
        return {}

    def number(key: str) -> float:
        said = given.said(key)
        if key.startswith(("derivatives.", "fins.")):
            return said or 0.0
        return factors.get(key, 1.0) * given.before(key) if said is None else said

    drag, found = _drag(number, given.speed), {}
    hull, own = number("hull.diameter"), given.said("propeller.diameter")
    if given.rps is not None and own is None:
        low, high = SMALLEST * hull, LARGEST * hull
        if (
            not _thrust(number, low, given.rps, given.speed)
            < drag
            < _thrust(number, high, given.rps, given.speed)
        ):
            why = f"no propeller of {low:.3g} to {high:.3g} m drives this hull at that speed and {given.rps:g} rev/s"
            remedy = f"Its drag is {drag:.3g} N: check speed and command, or leave propeller_rps out."
            raise ScenarioError([source.problem(f"{SECTION}.speed_m_s", why, remedy, found=given.speed)])
        for _ in range(60):
            middle = 0.5 * (low + high)
            is_small = _thrust(number, middle, given.rps, given.speed) < drag
            low, high = (middle, high) if is_small else (low, middle)
        found["propeller.diameter"] = high / given.before("propeller.diameter")
    elif given.rps is not None:
        found["axial_drag.drag_coefficient"] = _drag_factor(source, given, number, drag)
    rps = given.rps or speed_command(number, given.speed)
    ceiling = FULL_SPEED_MARGIN * rps / number("battery.full_voltage")
    found["motor.speed_per_volt"] = max(ceiling / given.before("motor.speed_per_volt"), 1e-6)
    strong = factors["rigid_body.mass"]  # a larger pack sags less, in proportion
    return found | dict.fromkeys(
        ("battery.internal_resistance", "battery.voltage_drop_per_charge"), 1.0 / strong
    )


def _drag_factor(source: Source, given: Given, number: Any, drag: float) -> float:
    """Return the factor of the drag coefficient with which a known propeller drives the hull at the known speed."""
    thrust = _thrust(number, number("propeller.diameter"), float(given.rps or 0.0), float(given.speed or 0.0))
    own = drag - _drag(
        lambda key: 0.0 if key.startswith("axial_drag") else number(key), float(given.speed or 0.0)
    )
    factor = (thrust - drag + own) / own if own > 0.0 else 0.0
    if factor <= 0.0:
        why = f"at {given.rps:g} rev/s this propeller gives {thrust:.3g} N, and fins alone take {drag - own:.3g} N"
        remedy = "Check speed_m_s, propeller_rps and propeller_diameter_m: they contradict one another."
        raise ScenarioError([source.problem(f"{SECTION}.propeller_rps", why, remedy, found=given.rps)])
    return factor


def _drag(number: Any, speed: float) -> float:
    """Return the drag of hull and four fins, straight ahead. [N]"""
    rho = number("water.density")
    hull = math.pi / 8.0 * rho * number("hull.diameter") ** 2 * number("axial_drag.drag_coefficient")
    fins = sum(
        number(f"{fin}.area") * number(f"{fin}.profile_drag_coefficient")
        for fin in ("rudder", "stern_planes")
    ) + 0.5 * sum(
        number(f"fins.{name}.area") * number(f"fins.{name}.profile_drag_coefficient") for name in CORNERS
    )
    linear, square, primed = (number(f"derivatives.X_{name}") for name in ("u", "uu", "uu'"))
    hull += rho * fins - square - 0.5 * rho * number("hull.length") ** 2 * primed
    return float(hull * speed**2 - (linear + number("linear_damping.surge")) * speed)


def _thrust(number: Any, diameter: float, rps: float, speed: float) -> float:
    """Return the thrust on the hull, (1 − t) T, of a propeller of a diameter [m] ahead. [N]"""
    water = (1.0 - number("propeller.wake_fraction")) * speed
    k0, k1, k2 = (number(f"propeller.thrust_{name}") for name in ("constant", "slope", "curvature"))
    D, sum_ = diameter, k0 * (rps * diameter) ** 2 - k1 * rps * diameter * water - k2 * water**2
    return float(number("water.density") * D**2 * (1.0 - number("propeller.thrust_deduction")) * sum_)


def speed_command(number: Any, speed: float) -> float:
    """Return the propeller command that drives a vehicle at a speed straight ahead, 0 without thrust. [rev/s]

    Args:
        number: dotted key of a vehicle → its value.
        speed: through the water. [m/s]
    """
    D, drag = number("propeller.diameter"), _drag(number, speed)
    water = (1.0 - number("propeller.wake_fraction")) * speed
    k0, k1, k2 = (number(f"propeller.thrust_{name}") for name in ("constant", "slope", "curvature"))
    needed = (
        drag / (number("water.density") * D**2 * (1.0 - number("propeller.thrust_deduction"))) + k2 * water**2
    )
    if k0 <= 0.0:
        return 0.0
    return float((k1 * water + math.sqrt((k1 * water) ** 2 + 4.0 * k0 * needed)) / (2.0 * k0 * D))
