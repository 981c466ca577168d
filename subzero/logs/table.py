"""A table of numbers from a file as a logger wrote it: CSV of any kind, MATLAB, netCDF, MOOS, ArduPilot.

Every cell becomes a number. Dates and times of day become seconds, a text becomes a gap, and a column knows which of
them it holds (`Column.form`). Which column is what is not decided here (`logs.names`), and no unit is converted.

A CSV file is read in chunks of lines, so that memory grows with its numbers, not with its text. Its delimiter and its
decimal sign are those with which most cells of its first lines are numbers or times, in equally long rows.
"""

from __future__ import annotations

import contextlib
import csv
import functools
import itertools
import os
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from subzero.channels import TIME
from subzero.errors import DISTRIBUTION, UserError, printable, short
from subzero.files.read_file import MEGABYTE, MOST_COLUMNS, UnreadableFileError, check_readable
from subzero.logs.names import is_unit, recognised
from subzero.logs.times import DATE_AND_TIME, MIXED, seconds_of

NUMBER, TEXT = "number", "text"
GAPS = frozenset(
    ("", "nan", "+nan", "-nan", "null", "none", "na", "n/a", "#n/a", "-", "--", "inf", "-inf", "+inf")
)
"""Cells that hold no measurement, in small letters."""
SENTINELS = (9999.0, 99999.0)
"""Numbers, of either sign, that stand for a gap in a column whose other values are all less than half as large."""
MOST_OF_A_LOG = 1024 * MEGABYTE
"""Its numbers take about as much memory. [byte]"""
HEAD, LONGEST_LINE, CHUNK = 1 << 16, 1 << 20, 20_000
"""What is looked at first [byte], the longest line [character], and lines that are converted at once."""
SAMPLE = 100
"""Lines that tell delimiter, decimal sign and header."""
LARGEST = 1e19
"""Nothing that is logged is larger; nanoseconds since 1970 are 2e18."""
DATAFLASH = b"\xa3\x95"
"""Every message of an ArduPilot log begins so."""
REMARKS = ("#", "%", "//")
FORMATS = ((",", "."), *itertools.product((";", "\t", "|", " "), (".", ",")))
"""Delimiter (a blank is any white space) and decimal sign."""


@dataclass(frozen=True, kw_only=True)
class Column:
    """One column of a log.

    Args:
        values: numbers, or seconds of dates and times; NaN in gaps. Shape (rows,).
        unit: as the file writes it, empty if it does not.
        form: what its cells are: "number", "text", or a form of `logs.times`.
    """

    values: np.ndarray
    unit: str = ""
    form: str = NUMBER


@dataclass(frozen=True, kw_only=True)
class Table:
    """What a log holds.

    Args:
        source: the file, as the user named it.
        columns: name → column; all of one length.
        notes: what was left out in reading, in sentences.
    """

    source: str
    columns: Mapping[str, Column]
    notes: tuple[str, ...] = ()


def read_table(path: str | Path) -> Table:
    """Return the table in a file; its ending says how it is read, and all others are CSV.

    Raises:
        UserError: it cannot be read, is too large, or holds no table.
    """
    try:
        check_readable(path)
    except UnreadableFileError as error:
        raise refusal(path, error.why, error.remedy) from None
    size = Path(path).stat().st_size
    if size > MOST_OF_A_LOG:
        raise refusal(
            path,
            f"it has {size // MEGABYTE} MB, and at most {MOST_OF_A_LOG // MEGABYTE} are read",
            "Split it.",
        )
    read = READERS.get(Path(path).suffix.lower(), _read_csv)
    columns, notes = read(Path(path))
    if len(columns) > MOST_COLUMNS:
        raise refusal(
            path, f"it has {len(columns)} columns, and at most {MOST_COLUMNS} are read", "Leave some out."
        )
    columns = {
        name: column for name, column in columns.items() if not (_is_nameless(name) and _is_empty(column))
    }
    if not columns or not max(column.values.size for column in columns.values()):
        raise refusal(path, "it holds no samples", "It needs names of columns, and rows of numbers.")
    gaps = [_without_sentinels(name, column) for name, column in columns.items()]
    found = {name: column for name, (column, _) in zip(columns, gaps, strict=True)}
    return Table(
        source=printable(str(path)), columns=found, notes=(*notes, *(words for _, words in gaps if words))
    )


def refusal(path: str | Path, why: str, remedy: str) -> UserError:
    """Return the error for a log that cannot be imported, in one line."""
    return UserError(f"The log {printable(str(path))} cannot be imported: {why}. {remedy}")


def _is_nameless(name: str) -> bool:
    return name.startswith("column ")


def _is_empty(column: Column) -> bool:
    return not np.isfinite(column.values).any()


