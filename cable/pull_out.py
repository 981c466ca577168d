"""Pull a cable off its drum, or tow a fixed length of it, with a tow point that moves as prescribed: the public calls.

`SCHEMES` is the one table of schemes: a row says with which options a scheme runs by its name, what computes it, and
what it knows.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np

from cable.clamps import Clamps
from cable.current import Current
from cable.drum import DrumProperties
from cable.history import Equilibrium, History
from cable.moving_end import time_loop
from cable.properties import CableProperties
from cable.schemes import Equation7, Lumped, MovingEnd, Options, Paper
from cable.sea_bed import SeaBed
from cable.sections import AnyCable
from cable.task import (
    CLAMPS,
    EQUILIBRIUM,
    EVERYTHING,
    INTERNAL_DAMPING,
    MASS_ALONG,
    SEA_BED,
    SECTIONS,
    SURFACE,
    Drum,
    MovingDrum,
    PullOut,
    Tow,
    current_of,
)
from cable.tow_path import Velocity
from subzero.arguments import checked_arguments
from subzero.errors import BadValueError, short, suggestion


def _fetched(module: str, name: str) -> Callable[[Any, Any], History]:
    """Return a function of a module that is imported, and compiled, only when it is called."""
    return lambda task, scheme: getattr(import_module(module), name)(task, scheme)


_in_angles = _fetched("cable.feng_allen.run", "pull_out")


@dataclass(frozen=True)
class Scheme:
    """A row of `SCHEMES`.

    Attributes:
        options: with which it runs when it is asked for by name; their class says which options there are.
        pull_out: computes a cable that is pulled off a drum.
        tow: computes one of a fixed length; None where it cannot.
        knows: features that a cable pulled off a drum may ask for, and the scheme supports.
    """

    options: Options
    pull_out: Callable[[PullOut, Any], History]
    tow: Callable[[Tow, Any], History] | None
    knows: frozenset[str]


PLAIN: frozenset[str] = frozenset()
SCHEMES: Mapping[str, Scheme] = {
    "moving_end": Scheme(MovingEnd(), time_loop.pull_out, time_loop.tow, EVERYTHING),
    "paper": Scheme(Paper(), _in_angles, None, PLAIN),
    "paper_tangent": Scheme(Paper(reading="tangent"), _in_angles, None, PLAIN),
    "paper_drum": Scheme(Paper(reading="drum"), _in_angles, None, PLAIN),
    "equation7": Scheme(Equation7(), _in_angles, None, PLAIN),
    "lumped": Scheme(
        Lumped(),
        _fetched("cable.lumped.history", "pull_out"),
        _fetched("cable.lumped.history", "tow"),
        EVERYTHING - {EQUILIBRIUM, INTERNAL_DAMPING, SEA_BED, SECTIONS, MASS_ALONG, CLAMPS, SURFACE},
    ),
}
"""Name → the scheme; the first is the default, and "paper" the usable reading of the paper's."""


@checked_arguments
def pull_out(
    tow_velocity: Velocity,
    duration: float,
    *,
    cable: AnyCable | None = None,
    drum: Drum | MovingDrum | None = None,
    current: Sequence[float] | np.ndarray | Current | None = None,
    start: float | Equilibrium = 0.0,
    bed: SeaBed | None = None,
    clamps: Clamps | None = None,
    surface: float | None = None,
    scheme: str | Options = "moving_end",
) -> History:
    """Pull a cable off a drum, starting with the tow point at the drum unless `start` says otherwise.

        ∂(T t)/∂s = ∂p/∂t + D − w_c k,   ∂V/∂s = ∂((1 + eT) t)/∂t,   dS/dt = −V_t(S)   (7)-(19)

    Straight ahead at U the tension is ½ρπdC_t U² S, and the force points against the motion. A drum with no friction
    and no inertia gives T(S) = 0. The drum cannot take cable up: a vehicle that comes back makes the cable slack
    (tension tends to 0, it never pushes), and no node is made while the drum stands. What a slack bight looks like
    below one segment length is ill-posed for a cable without bending stiffness and not to be trusted.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        duration: how long. [s]
        cable: the cable; Table 1 of the source when not given.
        drum: a free drum, a winch (`cable.winch`), or a `cable.MovingDrum` with one of these on a boat; the free drum
            of Table 1 on the shore when not given.
        current: velocity of the water north, east, down (3,) [m/s], or a `cable.Current` that changes with place and
            time (places relative to the drum at the start); still water when not given.
        start: length of cable in the water at the start, laid straight behind the tow point [m]; or a cable that hangs
            or streams between vehicle and drum, from `cable.hold`: the run begins with it, its cable and its current
            (unless others are given), its length, its segments and its bed.
        bed: the sea bed, in the axes of the current; none when not given.
        clamps: directions in which a cable with bending stiffness leaves its ends; hinges when not given. The second
            end may be clamped only where a `cable.Brake` holds it.
        surface: depth of a free surface, in the axes of the current; water everywhere when not given. [m]
        scheme: how it is computed: `cable.MovingEnd` (the default), `cable.Lumped`, `cable.Equation7` or `cable.Paper`,
            each with its options, or a name of `cable.SCHEMES` for one as it is by default.

    Returns:
        the history from t = 0 on. See `history.outcome`: a run that could not go on keeps its results up to then.

    Raises:
        subzero.UserError: a duration that is not positive, an unknown scheme or one that does not support a given
            option, a tow velocity or current that is not three finite numbers, a run that does not fit into memory.
            (Bad values are a ValueError, too.)
    """
    row, options = _chosen(scheme)
    origin = np.zeros(3)
    if isinstance(start, Equilibrium):
        cable = start.cable if cable is None else cable
        origin, current = (start.shape[-1], start.current) if current is None else (origin, current)
        bed = start.bed if bed is None else bed
        clamps = start.clamps if clamps is None else clamps
        surface = start.surface if surface is None else surface
    drum = DrumProperties() if drum is None else drum
    task = PullOut(
        tow_velocity=tow_velocity,
        duration=duration,
        cable=CableProperties() if cable is None else cable,
        drum=drum.drum if isinstance(drum, MovingDrum) else drum,
        drum_velocity=drum.velocity if isinstance(drum, MovingDrum) else None,
        current=current_of(current),
        start=start,
        origin=origin,
        bed=bed,
        clamps=clamps,
        surface=surface,
    )
    _refuse_unknown(task, row, options)
    return row.pull_out(task, options)


