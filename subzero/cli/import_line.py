"""The command ``subzero import-line``: the lines of a MoorDyn deck at rest; all heavy is imported inside."""

from __future__ import annotations

from pathlib import Path

import cyclopts

from subzero.cli.examples import register
from subzero.cli.output_mode import PLAIN, OutputMode

FINE = 0
LARGEST_DECK = 10_000_000
"""A larger file is no deck. [bytes]"""


def import_line(deck: Path, *, output_mode: OutputMode = PLAIN) -> int:
    """Read a MoorDyn v2 deck, say what of it is not computed here, and bring its lines to rest in still water.

    In Python: `cable.read_deck`, whose lines `cable.pull_out` and `cable.Tether` take.

    Args:
        deck: the input file.
        output_mode: the form of the output.
    """
    import numpy as np

    from cable import hold, read_deck
    from subzero.files.read_file import read_text

    found = read_deck(read_text(deck, LARGEST_DECK))
    rests = [
        (
            line,
            hold(line.ends, line.length, cable=line.cable, segment_length=line.segment_length, bed=line.bed),
        )
        for line in found.lines
    ]
    rows = [
        {
            "line": line.name,
            "length_m": round(line.length, 6),
            "sections": len(line.cable.sections),
            "first_end_N": float(np.linalg.norm(rest.tow_force)),
            "second_end_N": float(np.linalg.norm(rest.drum_force)),
        }
        for line, rest in rests
    ]
    with output_mode.emit({"lines": rows, "left_out": list(found.left_out)}):
        print("line   length [m]   sections   pull at its upper end [N]   at its lower end [N]")
        for row in rows:
            print(
                f"{row['line']:<6} {row['length_m']:>10.6g}   {row['sections']:>8}   {row['first_end_N']:>25.6g}   "
                f"{row['second_end_N']:>20.6g}"
            )
        for words in found.left_out:
            print(f"left out: {words}")
    return FINE


def add_to(app: cyclopts.App) -> None:
    """Add the command to the command line."""
    register(app, import_line, "import-line")