def _without_sentinels(name: str, column: Column) -> tuple[Column, str]:
    """Return a column without numbers that stand for a gap, and a sentence about them."""
    size = np.abs(column.values)
    for sentinel in SENTINELS:
        is_gap = size == sentinel
        others = size[~is_gap & np.isfinite(size)]
        if column.form == NUMBER and is_gap.any() and others.size and others.max() < 0.5 * sentinel:
            words = f"{short(name)}: {is_gap.sum()} cells of ±{sentinel:g} are taken as gaps."
            return replace(column, values=np.where(is_gap, np.nan, column.values)), words
    return column, ""


# CSV


class _Layout(NamedTuple):
    """How a CSV file is written: delimiter, decimal sign, names, units, and lines before the first row."""

    delimiter: str
    decimal: str
    names: tuple[str, ...]
    units: tuple[str, ...]
    skipped: int


def _read_csv(path: Path) -> tuple[dict[str, Column], list[str]]:
    layout = _layout(path, list(itertools.islice(_lines(path), SAMPLE)))
    gathered: list[list[Column]] = [[] for _ in layout.names]
    notes: list[str] = []
    for rows in _chunks(path, layout, notes):
        for at, cells in enumerate(zip(*rows, strict=True)):
            gathered[at].append(_column(cells, layout.decimal))
    columns = {
        name: replace(_joined(parts), unit=unit)
        for name, unit, parts in zip(layout.names, layout.units, gathered, strict=True)
        if parts
    }
    return columns, notes


def _lines(path: Path) -> Iterator[str]:
    """Give the lines of a text file, without ends."""
    with open(path, encoding=_encoding(path), errors="replace", newline=None) as file:
        while line := file.readline(LONGEST_LINE):
            if len(line) == LONGEST_LINE:
                raise refusal(
                    path, f"a line has more than {LONGEST_LINE} characters", "Is it a table in text?"
                )
            yield line.rstrip("\n")


def _encoding(path: Path) -> str:
    """Return the encoding of a text file, from its first bytes."""
    with open(path, "rb") as file:
        head = file.read(HEAD)
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    if b"\0" in head:
        raise refusal(
            path, "it is no text, and its ending says nothing else", f"Read are CSV, {', '.join(READERS)}."
        )
    try:
        head.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        return "utf-8-sig" if error.start > len(head) - 4 == HEAD - 4 else "latin-1"
    return "utf-8-sig"


def _layout(path: Path, lines: list[str]) -> _Layout:
    """Find how a CSV file is written from its first lines; a remark before the first row may hold the names."""
    written = [(at, line) for at, line in enumerate(lines) if line.strip()]
    plain = [line for _, line in written if not line.startswith(REMARKS)]
    if not plain:
        raise refusal(path, "it holds no samples", "It needs names of columns, and rows of numbers.")
    delimiter, decimal = max(FORMATS, key=lambda kind: _fit(plain, *kind))
    width = _width([_cells(line, delimiter) for line in plain])
    rows = [(at, _cells(line.lstrip("#%/ "), delimiter), line.startswith(REMARKS)) for at, line in written]
    full = [row for row in rows if len(row[1]) == width]
    first = next(k for k, (_, _, is_remark) in enumerate(full) if not is_remark)
    first -= _has_numbers(full[first][1], decimal)  # then the names stand in a remark before, or nowhere
    if first < 0:
        raise refusal(path, "its first row has numbers, not names of columns", "Write names above it.")
    at, units = full[first][0], [""] * width
    if len(full) > first + 1 and _are_units(full[first + 1][1], decimal):
        at, units, _ = full[first + 1]
    return _Layout(delimiter, decimal, _distinct(full[first][1]), tuple(units), at + 1)


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    if '"' in line:
        try:
            return [
                cell.strip() for cell in next(csv.reader([line], delimiter=delimiter, skipinitialspace=True))
            ]
        except (csv.Error, StopIteration):
            return []
    return [cell.strip() for cell in line.split(delimiter)]


def _width(rows: Sequence[Sequence[str]]) -> int:
    """Return the usual number of cells in a row."""
    return Counter(len(row) for row in rows).most_common(1)[0][0]


def _fit(lines: list[str], delimiter: str, decimal: str) -> tuple[bool, float, int]:
    """Say how well a delimiter and a decimal sign suit some lines: the share of cells that are values in full rows."""
    rows = [_cells(line, delimiter) for line in lines]
    width = _width(rows)
    full = [row for row in rows if len(row) == width]
    good = sum(_is_value(cell, decimal) for row in full for cell in row)
    return width > 1, len(full) / len(rows) * good / max(sum(map(len, full)), 1), width