@checked_arguments
def tow(
    tow_velocity: Velocity,
    length: float,
    duration: float,
    *,
    cable: AnyCable | None = None,
    current: Sequence[float] | np.ndarray | Current | None = None,
    drogue_drag_area: float = 0.0,
    bed: SeaBed | None = None,
    clamps: Clamps | None = None,
    surface: float | None = None,
    scheme: str | Options = "moving_end",
) -> History:
    """Tow a cable of fixed length, starting from the exact steady straight tow.

    A neutral cable trails straight behind, T(s) = (½ρπdC_t (L − s) + ½ρC_dA) U². A cable with weight and no drogue lies
    straight at the critical angle φ, ½ρdC_n U² sin²φ = |w_c| cosφ, below or above the tow point; at rest it hangs.

    Args:
        tow_velocity: function of time [s] that gives the tow point's velocity north, east, down (3,). [m/s]
        length: L; segments are a little shorter where it is not a whole number of them. [m]
        duration: how long. [s]
        cable: the cable; Table 1 of the source when not given.
        current: velocity of the water north, east, down (3,) [m/s], or a `cable.Current` that changes with place and
            time (places relative to the tow point at the start); still water when not given.
        drogue_drag_area: C_d A of a drogue at the free end; 0 is a free tail. [m²]
        bed: the sea bed, at places relative to the tow point at the start; none when not given. What would begin
            below it trails on it.
        clamps: direction in which a cable with bending stiffness leaves the tow point; a hinge when not given. It
            begins in the steady tow without.
        surface: depth of a free surface, relative to the tow point at the start; water everywhere when not given. What
            would begin above it trails on it. [m]
        scheme: as in `cable.pull_out`; the paper's cannot tow a free end.

    Returns:
        the history; positions are relative to where the tail is at the start, `drum_tension` is the one at the tail.

    Raises:
        subzero.UserError: a length or a duration that is not positive, or a scheme that cannot tow.

    Checked by: tests/exact/test_tow.py
    """
    row, options = _chosen(scheme)
    if row.tow is None:
        able = " or ".join(repr(name) for name, other in SCHEMES.items() if other.tow)
        raise BadValueError(f"scheme '{options.name}' cannot tow a free end; choose {able}.")
    task = Tow(
        tow_velocity=tow_velocity,
        length=length,
        duration=duration,
        cable=CableProperties() if cable is None else cable,
        current=current_of(current),
        drogue_drag_area=drogue_drag_area,
        bed=bed,
        clamps=clamps,
        surface=surface,
    )
    _refuse_unknown(task, row, options)
    return row.tow(task, options)


def _refuse_unknown(task: PullOut | Tow, row: Scheme, options: Options) -> None:
    """Raise an error for features that a scheme does not know."""
    missing = [what for what in task.asks_for() if what not in row.knows]
    if missing:
        able = [repr(name) for name, other in SCHEMES.items() if set(task.asks_for()) <= other.knows]
        raise BadValueError(
            f"scheme '{options.name}' does not know {' and '.join(missing)}; use {' or '.join(able)}."
        )


def _chosen(scheme: object) -> tuple[Scheme, Options]:
    """Return the row of a scheme, asked for by name or by its options, and the options."""
    if isinstance(scheme, str) and scheme in SCHEMES:
        return SCHEMES[scheme], SCHEMES[scheme].options
    for row in SCHEMES.values():
        if isinstance(scheme, Options) and type(scheme) is type(row.options):
            return row, scheme
    raise BadValueError(
        f"scheme {short(scheme)} is unknown; choose one of {', '.join(SCHEMES)}, or one with options, such as"
        f" cable.MovingEnd(rtol=1e-3).{suggestion(scheme, SCHEMES)}"
    )
