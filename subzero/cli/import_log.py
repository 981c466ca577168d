"""The command ``import``: from logs as they were written to records; everything heavy is imported inside."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter

from subzero.cli.output_mode import FINE, PLAIN, Flag, OutputMode
from subzero.errors import UserError, printable

if TYPE_CHECKING:
    from subzero.logs.api import Imported

LARGE = 20_000_000
"""A log of more has a progress bar. [byte]"""
HEADINGS = ("column", "channel", "unit", "factor", "why")


def import_(
    logs: Annotated[list[Path], Parameter(negative=())],
    /,
    *,
    map: Path | None = None,
    out: Path = Path("record.csv"),
    map_out: Path | None = None,
    merge: Flag = False,
    trial: Path | None = None,
    output_mode: OutputMode = PLAIN,
) -> int:
    """Make records of logs as their loggers wrote them: names, units and times found, and every change said.

    Args:
        logs: CSV of any delimiter, .mat, .nc, .alog, .bin, .tlog, .ulg, .mcap, .bag or .db3; each becomes a record.
        map: TOML file that says which column is which channel, in which unit; found from names and values without it.
        out: the record; its map goes there too, as NAME.map.toml. With several logs a folder, for one record of each.
        map_out: write the map to this file, and no record: to edit it, and give it again with --map.
        merge: the logs are of one trial: align their clocks by the channels that they share, and make one record.
        trial: write a trial, too, that begins where the record begins, lasts as long, and has its commands.
        output_mode: the form of the output.
    """
    from subzero.logs.align import merged
    from subzero.logs.api import import_log, undecided

    targets = _targets(logs, out, map_out, merge)
    if trial is not None and (map_out is not None or (len(logs) > 1 and not merge)):
        raise UserError("--trial goes with one record. Give one log, or --merge; and leave out --map-out.")
    with contextlib.ExitStack() as stack:
        found = [import_log(log, map, _progress_of(log, stack)) for log in logs]
    open_ones = [log for log in found if log.record is None]
    if open_ones and map_out is None:
        raise undecided(open_ones[0])
    if merge:
        records = [log.record for log in found if log.record is not None]
        found = [replace(found[0], record=merged(records)), *(replace(log, record=None) for log in found[1:])]
    folder = map_out.parent if map_out is not None else targets[0].parent
    written = _written(found, targets, folder, map_out)
    if trial is not None:
        _write_trial(trial, found[0], targets[0])
        written["files"] = [*written["files"], printable(os.path.relpath(trial, folder))]
    with output_mode.emit({**written, "logs": [_as_json(log) for log in found]}):
        for log in found:
            _print(log)
        print(f"Wrote {', '.join(printable(str(folder / name)) for name in written['files'])}")
    return FINE


def _write_trial(path: Path, found: Imported, record: Path) -> None:
    """Make the trial of a record that was written."""
    from subzero.files.read_file import make_toml
    from subzero.logs.api import trial_of

    assert found.record is not None
    make_toml(path, trial_of(found.record, Path(os.path.relpath(record, path.parent)).as_posix()))


def _progress_of(log: Path, stack: contextlib.ExitStack) -> Callable[[float], None]:
    """Return a progress bar for a log that takes a while."""
    if not log.is_file() or log.stat().st_size < LARGE:
        return lambda share: None
    from subzero.cli.progress import progress_bar

    return stack.enter_context(progress_bar(f"Reading {printable(log.name)}"))


def _targets(logs: list[Path], out: Path, map_out: Path | None, merge: bool) -> list[Path]:
    """Return the file for each record, or refuse names that cannot be."""
    if len(logs) > 1 and map_out is not None:
        raise UserError("--map-out writes the map of one log, and several are given. Give one.")
    if len(logs) == 1 or merge:
        if out.suffix != ".csv":
            raise UserError(f"--out {printable(str(out))} must end in .csv, such as record.csv.")
        targets = [
            out,
            *(out.parent / f"{log.stem}.csv" for log in logs[1:]),
        ]  # those of others name their maps
    else:
        if out.suffix == ".csv":
            out = out.parent / out.stem
        targets = [out / f"{log.stem}.csv" for log in logs]
    if map_out is not None and map_out.suffix != ".toml":
        raise UserError(f"--map-out {printable(str(map_out))} must end in .toml, such as map.toml.")
    inputs, records = {log.absolute() for log in logs}, targets[:1] if merge else targets
    if len(set(targets)) < len(targets) or inputs & {target.absolute() for target in records}:
        raise UserError(
            "A record would replace a log or another record. Give another --out, or rename the logs."
        )
    return targets


def _written(
    found: list[Imported], targets: list[Path], folder: Path, map_out: Path | None
) -> dict[str, Any]:
    """Write all records with their maps, or the requested map, and return the files written."""
    from subzero.files.atomic_output import open_output_folder
    from subzero.files.read_file import MEGABYTE, MOST_OF_A_CSV
    from subzero.logs.api import to_csv
    from subzero.logs.map_file import to_toml
    from subzero.logs.table import refusal
    from subzero.records.record import read_record

    maps = [map_out.name] if map_out is not None else [f"{target.stem}.map.toml" for target in targets]
    records = {
        target.name: log.record
        for log, target in zip(found, targets, strict=True)
        if map_out is None and log.record is not None
    }
    with open_output_folder(folder, [*maps, *records]) as output:
        for log, name in zip(found, maps, strict=True):
            (output.path / name).write_text(to_toml(log.mapping, log.source), encoding="utf-8")
        for name, record in records.items():
            text = to_csv(record)
            if len(text) > MOST_OF_A_CSV:
                why = f"its record has {len(text) // MEGABYTE} MB, more than is read"
                raise refusal(record.source, why, "Name fewer columns in a map, or split the log.")
            (output.path / name).write_text(text, encoding="utf-8")
            read_record(output.path / name)  # check that the written file can be read
    return output.files()


def _print(found: Imported) -> None:
    """Print a line for each column, and the notes."""
    rows = [HEADINGS, *found.table()]
    widths = [max(len(printable(row[at])) for row in rows) for at in range(4)]
    print(f"{found.source}:")
    for row in rows:
        cells = [printable(cell).ljust(width) for cell, width in zip(row[:4], widths, strict=True)]
        print("  " + "  ".join([*cells, printable(row[4])]).rstrip())
    for line in found.record.notes if found.record else found.mapping.questions:
        print(printable(line))


def _as_json(found: Imported) -> dict[str, Any]:
    """Return the findings, as plain values."""
    rows = [dict(zip(HEADINGS, row, strict=True)) for row in found.table()]
    notes = list(found.record.notes) if found.record else []
    return {"log": found.source, "columns": rows, "notes": notes, "questions": found.mapping.questions}