def _is_value(cell: str, decimal: str) -> bool:
    return cell.lower() in GAPS or _number(cell, decimal) is not None or seconds_of(cell) is not None


def _has_numbers(row: Sequence[str], decimal: str) -> bool:
    return any(_number(cell, decimal) is not None or seconds_of(cell) is not None for cell in row)


def _are_units(row: Sequence[str], decimal: str) -> bool:
    """Say whether a row holds units: no numbers, and most of its cells are known."""
    written = [cell for cell in row if cell]
    return bool(written) and not _has_numbers(row, decimal) and 2 * sum(map(is_unit, written)) > len(written)


def _distinct(names: Sequence[str]) -> tuple[str, ...]:
    """Return names of which none is empty and none occurs twice."""
    found: dict[str, None] = {}
    for at, name in enumerate(names, start=1):
        new = name or f"column {at}"
        while new in found:
            new = f"{name} ({at})"
            name = f"{name}_"
        found[new] = None
    return tuple(found)


def _chunks(path: Path, layout: _Layout, notes: list[str]) -> Iterator[list[list[str]]]:
    """Give the rows, some thousands at once; a last row that was cut off is left out."""
    rows, width, cut = list[list[str]](), len(layout.names), 0
    for number, line in enumerate(_lines(path), start=1):
        if number <= layout.skipped or not line.strip() or line.startswith(REMARKS):
            continue
        if cut:
            why = f"line {cut} has another number of cells than the {width} names"
            raise refusal(path, why, "Repair or remove it.")
        row = _cells(line, layout.delimiter)
        if len(row) == width:
            rows.append(row)
        else:
            cut = number
        if len(rows) == CHUNK:
            yield rows
            rows = []
    notes += [f"The last row, line {cut}, was cut off and is left out."] if cut else []
    yield rows


def _number(cell: str, decimal: str) -> float | None:
    try:
        return float(cell.replace(",", ".", 1) if decimal == "," else cell)
    except ValueError:
        return None


def _column(cells: Sequence[str], decimal: str) -> Column:
    """Convert cells of one column; its form is that of most of them that are no gaps."""
    if decimal == ".":
        try:
            return _finite(np.array(cells, dtype=float), NUMBER)
        except ValueError:
            pass
    values, forms = np.full(len(cells), np.nan), Counter[str]()
    for at, cell in enumerate(cells):
        if cell.lower() not in GAPS:
            number = _number(cell, decimal)
            form, values[at] = (NUMBER, number) if number is not None else seconds_of(cell) or (TEXT, np.nan)
            forms[form] += 1
    return _finite(values, _form(forms))


def _finite(values: np.ndarray, form: str) -> Column:
    return Column(values=np.where(np.abs(values) <= LARGEST, values, np.nan), form=form)


def _form(forms: Counter[str]) -> str:
    """Return the form of a column; dates with a zone and dates without cannot be set side by side."""
    if not forms:
        return NUMBER
    if all(form in forms for form in DATE_AND_TIME):
        return MIXED
    return TEXT if TEXT in forms and 2 * forms[TEXT] >= forms.total() else forms.most_common(1)[0][0]


def _joined(parts: list[Column]) -> Column:
    forms = Counter(part.form for part in parts if not _is_empty(part)) or Counter([parts[0].form])
    return Column(values=np.concatenate([part.values for part in parts]), form=_form(forms))


# Other files


def _read_mat(path: Path) -> tuple[dict[str, Column], list[str]]:
    """Read vectors of a MATLAB file, also those in structures; the most frequent length is that of the log."""
    from scipy.io import loadmat

    try:
        content = loadmat(path, simplify_cells=True)
    except NotImplementedError:
        raise refusal(path, "it is MATLAB's version 7.3", "Save it with -v7.") from None
    except (ValueError, TypeError, OSError, MemoryError, IndexError, KeyError) as error:
        raise refusal(
            path, f"it is damaged or no MATLAB file ({_one_line(error)})", "Save it anew."
        ) from None
    vectors = dict(_vectors("", content))
    length = max(
        Counter(v.size for v in vectors.values()).items(), key=lambda item: item[::-1], default=(0, 0)
    )[0]
    return {name: _finite(v, NUMBER) for name, v in vectors.items() if v.size == length}, []


def _vectors(name: str, value: Any) -> Iterator[tuple[str, np.ndarray]]:
    """Give the vectors of numbers in nested mappings."""
    if isinstance(value, dict):
        for key, inner in value.items():
            if not key.startswith("__"):
                yield from _vectors(f"{name}.{key}" if name else key, inner)
    elif (
        isinstance(value, np.ndarray)
        and value.dtype.kind in "fiu"
        and max(value.shape, default=0) == value.size > 1
    ):
        yield name, value.astype(float).ravel()


