"""Names of hydrodynamic derivatives: the force, what it depends on, and the unit that follows.

    X_u  Y_r  N_v            per velocity                               X_udot  Y_rdot       per acceleration
    X_uu  Y_r|r|             per velocity times its size, r|r|          X_q2  Z_v2           per square of a velocity
    Y_uv  N_ur  Y_v|r|       per product of velocities                  X_nn  X_n|n|         per shaft speed n [rev/s]
    Y_uu_rudder              per u|u| times the angle of a fin          X_uu_rudder2         per square of an angle
    Z_uq_race                times the excess of the propeller's race   Y_Uv                 U: speed through the water

A name is a force of X Y Z K M N, '_', letters of u v w p q r U n, and '_name' for each further factor. A letter that
stands twice is the velocity times its absolute value, which brakes either way (SNAME); the square has a 2; bars make an
absolute value. A prime at the end, Y_v', is that of a non-dimensional derivative (SNAME 1950; Fossen 2021, appendix D).
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from subzero.errors import nearest

FORCES, SPEEDS = "XYZKMN", "uvwpqr"
RATES = "pqrn"
"""Factors in 1/s; the others among the letters are in m/s."""
FIN_NAMES = ("rudder", "stern_plane_port", "stern_plane_starboard")
RACE = "race"
COMPLETE = "complete"
"""The key of a table of derivatives that says whether its products hold those of the added mass."""
MOST_FACTORS = 6
"""Factors of a derivative, a square as two: X_uu_rudder2_race has five. [-]"""
HOW = "a name such as X_u, X_uu, X_udot, X_q2, Y_uv, Y_v|r|, Y_uu_rudder or X_nn (docs/vehicles.md)"

RATE = re.compile(r"([uvwpqr])dot")
LETTERS = re.compile(r"(?!.*([uvwpqrUn])\1\1)(?:[uvwpqrUn]2?|\|[uvwpqrUn]\|)+")
LETTER = re.compile(r"([uvwpqrUn])(\1|2)?|\|([uvwpqrUn])\|")


@dataclass(frozen=True, kw_only=True)
class DerivativeName:
    """What the name of a derivative says.

    Attributes:
        force: 0 to 5, of X Y Z K M N.
        factors: letters and names, with bars for an absolute value: ("u", "|u|", "rudder"); of an acceleration its
            letter.
        is_rate: of an acceleration, as X_udot.
        is_primed: non-dimensional.
    """

    force: int
    factors: tuple[str, ...]
    is_rate: bool
    is_primed: bool

    @property
    def kind(self) -> str:
        """``added_mass``, ``linear`` or ``quadratic``, which are matrices (6, 6), or ``product``."""
        first = self.factors[0]
        if self.is_rate:
            return "added_mass"
        if len(self.factors) == 1 and first in SPEEDS and not self.is_primed:
            return "linear"
        return "quadratic" if first in SPEEDS and self.factors[1:] == (f"|{first}|",) else "product"

    @property
    def velocities(self) -> tuple[str, ...]:
        """The letters among the factors, without bars."""
        return tuple(letter for factor in self.factors if len(letter := factor.strip("|")) == 1)

    @property
    def lengths(self) -> int:
        """Powers of the length in the derivative, over those of a force: one of a moment, one of each rate. [-]"""
        return (self.force > 2) + sum(letter in RATES for letter in self.velocities)

    @property
    def unit(self) -> str:
        """The unit of the value: that of the force over those of the factors; "1" if it is primed."""
        if self.is_primed:
            return "1"
        degree = len(self.velocities)
        metres = 1 + self.lengths - degree
        seconds = 0 if self.is_rate else degree - 2
        if (metres, seconds) in ((1, -2), (2, -2)):
            return "N" if metres == 1 else "N m"
        powers = (("m", metres), ("s", seconds))
        above = ["kg", *(_power(name, power) for name, power in powers if power > 0)]
        below = [_power(name, -power) for name, power in powers if power < 0]
        under = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
        return " ".join(above) + (f"/{under}" if under else "")


def _power(name: str, power: int) -> str:
    return name if power == 1 else f"{name}{power}"


def parsed(name: str, named: Sequence[str]) -> DerivativeName | None:
    """Return what the name of a derivative says; None if it is none.

    Args:
        name: such as ``Y_uu_rudder``.
        named: names that may be factors besides the letters: fins, and the race.
    """
    force, _, rest = name.removesuffix("'").partition("_")
    if len(force) != 1 or force not in FORCES or rest.endswith("_"):
        return None
    rate = RATE.fullmatch(rest)
    factors = [rate[1]] if rate else _factors(rest, named)
    if not factors or len(factors) > MOST_FACTORS:
        return None
    found = DerivativeName(
        force=FORCES.index(force), factors=tuple(factors), is_rate=bool(rate), is_primed=name.endswith("'")
    )
    return None if found.is_primed and len(found.velocities) > 2 else found


def _factors(rest: str, named: Sequence[str]) -> list[str] | None:
    """Return the factors after ``X_``; None if it is not made of letters and names."""
    head, _, tail = rest.partition("_")
    if not LETTERS.fullmatch(head):
        head, tail = "", rest
    factors = [factor for found in LETTER.finditer(head) for factor in _letter_factors(found)]
    # A name may begin with another: the longest that fits is meant.
    names = "|".join(re.escape(each) for each in sorted(named, key=len, reverse=True))
    piece = re.compile(rf"(?:(?P<name>{names})(?P<square>2?)|\|(?P<size>{names})\|)(?:_|$)")
    while tail:
        found = piece.match(tail)
        if found is None:
            return None
        name = found["name"]
        factors += [f"|{found['size']}|"] if name is None else [name] * (2 if found["square"] else 1)
        tail = tail[found.end() :]
    return factors


def _letter_factors(found: re.Match[str]) -> list[str]:
    letter, again, size = found.groups()
    if letter is None:
        return [f"|{size}|"]
    return [letter, *([] if again is None else [letter if again == "2" else f"|{letter}|"])]


def complaint(name: str, named: Sequence[str]) -> tuple[str, str] | None:
    """Return why a name is no derivative, and the allowed names, the nearest first; None if it is one."""
    if parsed(name, named):
        return None
    bare = name.removesuffix("'")
    if name.endswith("'") and parsed(bare, named):
        return "a derivative without dimensions has at most two velocities", "one with a unit"
    head, _, tail = bare[2:].partition("_")
    if not (tail and LETTERS.fullmatch(head) and parsed(bare[: 2 + len(head)], named)):
        return "no such derivative", HOW
    names = [*named, *(f"{first}_{second}" for first in named for second in named)]
    close = nearest(tail, names)
    near = f"{bare[: 2 + len(head)]}_{close[0]}; " if close else ""
    return f"no factor is called '{tail}'", f"{near}after the letters stand {', '.join(named)}"
