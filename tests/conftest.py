"""What all tests share: machine code is made once, by two processes side by side, not once by each worker."""

from __future__ import annotations

import subprocess
import sys


def pytest_sessionstart(session):
    """Compile what a run uses before workers begin, where there are several (`-n`)."""
    if getattr(session.config.option, "numprocesses", None) and not hasattr(session.config, "workerinput"):
        subprocess.run(
            [sys.executable, "-P", "-m", "subzero", "warm", "--quiet"], capture_output=True, check=False
        )
