"""How long a command takes from an empty folder of machine code, and how long the next time.

    python -m benchmarks.cold_start [COMMAND…]        (by default: compare fig6)

For each start: time by the clock, and processor time of the command and of the second process that compiles along
(`subzero.jit.beside`). On two idle cores the longer of the two bounds the time by the clock. Needs a POSIX system.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

COMMAND = """
import atexit, json, resource, sys
from subzero.jit import beside

def tell():
    for second in beside._second:
        second.wait()  # its processor time counts once it has ended
    spent = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    with open(told, "w") as file:
        json.dump([one.ru_utime + one.ru_stime for one in spent], file)

told = sys.argv[-1]
atexit.register(tell)
del sys.argv[-1]
from subzero.__main__ import run
run()
"""


def start(words: list[str], here: Path, cache: Path) -> dict[str, float]:
    """Run a command in a folder, and return its times. [s]"""
    reported, began = here / "spent.json", perf_counter()
    subprocess.run(
        [sys.executable, "-c", COMMAND, *words, str(reported)],
        cwd=here,
        env=os.environ | {"SUBZERO_CACHE_DIR": str(cache)},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    command, second = json.loads(reported.read_text())
    return {"by_the_clock": perf_counter() - began, "processor_command": command, "processor_second": second}


def main(words: list[str]) -> None:
    """Start the command cold, then warm, and print the times."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("cold", "warm"):
            here = Path(folder) / name
            here.mkdir()
            spent = start(words or ["compare", "fig6"], here, Path(folder) / "cache")
            print(name, *(f"{what} {seconds:.1f} s" for what, seconds in spent.items()), sep="   ")


if __name__ == "__main__":
    main(sys.argv[1:])
