"""The equilibrium of a cable between two ends: where it hangs, streams or floats, and how it pulls at them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cable.clamps import Clamps
from cable.current import Current, Water
from cable.drum import DrumNumbers
from cable.history import Equilibrium
from cable.moving_end.contact import friction_at_rest
from cable.moving_end.equilibrium import hang, relax
from cable.moving_end.segment_load import Load, new_load
from cable.moving_end.state import NEW, NOW, Line, new_line
from cable.properties import CableProperties
from cable.sea_bed import SeaBed
from cable.sections import COLUMNS, AnyCable, SectionedCable, check_length
from cable.task import current_of
from cable.winch import Brake
from subzero.arguments import checked_arguments, numbers_in
from subzero.errors import UserError, real, short

Place = Sequence[float] | np.ndarray
"""North, east, down. [m]"""

SEGMENTS = 100
"""Number of segments if no segment length is given: the force of a catenary is then right within about 1e-4."""
MOST_SEGMENTS = 100_000
MOST_STRAIN = 1.0
"""A cable that is pulled to more than twice its length is a mistake."""
SHARPEST = 0.7
"""Cosine of the largest angle between two segments of a stiff cable."""
RESCALINGS = 3
"""How often the unit of force is corrected where the first guess of the tension was far off."""
CLAMPING = (0.02, 0.05, 0.1, 0.2, 0.4, 0.7, 1.0)
"""Shares of its stiffness with which a clamp takes hold, one after another. [-]"""
WEIGHTLESS = 1e-9
"""A cable with less tension than this has no load at all. [N]"""
ON_BED = 1e-4
"""An end that is nearer to the bed than this share of the length lies on it. [-]"""
STIFFER = 4.0
"""By so much the bed gets stiffer, and the surface sharper, from search to search. [-]"""
LIDS = 20
"""In so many stages a surface comes down on a line that would rise above it."""
ROUGHENINGS, SETTLED = 20, 1e-7
"""How often friction is taken again from the tension that it leaves, until it changes by less than this share."""
FORCES = frozenset(
    {"mass", "added_mass", "weight", "retardation", "tangential_drag", "normal_drag", "bending_stiffness"}
    | {"bed_stiffness", "bed_damping", "mass_along"}
)
"""Numbers of a cable that forces are proportional to."""
TAUT = 1.0 - 1e-9
"""If the ends of an unstretchable cable are this share of its length apart, weight does not determine its tension."""


class HoldError(UserError, ValueError):
    """A cable that cannot be held so, or whose equilibrium was not found; the message says what to change."""


@checked_arguments
def hold(
    ends: Sequence[Place] | np.ndarray,
    length: float,
    current: Place | Current | None = None,
    *,
    cable: AnyCable | None = None,
    segment_length: float | None = None,
    start: Place | None = None,
    bed: SeaBed | None = None,
    clamps: Clamps | None = None,
    surface: float | None = None,
) -> Equilibrium:
    """Return the equilibrium of a cable that is held at two ends.

        ∂(T t)/∂s = D − w_c k,   |∂x/∂s| = 1 + eT                                        (7), without motion

    It sags below its ends if it is heavy, arches above them if it is buoyant, and a current bows it downstream. The
    equations are those of a run (`cable.pull_out`), in segments as there, so that a run with `start=` this begins
    at rest; the error is of second order in the segments. Cables may stretch, hang straight down or be nearly taut;
    they may be stiff, but not so stiff that they would push. In a sheared current there can be several equilibria;
    `start` chooses. A neutral cable in still water that is longer than the way has no shape: it is laid straight,
    without force, and all of it is `slack_length`.

    On a sea bed it lies as far as it is longer than what hangs. Where the second end is on the bed, the cable is taken
    to have been laid from there and tightened: friction along it then pulls towards that end, fully as far as there is
    tension. Else nothing says which way it would have slid, and there is no friction.

    Args:
        ends: where it is held (2, 3): the vehicle or first end, then the drum or second end. [m]
        length: unstretched length between them. [m]
        current: velocity of the water north, east, down (3,) [m/s], or a `cable.Current` in the axes of `ends`, as it
            is at time 0; still water when not given.
        cable: the cable; Table 1 of the source when not given.
        segment_length: Δs; a hundredth of the length when not given. [m]
        start: node positions (any number, 3) to start the search from; a catenary under weight and drag when not given.
        bed: the sea bed, in the axes of `ends`; none when not given.
        clamps: directions in which it leaves its ends, if it has a bending stiffness; hinges when not given.
        surface: depth of a free surface, in the axes of `ends`: above it is air, and a light cable floats;
            water everywhere when not given. [m]

    Raises:
        HoldError: ends, length or segments that make no sense; an unstretchable cable that is too short; no
            equilibrium found.
        subzero.UserError: an end below the bed.
    """
    cable, water = CableProperties() if cable is None else cable, current_of(current)
    places = _checked_ends(ends)
    length = _checked_length(places, length, cable)
    line = _between(places, length, _divided(cable, length, segment_length))
    if bed is not None:
        bed.refuse_below(places, "hold")
    starts = [None] if start is None else [_checked_start(start, places), None]
    for nodes in starts:
        steps, scale = _search(line, nodes, water.numbers(places[1]), cable, bed, clamps, surface)
        if steps > 0:
            found = _found(line, places, length, cable, water, steps, scale)
            if bed is not None:
                friction = line.friction[NEW, : line.ends.count + 1].copy()
                found = replace(found, bed=bed, bed_friction=friction)
            found = replace(found, clamps=clamps, surface=surface)
            _check_bends(found)
            return found
    raise HoldError(
        f"No equilibrium was found of {length:g} m of cable between ends {np.linalg.norm(places[0] - places[1]):g} m "
        "apart: forces and lengths would not balance. Try other segments (segment_length), a little compliance or "
        "bending stiffness, or begin from a shape that is near (start)."
    )


def _search(
    line: Line,
    nodes: np.ndarray | None,
    water: Water,
    cable: AnyCable,
    bed: SeaBed | None,
    clamps: Clamps | None,
    surface: float | None,
) -> tuple[int, float]:
    """Bring a line to rest from node positions, or from a catenary; return steps (−1: none) and the unit of force."""
    work, brake = new_load(), Brake().numbers()
    c: Any = cable.numbers(bed, clamps, surface)
    if bed is not None:
        c.is_at_rest = True
    brake.setpoint = line.ends.settled + line.ends.last_length[NOW]
    if surface is not None:
        c.surface_level = -1.0 / WEIGHTLESS  # hang it in water everywhere
    scale = hang(line, water, c, work)
    if nodes is not None:
        _lay_along(line, nodes)
    if bed is None:
        # A clamp turns the cable in steps: its spring is proportional to the size of its tangent.
        for share in CLAMPING if clamps is not None else (1.0,):
            if clamps is not None:
                c.clamp[:] = share * clamps.tangents
                line.tension[:] *= scale if share > CLAMPING[0] else 1.0
            steps, scale = _come_to_rest(line, water, c, brake, work, scale)
            if steps < 0:
                break
    else:
        steps, scale = _sink_onto(bed, line, water, c, brake, work, scale)
    if surface is None or steps < 0:
        return steps, scale
    return _press_below(surface, line, water, c, brake, work, scale)


def _press_below(
    surface: float, line: Line, water: Water, c: Any, brake: DrumNumbers, work: Load, scale: float
) -> tuple[int, float]:
    """Bring a line at rest in water everywhere to rest below a surface, which comes down on it and gets sharper.

    Each shape is near the next: the surface is as soft as the way that it comes down in a stage, and then ever less.
    """
    N = int(line.ends.count)
    radius = 0.5 * float(np.min(c.whole[-1] if c.whole[-1] > 0.0 else c.section[0, -1]))
    above = surface - float(line.ends.origin[2] + line.position[NOW, : N + 1, 2].min())
    stage = max(above / LIDS, radius)
    levels = (
        surface - stage * np.arange(np.ceil(above / stage) - 1.0, -1.0, -1.0) if above > 0.0 else [surface]
    )
    sharper = np.ceil(np.log(stage / radius) / np.log(STIFFER))
    softer = [stage / radius] * len(levels) + [STIFFER**k for k in np.arange(sharper - 1.0, -1.0, -1.0)]
    for k, c.softness in enumerate(softer):
        c.surface_level = levels[min(k, len(levels) - 1)]
        line.tension[:] *= scale
        steps, scale = _come_to_rest(line, water, c, brake, work, scale)
        if steps < 0:
            break
    return steps, scale


def _sink_onto(
    bed: SeaBed, line: Line, water: Water, c: Any, brake: DrumNumbers, work: Load, scale: float
) -> tuple[int, float]:
    """Bring a line to rest on a bed that gets stiffer from search to search, and then rougher.

    Into soft ground, a cable that hangs far below the bed sinks; so each shape is near the next.
    """
    hard, nodes = float(c.bed_stiffness), int(line.ends.count) + 1
    is_laid = -bed.below(line.ends.origin)[0] < max(c.bed_rounding, ON_BED * line.length[1] * nodes)
    rough = bed.axial_friction if is_laid else 0.0
    deepest = float(bed.below(line.position[NOW, :nodes] + np.asarray(line.ends.origin)).max())
    soft = min(max(abs(c.weight), WEIGHTLESS) / max(deepest, c.bed_rounding), hard)
    stiff = c.section[:, COLUMNS.index("bed_stiffness")].copy() if "section" in c.names else 0.0
    stages = int(np.ceil(np.log(hard / soft) / np.log(STIFFER)))
    for k, c.bed_stiffness in enumerate(hard * STIFFER ** -np.arange(stages, -1.0, -1.0)):
        line.tension[:] *= scale if k > 0 else 1.0
        if "section" in c.names:
            c.section[:, COLUMNS.index("bed_stiffness")] = stiff * c.bed_stiffness / hard
        steps, scale = _come_to_rest(line, water, c, brake, work, scale)
        if steps < 0:
            return steps, scale
    for _ in range(ROUGHENINGS if rough > 0.0 else 0):
        line.tension[:] *= scale
        before = line.friction[NOW].copy()
        line.friction[NOW, :nodes] = friction_at_rest(line, c, rough)
        if np.abs(line.friction[NOW] - before).max() <= SETTLED * rough:
            line.tension[:] /= scale
            break
        steps, scale = _come_to_rest(line, water, c, brake, work, scale)
        if steps < 0:
            break
    return steps, scale


def _come_to_rest(
    line: Line, water: Water, c: Any, brake: DrumNumbers, work: Load, scale: float
) -> tuple[int, float]:
    """Bring a line to rest from where it is, its tensions in newtons; return steps (−1: none) and the unit of force."""
    for _ in range(RESCALINGS):
        scale = scale if scale > WEIGHTLESS else 1.0
        line.tension[:] /= scale
        steps = relax(line, water, _in_units_of(scale, c), brake, work)
        largest = float(line.tension[NOW].max())
        if steps < 0 or largest * scale < WEIGHTLESS or 0.01 < largest < 100.0:
            break
        line.tension[:] *= scale
        scale *= largest
    return steps, scale


def _in_units_of(scale: float, c: Any) -> Any:
    """Return a cable's numbers for forces in units of `scale` newtons."""
    c = c.copy()
    for name in c.names:
        if name in FORCES:
            c[name] = c[name] / scale
        elif name in ("section", "body", "whole"):
            c[name] /= scale
    c.compliance *= scale
    if "section" in c.names:
        c.section[:, COLUMNS.index("compliance")] *= scale * scale
        c.section[:, COLUMNS.index("diameter")] *= scale
    if "whole" in c.names:
        c.whole[-1] *= scale  # a diameter
    return c


