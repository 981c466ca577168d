"""Checkpoints of long runs: a run that was killed goes on from there, and ends as if nothing had happened.

A checkpoint is a folder. `simulate` makes several runs of a trial (`subzero.simulation.refinement`), always in the same
order; each has a numbered folder in it with one file, ``state.npz``: all that changes in a run, and its recording so
far. The file is replaced as a whole by one renaming, so a process that is killed leaves the last one. What is read back
are the same bits, and a run does not know how many of its steps were taken at a time: so the rest of the run is the
same to the last bit, too.

The file holds numbers only (``allow_pickle=False``), with a digest of its own; kinds and shapes of all arrays are
checked before compiled code, which does not look at bounds, gets them. ``manifest.json`` says what they belong to.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from itertools import count
from pathlib import Path
from time import monotonic
from typing import Any
from zipfile import BadZipFile

import numpy as np

from cable.memory import fits
from cable.moving_end import enlarged
from subzero.arguments import checked_arguments
from subzero.engine.recording import BY_NODE, BY_TIME, Recording, RunState, new_recording, row_of
from subzero.errors import UserError, checked, printable
from subzero.files.atomic_output import DISK_FULL
from subzero.files.integrity import DamagedError, append_digest, check_arrays, without_digest
from subzero.jit import Record

MANIFEST, STATE, LOCK = "manifest.json", "state.npz", "lock"
COUNTS = ("behind", "used", "ending", "room")
"""Of a state: times done, nodes in use, how the last call ended, nodes at most."""
MINUTE_S = 60.0
BYTES_A_NODE = 5 * 8
"""Place, tension and arc length."""


@checked_arguments
@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """Where a run saves its state, and how often.

    >>> Checkpoint(folder="transect.checkpoint", minutes=10.0).minutes
    10.0

    Attributes:
        folder: new, or that of the same simulation, which then goes on from there.
        minutes: from one checkpoint to the next, of the clock on the wall. [min]
    """

    folder: str | Path
    minutes: float = 5.0

    def __post_init__(self) -> None:
        """Raise an error if the interval is not valid."""
        object.__setattr__(self, "minutes", checked("Checkpoint", "minutes", self.minutes, least=0.0))
        object.__setattr__(self, "folder", Path(self.folder))

    def kept_until(self) -> float | None:
        """Return up to when the run that is under way is kept, None if nothing is. [s]"""
        states = sorted(Path(self.folder).glob(f"*/*/{STATE}"), key=lambda path: path.stat().st_mtime_ns)
        try:
            return _read(states[-1])["time"].item() if states else None
        except UserError:
            return None

    def remove(self) -> None:
        """Remove its files, when the result is safe; other files in the folder are kept."""
        for manifest in Path(self.folder).glob(f"*/{MANIFEST}"):
            shutil.rmtree(manifest.parent)
        with suppress(OSError):
            Path(self.folder).rmdir()


class KeptRun:
    """Saves the state of one run.

    Args:
        folder: of this run alone.
        every: from one checkpoint to the next. [s]
    """

    def __init__(self, folder: Path, every: float) -> None:
        self._path, self._every, self._kept, self._times = folder / STATE, every, monotonic(), 0
        folder.mkdir(exist_ok=True)

    def go_on(self, started: RunState) -> RunState:
        """Return the saved state of the run; the given start if none was saved."""
        if not self._path.exists():
            return started
        state = _read(self._path)
        with _damage_named(self._path):
            counts = {name: _count(state, name) for name in COUNTS}
            line = enlarged(started.live.line, _capacity(started, state))
            like = _arrays(started.setup, "setup") | _arrays(started.live._replace(line=line), "live")
            check_arrays(state, {name: (array.dtype, array.shape) for name, array in like.items()})
            recording = _recording(started, counts, state)
        self._times = counts["behind"]
        return RunState(
            setup=_restored(started.setup, "setup", state),
            live=_restored(started.live, "live", state),
            recording=recording,
            **{name: counts[name] for name in ("behind", "used", "ending")},
        )

    def keep(self, now: RunState, times: np.ndarray, stride: int, *, at_once: bool = False) -> None:
        """Save the state of the run, if it is time for that, or at once."""
        is_due = at_once or monotonic() - self._kept >= self._every
        if not is_due or now.behind == self._times:
            return
        numbers = {
            "behind": now.behind,
            "used": now.used,
            "ending": now.ending,
            "room": now.recording.tension.size,
            "time": float(times[now.behind - 1]),
        }
        arrays = {name: np.array(number) for name, number in numbers.items()}
        _write(
            self._path,
            arrays | _arrays(now.setup, "setup") | _arrays(now.live, "live") | _filled(now, stride),
        )
        self._kept, self._times = monotonic(), now.behind


def _filled(now: RunState, stride: int) -> dict[str, np.ndarray]:
    """Return the filled parts of the arrays of a recording; the last row may be one that the next time replaces."""
    last = row_of(now.behind - 1, stride)
    is_whole = (now.behind - 1) % stride == 0
    nodes = now.used if is_whole else now.used + int(now.recording.nodes[last])
    ends = {"rows": last + 1, "nodes": nodes, "times": now.behind}
    return {
        f"recording.{name}": values[: ends[_kind(name)]] for name, values in now.recording._asdict().items()
    }


def _recording(started: RunState, counts: Mapping[str, int], state: Mapping[str, np.ndarray]) -> Recording:
    """Return a recording with the saved rows, and space for the rest."""
    rows, times = started.recording.state.shape[0], started.recording.trace.shape[0]
    if not fits(BYTES_A_NODE * counts["room"]) or counts["behind"] > times or counts["used"] > counts["room"]:
        raise DamagedError("it has more rows than its run")
    recording = new_recording(rows, counts["room"], times, started.live.state.size)
    for name, values in recording._asdict().items():
        part = state[f"recording.{name}"]
        here = values[: len(part)]
        check_arrays({name: part}, {name: (here.dtype, here.shape)})
        here[:] = part
    return recording


def _count(arrays: Mapping[str, np.ndarray], name: str) -> int:
    """Return a count, which no other kind of array is."""
    check_arrays(arrays, {name: ("iu", ())})
    count = int(arrays[name])
    if count < 0:
        raise DamagedError(f"{name} is {count}")
    return count


def _capacity(started: RunState, state: Mapping[str, np.ndarray]) -> int:
    """Return the number of segments that the saved line has space for: at least as many as at the start."""
    name = "live.line.length"
    check_arrays(state, {name: (np.dtype(float), state[name].shape[:1])})
    return max(state[name].size, started.live.line.length.size) - 1


def _kind(name: str) -> str:
    """Return the meaning of the lines of an array of a recording."""
    return "nodes" if name in BY_NODE else "times" if name in BY_TIME else "rows"


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
    unfinished = path.with_suffix(".new")
    with open(unfinished, "wb") as file:
        np.savez(file, allow_pickle=False, **arrays)
    append_digest(unfinished)
    with open(unfinished, "rb+") as file:
        os.fsync(file.fileno())
    os.replace(unfinished, path)


def _read(path: Path) -> dict[str, np.ndarray]:
    """Return the arrays of a file; raise an error if its contents have changed."""
    with _damage_named(path):
        inside = BytesIO(without_digest(path.read_bytes()))
        with np.load(inside, allow_pickle=False) as file:
            return {name: file[name] for name in file.files}


@contextmanager
def _damage_named(path: Path) -> Iterator[None]:
    """Report damage to a file as a UserError with the remedy."""
    try:
        yield
    except (
        DamagedError,
        BadZipFile,
        ValueError,
        EOFError,
        LookupError,
        AttributeError,
        FileNotFoundError,
    ) as error:
        raise UserError(
            f"The checkpoint {printable(str(path.parent))} is damaged ({printable(path.name)}). Remove it to begin"
            " anew, or give another folder."
        ) from error


Keeper = Callable[[], KeptRun]


@contextmanager
def opened(checkpoint: Checkpoint, label: str, manifest: Mapping[str, str]) -> Iterator[Keeper]:
    """Return the keeper of the runs of a simulation: a function that gives that of the next run, in their order.

    Args:
        checkpoint: where and how often.
        label: of this simulation among those that share the folder.
        manifest: the settings they belong to: name → its digest.

    Raises:
        UserError: it holds another simulation, another command has it, it cannot be written or read.
    """
    folder = Path(checkpoint.folder) / label
    with _disk_errors_named(folder):
        folder.mkdir(parents=True, exist_ok=True)
        with _locked(folder):
            _refuse_another(folder, manifest)
            numbers = count(1)
            yield lambda: KeptRun(folder / f"run-{next(numbers)}", MINUTE_S * checkpoint.minutes)


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
    """Raise an error for the checkpoint of another simulation; mark a new one as this one's."""
    path = folder / MANIFEST
    if not path.exists():
        unfinished = path.with_suffix(".new")
        unfinished.write_text(json.dumps(dict(manifest), indent=1) + "\n", encoding="utf-8")
        os.replace(unfinished, path)
        return
    with _damage_named(path):
        known = json.loads(path.read_text(encoding="utf-8"))
        differ = [what for what in manifest if known.get(what) != manifest[what]]
    if differ:
        raise UserError(
            f"The checkpoint {printable(str(folder))} belongs to another simulation: its {', '.join(differ)}"
            f" {'differ' if len(differ) > 1 else 'differs'}. Give another folder, or remove it to begin anew."
        )


@contextmanager
def _disk_errors_named(folder: Path) -> Iterator[None]:
    """Report a checkpoint that cannot be written as an error with the remedy."""
    try:
        yield
    except OSError as error:
        if error.filename is None and error.errno not in DISK_FULL:
            raise
        raise UserError(
            f"The checkpoint {printable(str(folder))} cannot be written: {error.strerror}. What it has is kept: make"
            " room, and start the same again, or give another folder."
        ) from error
