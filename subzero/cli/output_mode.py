"""How a command speaks: in tables, as JSON, not at all, or with more about itself."""

from __future__ import annotations

import contextlib
import io
import json
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import Annotated, Any

from cyclopts import Parameter

FINE, MISTAKE, STOPPED = 0, 2, 3
"""Exit codes: all is well; the user has to change something; a run could not go on."""
Flag = Annotated[bool, Parameter(negative=())]

COMMAND: ContextVar[str] = ContextVar("COMMAND", default="")
"""The line of the shell that is being carried out; a page says it, so that its reader can do it again."""


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class OutputMode:
    """The form of a command's output.

    Attributes:
        as_json: print the result as one JSON object, and nothing else, on standard output.
        quiet: print no table and no progress; errors and the exit code remain.
        verbose: print how far to trust the cable too; say on standard error which versions run, where machine code is
            kept, and how long it took.
    """

    as_json: Annotated[bool, Parameter(name="--json", negative=())] = False
    quiet: Annotated[bool, Parameter(name=("--quiet", "-q"), negative=())] = False
    verbose: Annotated[bool, Parameter(name=("--verbose", "-v"), negative=())] = False

    @contextmanager
    def emit(self, result: Mapping[str, Any]) -> Iterator[None]:
        """Print the output of the block; with --json the result instead, with --quiet nothing.

        Args:
            result: plain numbers, texts, lists and mappings.
        """
        if not (self.as_json or self.quiet):
            yield
            return
        with contextlib.redirect_stdout(io.StringIO()):
            yield
        if self.as_json:
            json.dump(result, sys.stdout, indent=2, ensure_ascii=False, allow_nan=False)
            print()


@Parameter(name="*")
@dataclass(frozen=True, kw_only=True)
class StrictOutputMode(OutputMode):
    """How a command that runs trials speaks, and what it makes of warnings.

    Attributes:
        strict: end with exit code 3 if a run ends with warnings.
    """

    strict: Flag = False


PLAIN, NOT_STRICT = OutputMode(), StrictOutputMode()
OUTPUT_MODE: ContextVar[OutputMode] = ContextVar("OUTPUT_MODE", default=PLAIN)
"""That of the command that is carried out."""