def _check_bends(found: Equilibrium) -> None:
    """Raise an error if a stiff cable is folded at single nodes: there its stiffness is not felt."""
    d = np.diff(found.shape, axis=0)
    d /= np.maximum(np.linalg.norm(d, axis=1), 1e-30)[:, None]
    sharpest = float((d[1:] * d[:-1]).sum(axis=1).min())
    if found.cable.bending_stiffness > 0.0 and sharpest < SHARPEST:
        raise HoldError(
            f"hold: the cable, with a bending stiffness of {found.cable.bending_stiffness:g} N m², was only found "
            f"folded, by {np.degrees(np.arccos(max(sharpest, -1.0))):.0f} degrees from one segment to the next. It "
            "would have to push, which is not modelled, or its segments are too long: take shorter ones, move its "
            "ends apart, or take less stiffness."
        )


def _checked_ends(ends: Sequence[Place] | np.ndarray) -> np.ndarray:
    """Return the ends as finite numbers (2, 3)."""
    places = numbers_in(ends)
    if places is None or places.shape != (2, 3) or not np.isfinite(places).all():
        raise HoldError(
            f"hold: ends must be two places of three finite numbers (north, east, down in m); got {short(ends)}."
        )
    return places


def _positive(name: str, given: object) -> float:
    """Return a length as a float [m]; raise an error if it is not a positive number."""
    length = real(given)
    if length is None or length <= 0.0:
        raise HoldError(f"hold: {name} is {short(given)}; it must be a positive number of metres.")
    return length


