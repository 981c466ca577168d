"""The commands about cables alone: ``subzero export-fmu``, a tether as a functional mock-up unit, and ``import-line``,
the lines of a MoorDyn deck at rest; all heavy is imported inside.
"""

from __future__ import annotations

from pathlib import Path

from subzero.cli.output_mode import FINE, PLAIN, OutputMode

LARGEST_DECK = 10_000_000
"""A larger file is no deck. [bytes]"""


def export_tether(
    scenario: str = "fig6",
    *,
    length: float,
    segments: int = 50,
    longest: float | None = None,
    out: Path = Path("tether.fmu"),
    output_mode: OutputMode = PLAIN,
) -> int:
    """Write a tether as a functional mock-up unit (FMI 2) that other simulators step.

    The unit needs Python with this package where it runs. Its variables are listed in docs/tether.md.

    Args:
        scenario: whose cable and current it takes: the name of a shipped one, or a file.
        length: of the cable at the start, unstretched. [m]
        segments: number of segments.
        longest: all cable that there is, in the water and on the drum; without limit when not given. [m]
        out: the file, which ends in .fmu.
        output_mode: the form of the output.
    """
    from subzero.fmu import export_fmu
    from subzero.model import load, model_of

    model = model_of(load(scenario))
    path = export_fmu(
        out,
        length=length,
        cable=model.cable,
        segments=segments,
        longest=longest,
        current=(float(model.current[0]), float(model.current[1]), float(model.current[2])),
    )
    with output_mode.emit({"file": str(path), "length_m": length, "segments": segments}):
        print(f"Wrote {path}: {length:g} m of the cable of {scenario}, in {segments} segments.")
    return FINE


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
