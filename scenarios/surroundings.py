"""What is around vehicle and cable: the water, which may change with depth, a winch, and a vessel that carries it.

Without [winch] the drum is free, without [vessel] it stands on the shore, and without a profile the water moves the
same everywhere.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from scenarios.errors import Problem
from scenarios.files import Source
from scenarios.quantities import PROFILE, SECTIONS, WINCH
from scenarios.samples import check_times, inline
from scenarios.schema import check_section
from scenarios.trial import ONLY_DEFAULT, SCHEMES, Profile, Vessel, Winch, only_default

CURRENT = ("current_north_m_s", "current_east_m_s", "current_down_m_s")
SETPOINT = {"pay_out_rate": "pay_out_rate_m_s", "constant_tension": "tension_N", "brake": ""}
"""Control of a winch → the list that it follows."""

Read = tuple[dict[str, Any], list[Problem]]
"""Fields of a `Trial`, and the problems; fields are only good without problems."""


def read_surroundings(source: Source) -> Read:
    """Read [water], [winch] and [vessel] of a trial."""
    fields: dict[str, Any] = {}
    problems: list[Problem] = []
    for read in (_read_water, _read_winch, _read_vessel):
        found, wrong = read(source)
        fields |= found
        problems += wrong
    return fields, problems


def _lists(values: Mapping[str, Any], section: str) -> dict[str, list[float]]:
    """Return the lists of a section that are given, by name."""
    names = (quantity.name for quantity in SECTIONS[section] if quantity.many)
    return {name: values[name] for name in names if values.get(name) is not None}


def _vectors(lists: Mapping[str, list[float]], names: list[str], count: int) -> tuple[Any, ...]:
    """Return three lists as `count` vectors; a list that is left out is zero."""
    columns = [lists.get(name, [0.0] * count) for name in names]
    return tuple(tuple(float(x) for x in row) for row in zip(*columns, strict=False))


def _read_water(source: Source) -> Read:
    """Return the uniform current, and what is added to it by depth."""
    values, problems = check_section(source, "water", source.table.get("water", {}))
    current = tuple(float(values.get(name, 0.0)) for name in CURRENT)
    lists = _lists(values, "water")
    if not lists:
        return {"current": current}, problems
    problems += _check_profile(source, lists)
    if problems:  # a profile is made of good numbers only
        return {"current": current}, problems
    names = [quantity.name for quantity in PROFILE[1:]]
    depth = tuple(float(x) for x in lists.get("depth_m", []))
    return {
        "current": current,
        "profile": Profile(depth=depth, velocity=_vectors(lists, names, len(depth))),
    }, problems


def _check_profile(source: Source, lists: Mapping[str, list[float]]) -> list[Problem]:
    """Return the problems of a profile: depths that increase, and one velocity for each."""
    given = source.table["water"]
    if "depth_m" not in given:
        why = "[water] does not say at which depths"
        return [source.problem(f"water.{name}", why, "Add depth_m, from top to bottom.") for name in lists]
    if not any(name in given for name in (quantity.name for quantity in PROFILE[1:])):
        why = "[water] does not say how the water moves there"
        return [source.problem("water.depth_m", why, "Add profile_north_m_s, profile_east_m_s, or both.")]
    depth = lists.get("depth_m")
    if depth is None:
        return []  # its own problem has been told
    problems = [
        source.problem(
            f"water.{name}",
            f"this list has {len(values)} and depth_m has {len(depth)} values",
            "Give one value for each depth.",
        )
        for name, values in lists.items()
        if len(values) != len(depth)
    ]
    for at, (above, below) in enumerate(pairwise(depth), start=1):
        if not below > above:
            why, remedy = f"the depth before it is {above:g}", "Depths must increase from top to bottom."
            problems.append(source.problem(f"water.depth_m[{at}]", why, remedy, found=below))
    return problems


def _read_winch(source: Source) -> Read:
    """Return what turns the drum."""
    if "winch" not in source.table:
        return {}, []
    values, problems = check_section(source, "winch", source.table["winch"])
    lists = _lists(values, "winch")
    if "control" not in values:
        return {}, problems  # `check_page` or `check_section` has said so
    control = values["control"]
    problems += _check_control(source, control, lists)
    samples, wrong = inline(source, "winch", lists)
    problems += wrong
    if samples:
        problems += check_times(samples, None)
    if problems:
        return {}, problems
    time, setpoint = (tuple(float(x) for x in lists.get(name, [])) for name in ("time_s", SETPOINT[control]))
    return {"winch": Winch(control=control, time=time, setpoint=setpoint)}, problems


def _check_control(source: Source, control: str, lists: Mapping[str, list[float]]) -> list[Problem]:
    """Return which lists of a winch are missing, or say nothing with its kind of control."""
    given, wanted = source.table["winch"], ["time_s", SETPOINT[control]] if SETPOINT[control] else []
    limits = {quantity.name: quantity.allowed for quantity in WINCH}
    problems = [
        source.problem(f"winch.{name}", f'a winch with control = "{control}" needs this list', limits[name])
        for name in wanted
        if name not in given
    ]
    users = {name: kind for kind, name in SETPOINT.items() if name}
    for name in lists:
        if name not in wanted:
            other = f', or set control = "{users[name]}"' if name in users else ""
            why = f'it says nothing to a winch with control = "{control}"'
            problems.append(source.problem(f"winch.{name}", why, f"Leave it out{other}."))
    return problems


def _read_vessel(source: Source) -> Read:
    """Return how the drum moves."""
    if "vessel" not in source.table:
        return {}, []
    values, problems = check_section(source, "vessel", source.table["vessel"])
    lists = _lists(values, "vessel")
    samples, wrong = inline(source, "vessel", lists)
    problems += wrong + (check_times(samples, None) if samples else [])
    if samples is None or problems:
        return {}, problems
    names = ["velocity_north_m_s", "velocity_east_m_s", "velocity_down_m_s"]
    time = tuple(float(x) for x in samples.time)
    vessel = Vessel(time=time, velocity=_vectors(lists, names, len(time)))
    return {"vessel": vessel}, problems


def check_scheme(source: Source, run: Mapping[str, Any], cable: Mapping[str, float]) -> list[Problem]:
    """Return what a trial and its cable ask for that only the default scheme knows, if [run] asks for another one."""
    scheme, table = run.get("scheme", SCHEMES[0]), source.table
    if scheme == SCHEMES[0]:
        return []
    water = table.get("water")
    asked = [f"[{section}]" for section in ("winch", "vessel") if section in table]
    if isinstance(water, Mapping) and any(quantity.name in water for quantity in PROFILE):
        asked.append("a profile in [water]")
    if run.get("grading", 0.0) > 0.0:
        asked.append("grading")
    if cable.get("bending_stiffness", 0.0) > 0.0:
        asked.append("the cable's bending_stiffness")
    return [source.problem("run.scheme", ONLY_DEFAULT, only_default(asked), found=scheme)] if asked else []
