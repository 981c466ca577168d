"""Checkpoints of long runs: a run that was killed goes on from there, and ends as if nothing had happened.

A checkpoint is a folder. `simulate` makes several runs of a trial (`subzero.simulation.refinement`), always in the
same order: each has a numbered folder in it, with

    rows-000000.npz, …   the rows of its recording, as many as came between two checkpoints, and
    state.npz            where it stands: all that changes in a run, and of how many of those files it is the end.

Every file is written beside its place, forced to the disk and renamed, the state last; so whenever the process is
killed, the state and the rows that it names are whole. What is read back are the same bits, and a run does not know how
many of its steps were taken at a time: so the rest of the run is the same to the last bit, too.

The files hold numbers only (``allow_pickle=False``), with a digest of their own; kinds and shapes of all arrays are
proved before compiled code, which does not look at bounds, gets them. What they belong to stands in ``manifest.json``.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from time import monotonic
from typing import Any
from zipfile import BadZipFile

import numpy as np

from cable.memory import fits
from cable.moving_end import enlarged
from subzero.arguments import checked_arguments
from subzero.engine.recording import BY_NODE, BY_TIME, Recording, Standing, new_recording, row_of
from subzero.errors import UserError, checked, printable
from subzero.files.atomic_output import DISK_FULL
from subzero.files.integrity import DamagedError, append_digest, check_arrays, without_digest
from subzero.jit import Record

MANIFEST, STATE, LOCK = "manifest.json", "state.npz", "lock"
COUNTS = ("files", "rows", "nodes", "times", "behind", "used", "ending", "room")
"""Of a state: files, rows, nodes and times kept; times behind, nodes in use, how the last call ended, nodes at most."""
MINUTE_S = 60.0
BYTES_A_NODE = 5 * 8
"""Place, tension and arc length."""


class _UnreadableError(Exception):
    """A file of a checkpoint is not what was written."""


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Where a run keeps where it stands, and how often.

    >>> Checkpoint(folder="transect.checkpoint", minutes=10.0).minutes
    10.0

    Attributes:
        folder: new, or that of the same simulation, which then goes on from there.
        minutes: from one checkpoint to the next, of the clock on the wall. [min]
    """

    folder: str | Path
    minutes: float = 5.0

    def __post_init__(self) -> None:
        """Refuse what is no time."""
        object.__setattr__(self, "minutes", checked("Checkpoint", "minutes", self.minutes, least=0.0))
        object.__setattr__(self, "folder", Path(self.folder))

    def stands_at(self) -> float | None:
        """Return up to when the run that is under way is kept, None if nothing is. [s]"""
        states = sorted(Path(self.folder).glob(f"*/*/{STATE}"), key=lambda path: path.stat().st_mtime_ns)
        try:
            return _read(states[-1])["time"].item() if states else None
        except _UnreadableError:
            return None

    def remove(self) -> None:
        """Remove its files, when the result is safe; others that are in the folder stay."""
        for manifest in Path(self.folder).glob(f"*/{MANIFEST}"):
            shutil.rmtree(manifest.parent)
        with suppress(OSError):
            Path(self.folder).rmdir()


class Keeper:
    """Keeps the runs that one simulation makes, in their order; `opened` gives one.

    Args:
        folder: where to.
        every: from one checkpoint to the next. [s]
    """

    def __init__(self, folder: Path, every: float) -> None:
        self._folder, self._every, self._runs = folder, every, 0

    def next_run(self) -> KeptRun:
        """Return what keeps the next run."""
        self._runs += 1
        return KeptRun(self._folder / f"run-{self._runs}", self._every)


