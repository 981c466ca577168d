"""The command ``subzero export-fmu``: a tether as a functional mock-up unit; all heavy is imported inside."""

from __future__ import annotations

from pathlib import Path

import cyclopts

from subzero.cli.examples import register
from subzero.cli.output_mode import PLAIN, OutputMode

FINE = 0


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


def add_to(app: cyclopts.App) -> None:
    """Add the command to the command line."""
    register(app, export_tether, "export-fmu")
