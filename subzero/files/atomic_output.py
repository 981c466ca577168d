"""Write files to an output folder such that an interrupted command leaves the previous results untouched.

1. Files are written to a temporary folder on the same disk. It is made before anything is simulated, so that a folder
   that cannot be written is refused at once.
2. When all files are complete they move: a new output folder appears by one renaming; in a folder that exists, files
   of the same name are replaced one at a time, and other files are left alone. An error or an interrupt in between
   moves the old files back.
3. While files are being replaced, `user_file.INCOMPLETE` in the folder lists their names. If the process is killed at
   that moment the list remains, and readers refuse the files in it until a command has written them again.

Only the temporary folder that this very process made is ever removed. A killed process leaves its own behind
(``.subzero-…`` in the output folder or its parent): it is safe to remove by hand, and no command removes it.
"""

from __future__ import annotations

import errno
import json
import os
import shutil
import stat
import threading
import time
from collections.abc import Iterable, Iterator, Set
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from subzero.errors import UserError, printable
from subzero.files.read_file import INCOMPLETE, MOST_OF_AN_ANSWER, interrupted_files, read_bytes

TEMPORARY = ".subzero-"
"""How the names of temporary folders begin."""

STOPPED = "stopped"
"""Folder inside the output folder for a run that could not go on, where it would replace a completed one."""

MOVING_S = 1.0
"""How long to wait for another command that is moving files into the same folder; moving takes milliseconds. [s]"""

DISK_FULL = (errno.ENOSPC, getattr(errno, "EDQUOT", errno.ENOSPC), errno.EFBIG, errno.EROFS, errno.EIO)
"""Errors of a disk that can take no more."""

_temporary: set[Path] = set()
"""Temporary folders of this process that still exist."""
_moving = threading.Lock()
"""Held while files move."""
_delivered: list[Path] = []
"""The folder to which this process has delivered since the last `open_output_folder`, for `state_of_output`."""


@dataclass
class OutputFolder:
    """Where a command writes its files.

    Attributes:
        path: the temporary folder to write to.
        folder: the output folder, as the user named it; after the delivery the one that holds the files.
        written: names of the files that have been delivered.
        failed: the run could not go on or was broken off; it then replaces no good result.
    """

    path: Path
    folder: Path
    written: list[str] = field(default_factory=list)
    failed: bool = False

    def files(self) -> dict[str, Any]:
        """Return the files written, by path, ready for JSON."""
        return {"folder": printable(str(self.folder)), "files": list(self.written)}

    def words(self) -> str:
        """Return the files written, by path, in words."""
        line = f"Wrote {printable(str(self.folder))}{os.sep}: {', '.join(self.written)}"
        if not (self.failed and self.folder.name == STOPPED):
            return line
        return f"{line}\nThe files in {printable(str(self.folder.parent))}{os.sep} were not changed."


@contextmanager
def open_output_folder(folder: Path, names: Iterable[str] = ()) -> Iterator[OutputFolder]:
    """Give a temporary folder to write to; its files appear in `folder` when the block ends without an error.

    Files of the same name are replaced, others are left alone. The files of a failed run (`OutputFolder.failed`) go to
    the folder ``stopped`` inside if they would replace a result that is not known to be a failure itself.

    Args:
        folder: the output folder; it need not exist.
        names: files that will be written, as far as known: folders of these names are refused at once.

    Raises:
        UserError: `folder` cannot be made or written; if it can be known, at once.
    """
    _delivered.clear()
    with ExitStack() as cleanup:
        with friendly_errors(folder):
            _refuse_impossible(folder)
            _refuse_occupied(folder, names)
            root = cleanup.enter_context(_temporary_folder(folder))
        output = OutputFolder(root / "new", folder)
        with friendly_errors(folder, inside=root):
            yield output
        with friendly_errors(folder):
            _deliver(output, root / "old")