class KeptRun:
    """Keeps where one run stands.

    Args:
        folder: of this run alone.
        every: from one checkpoint to the next. [s]
    """

    def __init__(self, folder: Path, every: float) -> None:
        self._folder, self._every, self._kept = folder, every, monotonic()
        self._files, self._rows, self._nodes, self._times = 0, 0, 0, 0
        folder.mkdir(exist_ok=True)

    def go_on(self, begun: Standing) -> Standing:
        """Return where the run stands that was kept here; what has `begun` where none was."""
        path = self._folder / STATE
        if not path.exists():
            return begun
        state = _read(path)
        with _named(path):
            counts = {name: _count(state, name) for name in COUNTS}
            line = enlarged(begun.live.line, _capacity(begun, state))
            like = _arrays(begun.setup, "setup") | _arrays(begun.live._replace(line=line), "live")
            check_arrays(state, {name: _layout(array) for name, array in like.items()})
            rows, times = begun.recording.state.shape[0], begun.recording.trace.shape[0]
            most = {
                "rows": rows,
                "times": times,
                "behind": times,
                "nodes": counts["room"],
                "used": counts["room"],
            }
            if not fits(BYTES_A_NODE * counts["room"]) or any(counts[name] > most[name] for name in most):
                raise DamagedError("it has more rows than its run")
        room = new_recording(rows, counts["room"], times)
        for number in range(counts["files"]):
            self._fill(room, self._folder / _rows_file(number))
        self._files, self._rows, self._nodes, self._times = (
            counts[name] for name in ("files", "rows", "nodes", "times")
        )
        return Standing(
            setup=_restored(begun.setup, "setup", state),
            live=_restored(begun.live, "live", state),
            recording=room,
            **{name: counts[name] for name in ("behind", "used", "ending")},
        )

    def keep(self, now: Standing, times: np.ndarray, stride: int, *, at_once: bool = False) -> None:
        """Keep where the run stands, if it is time for that, or at once."""
        is_due = at_once or monotonic() - self._kept >= self._every
        if not is_due or now.behind == self._times:
            return
        last = row_of(now.behind - 1, stride)
        is_whole = (now.behind - 1) % stride == 0  # else the next time is written over the last row
        nodes = now.used if is_whole else now.used + int(now.recording.nodes[last])
        rows = {
            "rows": slice(self._rows, last + 1),
            "nodes": slice(self._nodes, nodes),
            "times": slice(self._times, now.behind),
        }
        kept = {name: values[rows[_kind(name)]] for name, values in now.recording._asdict().items()}
        _write(
            self._folder / _rows_file(self._files),
            kept | {f"first of {kind}": np.array(part.start) for kind, part in rows.items()},
        )
        self._files += 1
        self._rows, self._nodes, self._times = (last + 1 if is_whole else last), now.used, now.behind
        self._write_state(now, float(times[now.behind - 1]))
        self._kept = monotonic()

    def _write_state(self, now: Standing, time: float) -> None:
        numbers = {
            "files": self._files, "rows": self._rows, "nodes": self._nodes, "times": self._times,
            "behind": now.behind, "used": now.used, "ending": now.ending,
            "room": now.recording.tension.size, "time": time,
        }  # fmt: skip
        arrays = {name: np.array(number) for name, number in numbers.items()}
        _write(self._folder / STATE, arrays | _arrays(now.setup, "setup") | _arrays(now.live, "live"))

    def _fill(self, room: Recording, path: Path) -> None:
        """Put rows that were kept back to their place; the last of a file may stand in the next one again."""
        kept = _read(path)
        with _named(path):
            firsts = {kind: _count(kept, f"first of {kind}") for kind in ("rows", "nodes", "times")}
            for name, values in room._asdict().items():
                first, part = firsts[_kind(name)], kept[name]
                here = values[first : first + len(part)]
                check_arrays({name: part}, {name: _layout(here)})
                here[:] = part


def _count(arrays: Mapping[str, np.ndarray], name: str) -> int:
    """Return a count, which no other kind of array is."""
    check_arrays(arrays, {name: ("iu", ())})
    count = int(arrays[name])
    if count < 0:
        raise DamagedError(f"{name} is {count}")
    return count


def _capacity(begun: Standing, state: Mapping[str, np.ndarray]) -> int:
    """Return for how many segments the kept line has room: at least as many as at the start."""
    name = "live.line.length"
    check_arrays(state, {name: (np.dtype(float), state[name].shape[:1])})
    return max(state[name].size, begun.live.line.length.size) - 1


def _layout(array: np.ndarray) -> tuple[np.dtype, tuple[int, ...]]:
    """Return kind and shape of an array, as `check_arrays` expects them."""
    return array.dtype, array.shape


def _kind(name: str) -> str:
    """Return what the lines of an array of a recording are."""
    return "nodes" if name in BY_NODE else "times" if name in BY_TIME else "rows"


def _rows_file(number: int) -> str:
    return f"rows-{number:06d}.npz"