def _checked_length(places: np.ndarray, given: float, cable: AnyCable) -> float:
    """Return the length; raise an error if no cable of that length reaches, or if it is not a length. [m]."""
    length = _positive("length", given)
    apart = float(np.linalg.norm(places[0] - places[1]))
    if cable.compliance == 0.0 and apart >= TAUT * length:
        raise HoldError(
            f"hold: the ends are {apart:.10g} m apart and the cable, which does not stretch, is {length:.10g} m long. "
            "Give more length, or a compliance (1/EA)."
        )
    if apart > (1.0 + MOST_STRAIN) * length:
        raise HoldError(
            f"hold: the ends are {apart:.10g} m apart and the cable is {length:.10g} m long: it would stretch by "
            f"{100.0 * (apart / length - 1.0):.0f} %, and at most {100.0 * MOST_STRAIN:g} % is taken for a cable. Give "
            "more length."
        )
    return length


def _segments(length: float, given: float | None) -> int:
    """Return how many segments a cable is divided into."""
    if given is None:
        return SEGMENTS
    segment_length = _positive("segment_length", given)
    if length / segment_length > MOST_SEGMENTS:
        raise HoldError(
            f"hold: {length:g} m in segments of {segment_length:g} m are more than {MOST_SEGMENTS} segments. Take "
            "longer ones."
        )
    return max(2, int(np.ceil(length / segment_length - 1e-9)))