def state_of_output() -> str:
    """Return the files left behind by an interrupt that ended a command, in words."""
    if not _delivered:
        return "nothing was written"
    return f"all files were written to {printable(str(_delivered[-1]))}"


def remove_temporary() -> None:
    """Remove the temporary folders of this process, for one that is about to end while its main thread still works."""
    if _moving.acquire(timeout=MOVING_S):  # for good: nothing moves any more
        for root in tuple(_temporary):
            _remove(root)


def _remove(root: Path) -> None:
    """Remove a temporary folder, unless it holds files of the output folder that could not be moved back."""
    if not (any(root.glob("old/*")) and any(root.glob("new/*"))):
        shutil.rmtree(root, ignore_errors=True)
        _temporary.discard(root)


@contextmanager
def friendly_errors(folder: Path, inside: Path | None = None) -> Iterator[None]:
    """Turn an error of the disk into a `UserError`.

    Args:
        folder: the output folder.
        inside: if given, only errors of files in this folder, and of a disk that can take no more.
    """
    try:
        yield
    except OSError as error:
        if inside is not None and not _is_of_disk(error, inside):
            raise
        raise UserError(
            f"The output folder {printable(str(folder))} cannot be written: {error.strerror or error}. "
            "Give another one with --out DIR."
        ) from error


def _is_of_disk(error: OSError, folder: Path) -> bool:
    if isinstance(error.filename, str | os.PathLike):
        return Path(error.filename).is_relative_to(folder)
    return error.errno in DISK_FULL


# Before anything is simulated: a temporary folder that can be written.


def _refuse_impossible(folder: Path) -> None:
    """Raise an error for a path that cannot be a folder."""
    path = folder.absolute()
    try:
        str(path).encode("utf-8")
    except UnicodeEncodeError:
        raise OSError(0, f"{_shown(path)} is no name in UTF-8, as netCDF needs one") from None
    if "\0" in str(path):
        raise OSError(0, f"{_shown(path)} has a null character")
    while not path.exists():
        if path.is_symlink():
            raise FileNotFoundError(0, f"{_shown(path)} is a link to something that is not there")
        path = path.parent
    if not path.is_dir():
        raise NotADirectoryError(0, f"{_shown(path)} is a file, not a folder")


def _refuse_occupied(folder: Path, names: Iterable[str]) -> None:
    """Raise an error for names that belong to something other than a file."""
    for name in names:
        with suppress(FileNotFoundError, NotADirectoryError):
            mode = os.lstat(folder / name).st_mode
            if not stat.S_ISREG(mode) and not stat.S_ISLNK(mode):
                kind = "a folder" if stat.S_ISDIR(mode) else "a device, a pipe or a socket"
                raise FileExistsError(
                    0, f"'{printable(name)}' in it is {kind}, where a file of this name has to go"
                )


@contextmanager
def _temporary_folder(folder: Path) -> Iterator[Path]:
    """Make a temporary folder in the output folder or its parent, which is made if necessary; remove it at the
    end.
    """
    home = folder.absolute()
    home = home if home.is_dir() else home.parent
    parents = [path for path in (home, *home.parents) if not path.exists()]
    root = home / f"{TEMPORARY}{os.getpid()}-{os.urandom(8).hex()}"
    _temporary.add(root)
    try:
        home.mkdir(parents=True, exist_ok=True)
        root.mkdir(mode=0o700)
        for inner in ("new", "old"):
            (root / inner).mkdir()
        yield root
    finally:
        _remove(root)
        for parent in parents:  # made for nothing, if they are empty
            with suppress(OSError):
                parent.rmdir()


# After: the delivery.


def _deliver(output: OutputFolder, old: Path) -> None:
    """Move the files of a temporary folder to their place: all or none."""
    names = sorted(os.listdir(output.path))
    for name in names:
        with open(output.path / name, "r+b") as file:
            os.fsync(file.fileno())
    if output.failed and _replaces_good_result(output.folder, names):
        output.folder = output.folder / STOPPED
    if not _rename_whole(output):
        _replace_each(output, old, names)
    output.written += names


