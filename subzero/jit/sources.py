"""Which source files compiled code is made of, and a digest that changes with any of them.

Machine code freezes whatever its function saw when it was compiled: other functions, and constants of any module that
an import leads to. So the files of a piece of machine code are those that its own module imports, and those that these
import, and so on. Imports are read off the text, too many rather than too few (one inside a function or behind
``TYPE_CHECKING`` counts too), so nothing has to be imported to know them; the tests hold them against Python's own
parser. What is left out: modules outside `PACKAGES`, and a name that somebody puts into a module from outside.
"""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGES = ("cable", "scenarios", "subzero", "vehicle")
"""What is followed. All stand in one folder."""

COMPILER = re.compile(rb"subzero\.jit(?!\.(?:beside|machine_code|sources)\b)")
"""Whoever compiles a function imports this; the files that it leaves out only keep machine code."""

_COMMENT = re.compile(rb"#[^\n]*")
_IMPORT = re.compile(
    rb"^[ \t]*from\s+([.\w]+)\s+import\s*(\([^)]*\)|[^\n]*)"  # from a.b import c as d, e
    rb"|^[ \t]*import\s+([^\n]*)",  # import a.b as c, d.e
    re.MULTILINE,
)


class Tree:
    """The packages in one folder.

    Args:
        root: the folder; by default the one in which this file's package stands.
    """

    def __init__(self, root: Path | None = None) -> None:
        self.root = root or Path(__file__).resolve().parents[2]
        self._texts: dict[Path, tuple[bytes, tuple[int, int]]] = {}
        self._led: dict[Path, frozenset[Path]] = {}
        self._files: dict[str, Path | None] = {}

    def made_of(self, package: str, file: Path | None = None) -> frozenset[Path]:
        """Return the files that the machine code of a package is made of.

        Args:
            package: its name. All files of ``cable`` and ``vehicle`` count, as they hold little else than physics; of
                ``subzero`` those that compile something.
            file: of a module outside these packages, which counts alone.
        """
        if package not in PACKAGES:
            return self._led_to([file] if file else [])
        inside = sorted((self.root / package).rglob("*.py"))
        return self._led_to(
            inside if package != "subzero" else [path for path in inside if COMPILER.search(self._text(path))]
        )

    def _led_to(self, start: Iterable[Path]) -> frozenset[Path]:
        """Return these files and all that their imports lead to."""
        found: set[Path] = set()
        ahead = list(start)
        while ahead:
            path = ahead.pop()
            if path not in found:
                found.add(path)
                if path not in self._led:
                    self._led[path] = frozenset(self._imports(path))
                ahead += self._led[path]
        return frozenset(found)

    def _imports(self, path: Path) -> Iterator[Path]:
        """Give the files that one file imports."""
        for name in _imported(self._text(path), self._package(path)):
            parts = name.split(".")
            if parts[0] not in PACKAGES:
                continue
            files = [self._file(".".join(parts[: k + 1])) for k in range(len(parts))]
            yield from (file for file in files if file)
            if parts == ["subzero"] or (parts[0] == "subzero" and files[1] is None):
                # `subzero` fetches its public names from anywhere, when they are asked for.
                yield from (self.root / "subzero").rglob("*.py")

    def _package(self, path: Path) -> str:
        """Return the package that a file stands in, which its relative imports begin from."""
        return ".".join(path.relative_to(self.root).parent.parts) if path.is_relative_to(self.root) else ""

    def _file(self, name: str) -> Path | None:
        """Return the file of a module, if there is such a module."""
        if name not in self._files:
            path = os.path.join(self.root, *name.split("."))
            found = [
                file for file in (f"{path}.py", os.path.join(path, "__init__.py")) if os.path.isfile(file)
            ]
            self._files[name] = Path(found[0]) if found else None
        return self._files[name]

    def are_as_read(self, files: Iterable[Path]) -> bool:
        """Say whether these files are still what the digest was made of; an edit may come while a program runs."""
        return all(self._texts[path][1] == _stamp(path) for path in files)

    def _text(self, path: Path) -> bytes:
        if path not in self._texts:
            stamp = _stamp(path)
            self._texts[path] = path.read_bytes(), stamp
        return self._texts[path][0]

    def digest(self, files: Iterable[Path], also: str = "") -> str:
        """Return twelve hexadecimal digits that change with the name or the text of any of these files.

        Args:
            files: their order does not matter.
            also: what they depend on besides.
        """
        found = hashlib.sha256(also.encode())
        for path in sorted(files):
            name = path.relative_to(self.root) if path.is_relative_to(self.root) else path
            for part in (str(name).encode("utf-8", "surrogateescape"), self._text(path)):
                found.update(b"%d:" % len(part) + part)
        return found.hexdigest()[:12]


def _stamp(path: Path) -> tuple[int, int]:
    try:
        about = path.stat()
    except OSError:  # it is gone
        return -1, -1
    return about.st_mtime_ns, about.st_size


def _imported(source: bytes, package: str) -> Iterator[str]:
    """Give the dotted names of what a source may import."""
    for found in _IMPORT.finditer(_COMMENT.sub(b"", source).replace(b"\\\n", b" ")):
        origin, names, plain = (part.decode("utf-8", "replace") if part else "" for part in found.groups())
        if plain:
            yield from re.findall(r"[\w.]+", plain)
        else:
            origin = _absolute(origin, package)
            yield from (f"{origin}.{name}" for name in re.findall(r"(\w+|\*)(?:\s+as\s+\w+)?", names))


def _absolute(origin: str, package: str) -> str:
    """Return ``cable.moving_end.state`` for ``.line`` in the package cable; one more dot leads one package up."""
    name = origin.lstrip(".")
    dots = len(origin) - len(name)
    if not dots:
        return origin
    parts = package.split(".")
    return ".".join([*parts[: len(parts) - dots + 1], *([name] if name else [])])
