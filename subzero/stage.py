"""Deliver a set of files to a folder: all of them or none, whatever happens while it is done.

1. Files are written to a hidden folder on the same disk. It is made before anything is simulated, so a folder that
   cannot be written is refused at once.
2. When all are complete they are forced to the disk (fsync). Into a new folder they come by one renaming.
3. Into a folder that exists they move one by one, so that other files of the user stay where they are. From before
   the first move until after the last a marker, `user_file.INCOMPLETE`, lies in the folder, and what is replaced is
   kept. An error or an interrupt in between puts everything back.
4. A process that is killed in between leaves the marker: readers then refuse the files that it names, and the next
   command with that folder finishes the moves (they are complete on the disk) before it does anything else.

Every hidden folder is locked by its process. The lock ends with the process, however it ends, and tells the next
command that the folder is a leftover, to be swept. What is left out: two commands that write the same folder at the
same time both succeed, the later one stays.
"""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from subzero.errors import UserError, printable
from subzero.interrupts import came
from subzero.user_file import INCOMPLETE, MOST_OF_AN_ANSWER, read_bytes

HIDDEN = ".subzero-"
"""How the names of hidden folders begin."""

LOCK, NEW, OLD = "lock", "new", "old"
"""In a hidden folder: the lock of its process, the files to be delivered, those that they replace."""

STOPPED = "stopped"
"""Folder inside the output folder for a run that could not go on, where a completed one would be lost."""

LONGEST_WAIT = 10.0
"""So long is another command waited for that moves its files; it takes milliseconds. [s]"""

SWEPT_ABOVE = 2
"""So many folders above are swept too: the folder may have been new when its command was killed."""

FULL = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EIO)
"""What a disk says that can take no more."""

_delivered: list[Path] = []
"""Folders that this process has delivered to since the last `staged` began, for `interruption`."""

_hidden: dict[Path, Path] = {}
"""Hidden folders that this process works with, and the output folders that they are for."""


@dataclass
class Stage:
    """Where files are written before all of them move to the output folder.

    Attributes:
        path: the hidden folder.
        folder: the output folder, as the user named it; after the delivery the one that holds the files.
        written: names of the files that have been delivered.
        failed: the run could not go on or was broken off; it then replaces no good result.
    """

    path: Path
    folder: Path
    written: list[str] = field(default_factory=list)
    failed: bool = False

    def files(self) -> dict[str, Any]:
        """Return what was written where, ready for JSON."""
        return {"folder": printable(str(self.folder)), "files": list(self.written)}

    def words(self) -> str:
        """Return what was written where, as it is told on the terminal."""
        told = f"Wrote {printable(str(self.folder))}{os.sep}: {', '.join(self.written)}"
        spared = self.failed and self.folder.name == STOPPED
        return (
            f"{told}\nWhat was in {printable(str(self.folder.parent))}{os.sep} stays as it was."
            if spared
            else told
        )


@contextmanager
def staged(folder: Path, names: Iterable[str] = ()) -> Iterator[Stage]:
    """Give a stage to write to; its files appear in `folder` when the block ends without an error.

    Files of the same name are replaced, others stay. The files of a failed run (`Stage.failed`) go to the folder
    ``stopped`` inside if they would replace a result that is not known to be a failure itself.

    Args:
        folder: where to.
        names: files that will be written, as far as known: folders of these names are refused at once.

    Raises:
        UserError: `folder` cannot be made or written; if it can be known, at once.
    """
    _delivered.clear()
    with ExitStack() as held:
        with told(folder):
            home = _home(folder)
            _refuse_occupied(folder, names)
            root = held.enter_context(_hidden_folder(home, folder))
        stage = Stage(root / NEW, folder)
        with told(folder, inside=root):
            yield stage
        with told(folder):
            _deliver(stage, root)