def _arrays(value: Any, name: str) -> dict[str, np.ndarray]:
    """Return the arrays and records that a value of a run is made of, by their path; records as bytes."""
    if isinstance(value, Record):
        return {name: np.frombuffer(value.tobytes(), np.uint8)}
    if isinstance(value, np.ndarray):
        return {name: value}
    parts = [_arrays(getattr(value, field), f"{name}.{field}") for field in value._fields]
    return {path: array for part in parts for path, array in part.items()}


def _restored(like: Any, name: str, arrays: Mapping[str, np.ndarray]) -> Any:
    """Return a value from its arrays, made as another one of its kind."""
    if isinstance(like, Record):
        return np.frombuffer(arrays[name].tobytes(), like.dtype).copy()[0]
    if isinstance(like, np.ndarray):
        found = arrays[name]
        found.flags.writeable = like.flags.writeable
        return found
    return type(like)(*(_restored(getattr(like, field), f"{name}.{field}", arrays) for field in like._fields))


def _write(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Write arrays to a file: whole, or not at all."""
    beside = path.with_suffix(".new")
    with open(beside, "wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
    append_digest(beside)
    with open(beside, "rb") as file:
        os.fsync(file.fileno())
    _rename(beside, path)


def _rename(beside: Path, path: Path) -> None:
    os.replace(beside, path)
    with suppress(PermissionError):  # Windows opens no folder
        handle = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)


def _read(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file, if it is what was written."""
    with _named(path):
        inside = BytesIO(without_digest(path.read_bytes()))
        with np.load(inside, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}


@contextmanager
def _named(path: Path) -> Iterator[None]:
    """Say of which file it is what is wrong with it."""
    try:
        yield
    except (DamagedError, BadZipFile, ValueError, EOFError, LookupError, FileNotFoundError) as error:
        raise _UnreadableError(path) from error


@contextmanager
def opened(checkpoint: Checkpoint, label: str, manifest: Mapping[str, str]) -> Iterator[Keeper]:
    """Give what keeps the runs of a simulation.

    Args:
        checkpoint: where and how often.
        label: of this simulation among those that share the folder.
        manifest: what they belong to: what → its digest.

    Raises:
        UserError: it holds another simulation, another command has it, it cannot be written or read.
    """
    folder = Path(checkpoint.folder) / label
    with _told(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with _locked(folder):
            _refuse_another(folder, manifest)
            yield Keeper(folder, MINUTE_S * checkpoint.minutes)


@contextmanager
def _locked(folder: Path) -> Iterator[None]:
    """Lock a folder as long as this process lives, or the block lasts."""
    from filelock import FileLock, Timeout  # half a second, which only a run with a checkpoint has to spend

    try:
        with FileLock(folder / LOCK, timeout=0.0, mode=0o600):
            yield
    except Timeout:
        raise UserError(
            f"Another command is at work with the checkpoint {printable(str(folder))}. Wait for it, or give"
            " another folder."
        ) from None


def _refuse_another(folder: Path, manifest: Mapping[str, str]) -> None:
    """Refuse the checkpoint of another simulation; mark a new one as this one's."""
    path = folder / MANIFEST
    if not path.exists():
        beside = path.with_suffix(".new")
        beside.write_text(json.dumps(dict(manifest), indent=1) + "\n", encoding="utf-8")
        _rename(beside, path)
        return
    try:
        known = json.loads(path.read_text(encoding="utf-8"))
        differ = [what for what in manifest if known.get(what) != manifest[what]]
    except (ValueError, AttributeError) as error:
        raise _UnreadableError(path) from error
    if differ:
        raise UserError(
            f"The checkpoint {printable(str(folder))} belongs to another simulation: its {', '.join(differ)}"
            f" {'differ' if len(differ) > 1 else 'differs'}. Give another folder, or remove it to begin anew."
        )


@contextmanager
def _told(folder: Path) -> Iterator[None]:
    """Turn a refusal of the disk, or a file that is damaged, into a clean message."""
    name = printable(str(folder))
    try:
        yield
    except _UnreadableError as error:
        raise UserError(
            f"The checkpoint {name} is damaged ({printable(str(error))}). Remove it to begin anew, or give another"
            " folder."
        ) from error
    except OSError as error:
        if error.filename is None and error.errno not in DISK_FULL:
            raise
        raise UserError(
            f"The checkpoint {name} cannot be written: {error.strerror}. What it has is kept: make room, and start the"
            " same again, or give another folder."
        ) from error