def _read_netcdf(path: Path) -> tuple[dict[str, Column], list[str]]:
    """Read the variables of a netCDF file along its time."""
    import xarray as xr

    try:
        with xr.open_dataset(path, engine="netcdf4", decode_timedelta=False) as opened:
            data = opened.load()
    except (ValueError, OSError, RuntimeError, KeyError, TypeError, OverflowError) as error:
        raise refusal(
            path, f"it is damaged or no netCDF file ({_one_line(error)})", "Save it anew."
        ) from None
    flat = {str(name): v for name, v in data.variables.items() if v.ndim == 1 and v.dtype.kind in "fiuM"}
    along = Counter(v.dims[0] for v in flat.values()).most_common(1)
    return {name: _of_variable(v) for name, v in flat.items() if v.dims[0] == along[0][0]}, []


def _of_variable(variable: Any) -> Column:
    if variable.dtype.kind == "M":
        stamps = variable.values.astype("datetime64[ns]")
        seconds = stamps.astype(np.int64) / 1e9
        return Column(values=np.where(np.isnat(stamps), np.nan, seconds), form=DATE_AND_TIME[0])
    return replace(_finite(variable.values.astype(float), NUMBER), unit=str(variable.attrs.get("units", "")))


def _read_alog(path: Path) -> tuple[dict[str, Column], list[str]]:
    """Read the numbers of a MOOS log: ``time  NAME  source  value``; each name becomes a column with gaps."""
    series: dict[str, dict[float, float]] = {}
    for line in _lines(path):
        parts = line.split(None, 3)
        if len(parts) < 4 or line.startswith("%"):
            continue
        time, value = _number(parts[0], "."), _number(parts[3].strip(), ".")
        if time is not None and value is not None:
            series.setdefault(parts[1], {})[time] = value
    return _side_by_side(series), []


def _read_dataflash(path: Path) -> tuple[dict[str, Column], list[str]]:
    """Read the numbers of an ArduPilot log that are channels; a name has its message and instance, ``BARO[0].Alt``."""
    try:
        from pymavlink.DFReader import DFReader_binary
    except ImportError:
        raise refusal(path, "pymavlink is not installed", f"pip install '{DISTRIBUTION}[logs]'.") from None
    with open(path, "rb") as file:
        if file.read(2) != DATAFLASH:
            raise refusal(path, "it is no log of ArduPilot", "Give the .BIN file that the autopilot wrote.")
    series: dict[str, dict[float, float]] = {}
    with (
        open(os.devnull, "w") as nowhere,
        contextlib.redirect_stderr(nowhere),
        contextlib.redirect_stdout(nowhere),
    ):
        try:  # and print nothing of what is damaged
            log = DFReader_binary(str(path))
            with contextlib.closing(log.filehandle), contextlib.closing(log.data_map):
                while (message := log.recv_msg()) is not None:
                    _add_numbers(message.to_dict(), series)
        except Exception as error:  # pymavlink raises plain ones
            raise refusal(
                path, f"it is damaged or no log of ArduPilot ({_one_line(error)})", "Copy it anew."
            ) from None
    return _side_by_side(series), []


def _add_numbers(message: dict[str, Any], series: dict[str, dict[float, float]]) -> None:
    """Add the numbers of a message that are channels by their names."""
    instance = f"[{message['I']}]" if "I" in message else ""
    for field, value in message.items():
        name = f"{message['mavpackettype']}{instance}.{field}"
        if isinstance(value, int | float) and "TimeUS" in message and _is_channel(name):
            series.setdefault(name, {})[message["TimeUS"] * 1e-6] = value


@functools.cache
def _is_channel(name: str) -> bool:
    named = recognised(name)
    return named is not None and named.channel != TIME.name


def _side_by_side(series: Mapping[str, Mapping[float, float]]) -> dict[str, Column]:
    """Return samples that each have their own times as columns with gaps, in seconds of one clock."""
    times = np.array(sorted(set().union(*series.values())))
    columns = {TIME.column: Column(values=times, unit="s")} if series else {}
    for name, samples in series.items():
        values = np.full(times.size, np.nan)
        values[np.searchsorted(times, list(samples))] = list(samples.values())
        columns[name] = _finite(values, NUMBER)
    return columns


def _one_line(error: Exception) -> str:
    return printable(re.sub(r"\s+", " ", str(error))[:120])


Reader = Callable[[Path], tuple[dict[str, Column], list[str]]]
READERS: dict[str, Reader] = {
    ".mat": _read_mat,
    ".nc": _read_netcdf,
    ".alog": _read_alog,
    ".bin": _read_dataflash,
}
"""Ending of a file's name → what reads it."""