def interruption() -> str:
    """Return what an interrupt that ended a command left behind, in words."""
    if not (_delivered and os.path.lexists(_delivered[-1])):
        return "nothing was written"
    folder = _delivered[-1]
    if os.path.lexists(folder / INCOMPLETE):
        return f"{printable(str(folder))} is incomplete; the next command with it as --out puts it right"
    return f"all files were written to {printable(str(folder))}"


@contextmanager
def told(folder: Path, inside: Path | None = None) -> Iterator[None]:
    """Turn a refusal of the disk into a clean message.

    Args:
        folder: the output folder.
        inside: if given, only errors of files in this folder, and of a disk that can take no more.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        if inside is not None and not _is_of_disk(error, inside):
            raise
        if isinstance(error, ValueError) and came():
            raise  # what matplotlib's drawing in C++ made of an interrupt, no word of the disk
        reason = getattr(error, "strerror", None) or str(error)
        raise UserError(
            f"The output folder {printable(str(folder))} cannot be written: {reason}. "
            "Give another one with --out DIR."
        ) from error


def _is_of_disk(error: Exception, folder: Path) -> bool:
    if not isinstance(error, OSError):
        return False
    if isinstance(error.filename, str | os.PathLike):
        return Path(error.filename).is_relative_to(folder)
    return error.errno in FULL


# Before: a hidden folder that can be written.


def _home(folder: Path) -> Path:
    """Return the folder that will hold the hidden one: the output folder, or the nearest one above that is there."""
    home = folder.absolute()
    try:
        str(home).encode("utf-8")
    except UnicodeEncodeError:
        raise ValueError(f"{_shown(home)} is no name in UTF-8, as netCDF needs one") from None
    while not home.exists():
        if home.is_symlink():
            raise FileNotFoundError(0, f"{_shown(home)} is a link to something that is not there")
        home = home.parent
    if not home.is_dir():
        raise NotADirectoryError(0, f"{_shown(home)} is a file, not a folder")
    return home


def _refuse_occupied(folder: Path, names: Iterable[str]) -> None:
    """Refuse names at which something stands that is no file."""
    for name in names:
        with suppress(FileNotFoundError, NotADirectoryError):
            mode = os.lstat(folder / name).st_mode
            if not stat.S_ISREG(mode) and not stat.S_ISLNK(mode):
                kind = "a folder" if stat.S_ISDIR(mode) else "a device, a pipe or a socket"
                raise FileExistsError(
                    0, f"'{printable(name)}' in it is {kind}, where a file of this name has to go"
                )


@contextmanager
def _hidden_folder(home: Path, folder: Path) -> Iterator[Path]:
    """Make a hidden folder, locked, after sweeping up what dead processes left; remove it at the end."""
    with ExitStack() as held:
        for above in home.parents[:SWEPT_ABOVE]:
            with suppress(OSError), _alone(above, 0.0) as is_alone:
                if is_alone:
                    _sweep(above)
        with _alone(home) as is_alone:
            if is_alone:
                _sweep(home)
            root = home / f"{HIDDEN}{os.getpid()}-{os.urandom(4).hex()}"
            root.mkdir(mode=0o700)
            _hidden[root] = folder
            held.callback(_hidden.pop, root, None)
            held.callback(_remove, root, folder)
            for inner in (NEW, OLD):
                (root / inner).mkdir()
            held.enter_context(_locked(root / LOCK))
        yield root


def sweep_own() -> None:
    """Remove what this process has hidden, before it ends at once; what a folder needs to be finished stays.

    Renamed first: a delivery that goes on meanwhile finds all of its files, or none.
    """
    for root, folder in list(_hidden.items()):
        if not any(marker and marker.root == root for marker in map(_marker, (folder, folder / STOPPED))):
            gone = root.with_name(f"{root.name}-gone")
            with suppress(OSError):
                os.rename(root, gone)
            shutil.rmtree(gone, ignore_errors=True)


def _remove(root: Path, folder: Path) -> None:
    """Remove a hidden folder, unless the output folder still needs it to be finished."""
    markers = [_marker(one) for one in (folder, folder / STOPPED)]
    if not any(marker and marker.root == root for marker in markers):
        shutil.rmtree(root, ignore_errors=True)


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Lock a file as long as this process lives, or the block lasts."""
    handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        with suppress(OSError):  # a disk without locks: its leftovers are never swept
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        yield
    finally:
        os.close(handle)


