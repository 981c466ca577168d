"""The file of a vehicle of few numbers, written: the known ones, and others that could be given, explained.

What follows from it is `scenarios.similar_vehicle`.
"""

from __future__ import annotations

from collections.abc import Mapping

from scenarios.errors import Problem, ScenarioError, nearest_or_all
from scenarios.quantities import KNOWN
from subzero.errors import real

WORDS = """
# {title}
#
# All other numbers follow from {base} by similarity: "subzero show" says which are measured, derived and guessed,
# with the range of each; calibrations and diagnoses take half of a derived range as tolerance.{speed}
# A number that you know better goes into its own section, as in the file of {base}:
#
#   [rudder]
#   area = {{ value = 0.009, unit = "m2", range = [0.008, 0.010], source = "measured" }}

base = "{base}"

[known]{rows}

# What else can be known, without the # in front:
{rest}
"""


def file_text(base: str, known: Mapping[str, float], title: str, speed: str = "") -> str:
    """Return a vehicle file of few numbers, explained.

    Args:
        base: a shipped vehicle.
        known: key of [known] → value.
        title: its first line.
        speed: a sentence about its speed and command.
    """
    rows = {q.name: f"{q.name} = {{value}}# {q.meaning} [{q.unit}]" for q in KNOWN}
    said = "".join("\n" + rows[key].format(value=f"{value:<12g}") for key, value in known.items())
    rest = "\n".join("# " + rows[key].format(value="...  ") for key in rows if key not in known)
    return (
        WORDS.strip()
        .format(base=base, rows=said, rest=rest, title=title, speed=f"\n# {speed}" if speed else "")
        .replace(". \n", ".\n")
        + "\n"
    )


def known_numbers(words: list[str]) -> dict[str, float]:
    """Return key of [known] → value for words such as ``length=2.0``; the unit of the key may be left out.

    Raises:
        ScenarioError: a word that is none, a key that is not known, a value outside its limits.
    """
    rows = {quantity.name: quantity for quantity in KNOWN}
    short = {name.removesuffix(f"_{name.rsplit('_', 1)[1]}"): name for name in rows}
    short |= {"speed": "speed_m_s", "fin_area": "fin_area_m2", "water_density": "water_density_kg_m3"}
    found: dict[str, float] = {}
    problems = []
    for word in words:
        name, _, text = word.partition("=")
        key, number = short.get(name, name), _float(text)
        if key not in rows:
            why = "no such number is known of a vehicle" if text else "this is not name=value"
            remedy = nearest_or_all(name, [*short])
            problems.append(Problem(file="the command", key=name, why=why, remedy=remedy))
        elif number is None or not rows[key].low <= number <= rows[key].high:
            problems.append(
                Problem(
                    file="the command", key=name, found=text, why="this cannot be", remedy=rows[key].allowed
                )
            )
        else:
            found[key] = number
    if problems:
        raise ScenarioError(problems)
    return found


def _float(text: str) -> float | None:
    try:
        return real(float(text))
    except ValueError:
        return None
