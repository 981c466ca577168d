"""Clamped ends: a cable that bends leaves an end in a given direction, as out of a bend restrictor or a guide.

A hinge at the clamp, half a segment long, holds the direction t_c of the cable there with the moment M,

    E_c = k (1 − t·t_c),   k = 2 EI/ℓ,   M = EI κ = k |t − t_c|

t and ℓ being those of the end's segment. Under a tension T a bend by φ is some λ = √(EI/T) long, κ = 2/λ sin φ/2
(elastica): segments there should be shorter than λ. The direction does not turn with time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.errors import BadValueError, real, short

if TYPE_CHECKING:
    from cable.properties import CableProperties
    from cable.sections import SectionedCable


@dataclass(frozen=True, kw_only=True)
class Clamps:
    """The directions in which a cable leaves its ends, north, east, down (3,), of any size; None is a hinge.

    Attributes:
        first: at the first end, the tow point.
        second: at the second end.

    Raises:
        subzero.UserError: a direction that is not three finite numbers, or none.
    """

    first: Sequence[float] | np.ndarray | None = None
    second: Sequence[float] | np.ndarray | None = None

    def __post_init__(self) -> None:
        """Raise an error if a field is no direction; keep unit vectors."""
        for name in ("first", "second"):
            given = getattr(self, name)
            if given is None:
                continue
            if np.shape(given) != (3,) or any(real(x) is None for x in given) or not np.any(given):
                raise BadValueError(
                    f"Clamps: {name} is {short(given)}; it must be a direction, three finite numbers north, east, down"
                    " that are not all zero."
                )
            object.__setattr__(self, name, np.asarray(given, dtype=float) / np.linalg.norm(given))

    @property
    def tangents(self) -> np.ndarray:
        """t_c at both ends, towards the second end; zeros at a hinge (2, 3)."""
        first, second = (np.zeros(3) if way is None else np.asarray(way) for way in (self.first, self.second))
        return np.array([first, -second])

    def numbers(self, cable: CableProperties | SectionedCable) -> dict[str, Any]:
        """Return the fields that `cable.properties.ClampedCableNumbers` has for a cable.

        Raises:
            subzero.UserError: a cable that does not bend.
        """
        if cable.bending_stiffness == 0.0:
            raise BadValueError(
                "Clamps: the cable has no bending_stiffness, so a clamp would not bend it. Give CableProperties its"
                " bending_stiffness (a line of sections has none), or leave the clamps out."
            )
        return {"bending_stiffness": cable.bending_stiffness, "clamp": self.tangents}