@contextmanager
def _alone(folder: Path, wait: float = LONGEST_WAIT) -> Iterator[bool]:
    """Keep other commands from sweeping or moving in a folder; gives whether that could be had, after a while. [s]"""
    handle = os.open(folder, os.O_RDONLY)
    try:
        yield _waited_for(handle, time.monotonic() + wait)
    finally:
        os.close(handle)


def _waited_for(handle: int, until: float) -> bool:
    while True:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() > until:
                return False
            time.sleep(0.02)
        except OSError:
            return False
        else:
            return True


# Leftovers of processes that were killed.


def _sweep(home: Path) -> None:
    """Finish what a dead process had begun to move into a folder, and remove its hidden folders."""
    with suppress(OSError):
        _finish(home)
    for root in home.glob(f"{HIDDEN}*"):
        with suppress(OSError):
            if _is_leftover(root):
                shutil.rmtree(root, ignore_errors=True)


def _finish(folder: Path) -> None:
    """Move the rest of a complete set of files to its place, if a dead process has left one."""
    marker = _marker(folder)
    if marker is None or not marker.root.name.startswith(HIDDEN) or not _is_leftover(marker.root):
        return
    for path in sorted((marker.root / NEW).iterdir()):
        os.replace(path, folder / path.name)
    _settle(folder, marker.doubtful)
    shutil.rmtree(marker.root, ignore_errors=True)


def _is_leftover(root: Path) -> bool:
    """Say whether a hidden folder is ours, and nobody's any more."""
    about = root.lstat()
    if not stat.S_ISDIR(about.st_mode) or about.st_uid != os.geteuid():
        return False
    try:
        handle = os.open(root / LOCK, os.O_RDWR)
    except FileNotFoundError:
        return True  # killed before it could lock: making and sweeping exclude each other
    try:
        fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    finally:
        os.close(handle)
    return True


@dataclass(frozen=True)
class Marker:
    """What the marker in an output folder says.

    Attributes:
        root: the hidden folder that files come from.
        files: names of files that are old or new as long as the marker is there.
        doubtful: those of an earlier interruption, which the files do not replace.
    """

    root: Path
    files: frozenset[str]
    doubtful: frozenset[str] = frozenset()

    def write(self, path: Path) -> None:
        """Write it, and force it to the disk."""
        words = (
            "Files are moving here. If no command is running, one was interrupted; the next one finishes it."
        )
        said = {"subzero": words, "from": str(self.root), "files": sorted(self.files | self.doubtful)}
        said["doubtful"] = sorted(self.doubtful)
        path.write_text(json.dumps(said, indent=1) + "\n", encoding="utf-8")
        _force(path)


def _marker(folder: Path) -> Marker | None:
    """Return what the marker of a folder says; None if there is none, or one that says nothing."""
    try:
        said = json.loads(read_bytes(folder / INCOMPLETE, MOST_OF_AN_ANSWER))
        doubtful = frozenset(map(str, said["doubtful"]))
        return Marker(Path(said["from"]), frozenset(map(str, said["files"])) - doubtful, doubtful)
    except (UserError, ValueError, KeyError, TypeError, RecursionError):
        return None


# After: the delivery.


def _deliver(stage: Stage, root: Path) -> None:
    """Move the files of a stage to their place: all or none."""
    names = sorted(os.listdir(stage.path))
    for name in names:
        _force(stage.path / name)
    _force(stage.path)
    if stage.failed and _would_lose(stage.folder, names):
        stage.folder = stage.folder / STOPPED
    stage.folder.parent.mkdir(parents=True, exist_ok=True)
    if not _renamed(stage):
        with _alone(stage.folder) as is_alone:
            if not is_alone:
                raise BlockingIOError(0, "another command has been writing there for too long")
            _move_all(stage, root, names)
    stage.written += names