def _checked_start(start: Place, places: np.ndarray) -> np.ndarray:
    """Return node positions relative to the second end."""
    nodes = numbers_in(start)
    if nodes is None or nodes.shape[1:] != (3,) or len(nodes) < 2 or not np.isfinite(nodes).all():
        got = "no numbers" if nodes is None else f"shape {nodes.shape}"
        raise HoldError(f"hold: start must be finite node positions (n, 3), two at least; got {got}.")
    from_second_end: np.ndarray = nodes - places[1]
    return from_second_end


def _divided(cable: AnyCable, length: float, segment_length: float | None) -> np.ndarray:
    """Return the lengths of segments: even, but between ends of sections and bodies. [m]."""
    count = _segments(length, segment_length)
    if isinstance(cable, SectionedCable):
        check_length(cable, length)
        return cable.divided(length / count)
    return np.full(count, length / count)


def _between(places: np.ndarray, length: float, lengths: np.ndarray) -> Line:
    """Return a line of segments (n,) [m], with its ends where they are held."""
    count = lengths.size
    line = new_line(count)
    line.ends.count = count
    line.length[1 : count + 1] = lengths
    line.ends.layout.segment_length = line.ends.last_length[:] = lengths[-1]
    line.ends.settled = length - lengths[-1]
    line.position[:, 0] = places[0] - places[1]
    line.ends.origin[:] = places[1]
    return line


def _lay_along(line: Line, nodes: np.ndarray) -> None:
    """Lay a line along node positions (n, 3), evenly by the length of their way."""
    way = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(nodes, axis=0), axis=1))])
    at = np.linspace(0.0, way[-1], line.ends.count + 1)
    inside = np.column_stack([np.interp(at, way, nodes[:, i]) for i in range(3)])[1:-1]
    line.position[:, 1 : line.ends.count] = inside


def _found(
    line: Line,
    places: np.ndarray,
    length: float,
    cable: AnyCable,
    current: Current,
    steps: int,
    scale: float,
) -> Equilibrium:
    """Return the equilibrium from a line at rest; its forces are in units of `scale`."""
    N = line.ends.count
    return Equilibrium(
        cable=cable,
        current=current,
        length=float(length),
        shape=line.position[NOW, : N + 1] + places[1],
        tensions=scale * line.node_tension[: N + 1],
        tow_force=scale * line.ends.tow.force,
        drum_force=-scale * line.ends.drum_force,
        segment_lengths=np.append(line.length[1:N], line.ends.last_length[NOW]),
        segment_tensions=scale * line.tension[NOW, 1 : N + 1],
        steps=steps,
    )