def _rename_whole(output: OutputFolder) -> bool:
    """Make the temporary folder the output folder by one renaming, if there is no such folder yet."""
    if os.path.lexists(output.folder):
        return False
    try:
        _delivered.append(output.folder)
        os.rename(output.path, output.folder)
    except BaseException as error:
        if output.path.exists():  # else an interrupt came after the renaming
            _delivered.clear()
        if isinstance(error, OSError) and error.errno in (errno.ENOTEMPTY, errno.EEXIST):
            return False  # another command has just made it
        raise
    return True


def _replace_each(output: OutputFolder, old: Path, names: list[str]) -> None:
    """Replace files one at a time, with their names listed in the folder meanwhile; move all back after an error."""
    folder, new, made = output.folder, output.path, old.parent / INCOMPLETE
    _refuse_occupied(folder, names)
    _wait_for_others(folder)
    earlier = frozenset(name for name in interrupted_files(folder) if os.path.lexists(folder / name))
    with _moving:
        try:
            _list_incomplete(folder, made, earlier | set(names))
            for name in names:
                if os.path.lexists(folder / name):
                    os.replace(folder / name, old / name)
                os.replace(new / name, folder / name)
            _delivered.append(folder)
            _list_incomplete(folder, made, earlier - set(names))
        except BaseException:
            if any(new.iterdir()) or os.path.lexists(folder / INCOMPLETE):
                _delivered.clear()
                _move_back(folder, old, new, names)
                _list_incomplete(folder, made, earlier)
            raise


def _move_back(folder: Path, old: Path, new: Path, names: list[str]) -> None:
    """Give a folder the files back that it had."""
    for name in names:
        if not os.path.lexists(new / name):
            os.replace(folder / name, new / name)
        if os.path.lexists(old / name):
            os.replace(old / name, folder / name)


def _wait_for_others(folder: Path) -> None:
    """Wait while another command moves files here, for milliseconds; a list that remains is of one that was killed."""
    until = time.monotonic() + MOVING_S
    while os.path.lexists(folder / INCOMPLETE) and time.monotonic() < until:
        time.sleep(0.02)


def _list_incomplete(folder: Path, made: Path, names: Set[str]) -> None:
    """List files as incomplete, no others; the list has no other effect than that readers refuse them."""
    if names:
        words = "These files may be of two runs: a command was killed while it replaced them. Run it again."
        text = json.dumps({"subzero": words, "files": sorted(names)}, indent=1)
        made.write_text(text + "\n", encoding="utf-8")
        os.replace(made, folder / INCOMPLETE)
    else:
        (folder / INCOMPLETE).unlink(missing_ok=True)


def _replaces_good_result(folder: Path, names: list[str]) -> bool:
    """Return whether files of these names in a folder are of a run that is not known to have failed."""
    return any(os.path.lexists(folder / name) for name in names) and not _is_failure(folder, names)


def _is_failure(folder: Path, names: list[str]) -> bool:
    """Return whether the summary in a folder that one of these files would replace calls itself a failure."""
    for name in {"summary.json", "diagnosis.json"} & set(names):
        with suppress(UserError, ValueError, RecursionError):
            found = json.loads(read_bytes(folder / name, MOST_OF_AN_ANSWER * 16))
            if isinstance(found, dict) and _is_marked_failed(found):
                return True
    return False


def _is_marked_failed(found: dict[str, object]) -> bool:
    runs = [value for value in found.values() if isinstance(value, dict)]
    return found.get("complete") is False or any(run.get("outcome") == "stopped" for run in runs)


def _shown(path: Path) -> str:
    """Return a path as a user would write it: relative to here if it is inside."""
    here = Path.cwd()
    return printable(str(path.relative_to(here) if path.is_relative_to(here) else path))