def _renamed(stage: Stage) -> bool:
    """Make the stage the output folder by one renaming, if there is no such folder yet."""
    if os.path.lexists(stage.folder):
        return False
    _delivered.append(stage.folder)
    try:
        os.rename(stage.path, stage.folder)
    except OSError as error:
        _delivered.clear()
        if error.errno in (errno.ENOTEMPTY, errno.EEXIST):  # somebody has just made it
            return False
        raise
    with suppress(OSError):
        _force(stage.folder.absolute().parent)
    return True


def _move_all(stage: Stage, root: Path, names: list[str]) -> None:
    """Move files into a folder that exists, with a marker in it meanwhile; put all back after an error."""
    folder, before = stage.folder, _marker(stage.folder)
    _refuse_occupied(folder, names)
    for name in names:
        _keep(folder / name, root / OLD / name)
    unsure = before.files | before.doubtful if before else frozenset()
    Marker(root, frozenset(names), unsure - set(names)).write(root / "marker")
    try:
        _delivered.append(folder)
        os.replace(root / "marker", folder / INCOMPLETE)
        _force(folder)
        for name in names:
            os.replace(stage.path / name, folder / name)
        _settle(folder, unsure - set(names))
    except BaseException:
        if os.path.lexists(root / "marker"):  # nothing has begun
            _delivered.clear()
        elif os.path.lexists(folder / INCOMPLETE):
            _put_back(folder, root, names)
            _settle(folder, unsure)
            _delivered.clear()
        raise


def _keep(path: Path, kept: Path) -> None:
    """Keep a file that will be replaced, under a second name or as a copy."""
    try:
        os.link(path, kept, follow_symlinks=False)
    except FileNotFoundError:
        return
    except OSError:  # a disk without links
        shutil.copy2(path, kept, follow_symlinks=False)


def _put_back(folder: Path, root: Path, names: list[str]) -> None:
    """Give a folder the files back that it had; the new ones go back too, so that a kill in here loses none of them."""
    for name in names:
        if not os.path.lexists(root / NEW / name):
            os.replace(folder / name, root / NEW / name)
        if os.path.lexists(root / OLD / name):
            os.replace(root / OLD / name, folder / name)


def _settle(folder: Path, doubtful: frozenset[str]) -> None:
    """Take the marker away, or leave one of files that are still in doubt: the others are on the disk, together."""
    _force(folder)
    if doubtful:
        Marker(Path(), frozenset(), doubtful).write(folder / f"{INCOMPLETE}.new")
        os.replace(folder / f"{INCOMPLETE}.new", folder / INCOMPLETE)
    else:
        os.unlink(folder / INCOMPLETE)
    with suppress(OSError):
        _force(folder)


def _force(path: Path) -> None:
    """Force a file or a folder to the disk; a disk that cannot do that for folders is left alone."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP):
            raise
    finally:
        os.close(handle)


def _would_lose(folder: Path, names: list[str]) -> bool:
    """Say whether files of these names in a folder are of a run that is not known to have failed."""
    return any(os.path.lexists(folder / name) for name in names) and not _is_failure(folder, names)


def _is_failure(folder: Path, names: list[str]) -> bool:
    """Say whether the summary in a folder that one of these files would replace calls itself a failure."""
    for name in {"summary.json", "diagnosis.json"} & set(names):
        with suppress(UserError, ValueError, RecursionError):
            said = json.loads(read_bytes(folder / name, MOST_OF_AN_ANSWER * 16))
            if isinstance(said, dict) and _says_failure(said):
                return True
    return False


def _says_failure(said: dict[str, object]) -> bool:
    runs = [one for one in said.values() if isinstance(one, dict)]
    return said.get("complete") is False or any(one.get("outcome") == "stopped" for one in runs)


def _shown(path: Path) -> str:
    """Return a path as a user would write it: relative to here if it is inside."""
    here = Path.cwd()
    return printable(str(path.relative_to(here) if path.is_relative_to(here) else path))
