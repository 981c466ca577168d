"""How a cable may be computed: each scheme is a value with the options that it has, checked where it is made.

    >>> MovingEnd(segment_length=0.25, rtol=1e-3)
    MovingEnd(time_step=0.1, segment_length=0.25, rtol=0.001, grading=0.0, run_in=0.0, tolerance=1e-09)
    >>> MovingEnd(tolerance=0.1)
    Traceback (most recent call last):
    subzero.errors.BadValueError: MovingEnd: tolerance is 0.1; it must be a finite number, at least 1e-12 and ...
    >>> Paper(reading="drum").name
    'paper_drum'

`cable.pull_out` and `cable.tow` take one of them, or its name in `cable.SCHEMES`, the table of what each can do.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from subzero.arguments import checked_arguments
from subzero.errors import BadValueError, checked, short, suggestion, truth

SHORTEST_S = 1e-9
"""A run or a step that is shorter cannot be halved where it is difficult: the halves would be rounded away. [s]"""
TOLERANCE = 1e-9
"""How exactly a step is solved by default: this share of the largest tension, strains of 1e-12. [-]"""
FINEST, COARSEST = 1e-12, 1e-3
"""Between these a tolerance makes sense: rounding is below, and the error of a step above. [-]"""
LONGEST_RUN_IN_M = 100.0
READINGS = ("tangent", "drum")
"""The initial tangent of the paper's new node: that of its neighbour, or the same turned back around the drum."""


@dataclass(frozen=True, kw_only=True)
class _Steps:
    """A scheme whose time step and segment length are independent of one another."""

    time_step: float = 0.1
    segment_length: float = 0.5

    def __post_init__(self) -> None:
        """Raise an error if a step or a segment length is not valid."""
        _keep(self, "time_step", least=SHORTEST_S, unit="s")
        _keep(self, "segment_length", above=0.0)


@dataclass(frozen=True, kw_only=True)
class MovingEnd(_Steps):
    """The default: Cartesian balances, a last segment that grows at the drum, backward differences in time.

    Of second order in time and space; segment length and step are independent of one another.

    Attributes:
        time_step: time between recorded results; a step that fails is retried in smaller pieces. [s]
        segment_length: Δs, length of a full segment, at the tow point; a start from `cable.hold` has its own. [m]
        rtol: with a positive value, steps are made as small as needed for an error of the tow force of about this share
            of its largest (`moving_end.time_loop`), but for jolts; 0 takes every step as it is. [-]
        grading: new segments are Δs + grading · s long, s from the tow point: a cable is coarser far from the vehicle.
            [-]
        run_in: segments are shorter up to this length L₀ from the tow point, node j at (jΔs)²/4L₀: for a start with no
            cable in a cross current, whose force is of second order then from the first step on. Coupled runs take
            2 m. [m]
        tolerance: how exactly a step is solved: balances of forces to this share of the largest tension, strains to a
            thousandth of it. With 1e-5 most steps take one Newton iteration, not two, and what that leaves is far below
            the error of the step; what compares runs with one another wants the 1e-9. [-]

    Good values: steps of 0.1 s and segments of 0.5 m give the tension of a 60° dive at 1 m/s within 2e-4 and the
    direction of the tow force within 4e-4 (`python -m benchmarks.cable` measures both together).
    """

    name: ClassVar[str] = "moving_end"
    rtol: float = 0.0
    grading: float = 0.0
    run_in: float = 0.0
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        """Raise an error if a step, a segment length or a tolerance is not valid."""
        super().__post_init__()
        _keep(self, "rtol", least=0.0, most=0.5)
        _keep(self, "grading", least=0.0, most=0.5)
        _keep(self, "run_in", least=0.0, most=LONGEST_RUN_IN_M, unit="m")
        _keep(self, "tolerance", least=FINEST, most=COARSEST)


@dataclass(frozen=True, kw_only=True)
class Lumped(_Steps):
    """Masses at nodes and stiff springs between them, another scheme in time: the other code to compare with.

    An inextensible cable stretches by 1e-6 of its length at one newton (`lumped.springs.LEAST_COMPLIANCE`).

    Attributes:
        time_step: time between recorded results; a step that fails is retried in smaller pieces. [s]
        segment_length: Δs, length of a full segment. [m]
    """

    name: ClassVar[str] = "lumped"


@dataclass(frozen=True, kw_only=True)
class Equation7(_Steps):
    """The six unknowns of the paper's equation (7) in a scheme of second order with a moving end; it knows no slack.

    Attributes:
        time_step: time between recorded results; a step that fails is retried in halves. [s]
        segment_length: Δs, length of a full segment. [m]
    """

    name: ClassVar[str] = "equation7"


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Paper:
    """The scheme of Feng & Allen (2004) as printed, (14)-(26): one new node a step, so a step is a segment.

    Attributes:
        time_step: Δt; a segment is as long as the cable that leaves the drum in it. [s]
        reading: of the state in which a new node is prescribed, one of `READINGS`: "tangent" is the usable one, "drum"
            the one that is printed.
        implicit: fully implicit in time instead of the trapezoidal rule (22): our comparison, not the paper's.
    """

    time_step: float = 0.1
    reading: str = "tangent"
    implicit: bool = False

    def __post_init__(self) -> None:
        """Raise an error if the step is not valid, or the reading does not exist."""
        _keep(self, "time_step", least=SHORTEST_S, unit="s")
        if self.reading not in READINGS:
            raise BadValueError(
                f"Paper: reading is {short(self.reading)}; it must be one of {', '.join(READINGS)}."
                f"{suggestion(self.reading, READINGS)}"
            )
        object.__setattr__(self, "implicit", truth("Paper: implicit", self.implicit))

    @property
    def name(self) -> str:
        """Its name in results, ``paper_tangent`` or ``paper_drum``."""
        return f"paper_{self.reading}"


Options = MovingEnd | Lumped | Equation7 | Paper
"""A scheme with its options."""


def _keep(scheme: _Steps | Paper, name: str, **limits: float | str) -> None:
    """Keep an option as a float, or refuse it."""
    value = checked(type(scheme).__name__, name, getattr(scheme, name), **limits)  # type: ignore[arg-type]
    object.__setattr__(scheme, name, value)
