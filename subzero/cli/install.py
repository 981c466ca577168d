"""The commands about the installation: ``subzero doctor``, ``warm``, ``completion``; all heavy is imported inside."""

from __future__ import annotations

import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from subzero.cli.output_mode import FINE, PLAIN, STOPPED, OutputMode
from subzero.errors import DISTRIBUTION, printable

if TYPE_CHECKING:
    from subzero.simulation.refinement import Progress

Shell = Literal["bash", "zsh", "fish"]
LIBRARIES = (
    "numpy",
    "scipy",
    "numba",
    "llvmlite",
    "xarray",
    "netCDF4",
    "matplotlib",
    "pydantic",
    "cyclopts",
    "rich",
)
WARM_S = 1.0
"""A run of this length calls all that a longer one does. [s]"""


class Check(NamedTuple):
    """A result compared with an exact one: its name, its error, the error allowed, relatively."""

    name: str
    error: float
    allowed: float

    @property
    def is_fine(self) -> bool:
        """Whether it is as near as it must be."""
        return self.error <= self.allowed


def doctor(*, output_mode: OutputMode = PLAIN) -> int:
    """Report the installed versions, the folder of machine code, and whether this machine reproduces known exact
    numbers.

    Three self-checks take some ten seconds: the straight pull of equation (37), a hanging chain, and the energy balance
    of a run. If one is off, the exit code is 3.

    Args:
        output_mode: the form of the output.
    """
    from subzero.cli.progress import progress_bar

    installed = {name: _version(name) for name in (DISTRIBUTION, *LIBRARIES)}
    extras = dict(_extras())
    with progress_bar("Checking this machine") as progress:
        checks = _checks(progress)
    about = {
        "python": platform.python_version(),
        "machine": f"{platform.system()} {platform.machine()}, {os.cpu_count()} cores",
        "versions": installed,
        "extras_missing": extras,
        "machine_code": _machine_code(),
        "checks": [check._asdict() | {"fine": check.is_fine} for check in checks],
    }
    with output_mode.emit(about):
        _print(about, checks)
    return FINE if all(check.is_fine for check in checks) else STOPPED


def warm(*, output_mode: OutputMode = PLAIN) -> int:
    """Compile what a comparison such as "subzero compare fig6" uses, once, so that later commands start at once.

    Args:
        output_mode: the form of the output.
    """
    import warnings

    from subzero.cli.progress import progress_bar
    from subzero.jit.machine_code import compiled_functions

    began = perf_counter()
    with progress_bar("Warming up") as progress:
        from subzero.figures import draw
        from subzero.model import load
        from subzero.simulation.run import simulate

        trial, runs = replace(load("fig6"), duration=WARM_S), {}
        for share, label in ((0.0, "tethered"), (0.5, "untethered")):
            progress(share)
            runs[label] = simulate(trial, tethered=label == "tethered")
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            draw(runs)["fig6"].canvas.draw()  # matplotlib looks for its fonts
    seconds, kept = perf_counter() - began, _machine_code()
    reported = {"compiled": compiled_functions(), "seconds": round(seconds, 1), **kept}
    with output_mode.emit(reported):
        if compiled_functions():
            print(
                f"Compiled {compiled_functions()} functions in {seconds:.0f} s; they are kept in {kept['folder']}."
            )
        else:
            print(f"All is compiled already, in {kept['folder']} ({kept['files']} files).")
    return FINE


def _version(name: str) -> str:
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(name)
    except PackageNotFoundError:
        return "missing"


def _extras() -> Iterator[tuple[str, list[str]]]:
    """Return each extra of ours that is not installed whole, and the packages that it lacks."""
    import re
    from importlib.metadata import requires

    wanted: dict[str, list[str]] = {}
    for line in requires(DISTRIBUTION) or ():
        found = re.match(r"([\w.-]+).*extra == ['\"]([\w-]+)['\"]", line)
        if found and found[2] not in ("test", "dev") and _version(found[1]) == "missing":
            wanted.setdefault(found[2], []).append(found[1])
    yield from wanted.items()


def _machine_code() -> dict[str, Any]:
    """Return where machine code is kept, how many files of how many MB, and whether more can be."""
    from subzero.jit.machine_code import base_folder

    base = base_folder()
    if base is None:
        return {"folder": "nowhere", "files": 0, "megabytes": 0.0, "writable": False}
    files = [path for path in base.rglob("*.code") if path.is_file()] if base.is_dir() else []
    nearest = next((folder for folder in (base, *base.parents) if folder.is_dir()), Path("/"))
    return {
        "folder": printable(str(base)),
        "files": len(files),
        "megabytes": round(sum(path.stat().st_size for path in files) / 1e6, 1),
        "writable": os.access(nearest, os.W_OK),
    }


# Self-checks.


def _checks(progress: Progress) -> list[Check]:
    """Return all self-checks."""
    checks: tuple[Callable[[], Check], ...] = (_straight_pull, _hanging_chain, _energy)
    done = []
    for at, check in enumerate(checks):
        progress(at / len(checks))
        done.append(check())
    return done


def _straight_pull() -> Check:
    """Hold the tension at the tow point of Fig. 4 to its closed form, equation (37)."""
    from subzero.figures.prescribed import exact_tension
    from subzero.model import load
    from subzero.simulation.run import simulate

    run = simulate(replace(load("fig4"), duration=10.0))
    exact = exact_tension(run)
    error = abs(run["cable_tension"].values - exact).max() / abs(exact).max()
    return Check("straight pull, equation (37)", float(error), 1e-6)


def _hanging_chain() -> Check:
    """Hold a cable at rest between two ends at one depth to the catenary z = a cosh(x/a): its tension at the ends.

    With the span L and the length S, a follows from S = 2 a sinh(L/2a); the tension there is w a cosh(L/2a).
    """
    import numpy as np
    from scipy.optimize import brentq

    import cable

    span, length = 8.0, 10.0
    chain = cable.CableProperties(mass_per_length=0.5, cross_section_area=1e-4)
    weight = chain.weight_in_water
    a = float(brentq(lambda a: 2.0 * a * np.sinh(0.5 * span / a) - length, 1.0, 100.0))
    found = cable.hold(((0.0, 0.0, 0.0), (span, 0.0, 0.0)), length, cable=chain, segment_length=0.05)
    exact = weight * a * np.cosh(0.5 * span / a)
    return Check("hanging chain, catenary", abs(float(np.linalg.norm(found.tow_force)) / exact - 1.0), 1e-3)


def _energy() -> Check:
    """Hold the energy that a coupled run leaves unexplained to none, as a share of the work of the propeller."""
    from subzero.model import load
    from subzero.results.summary import energy_balance
    from subzero.simulation.run import simulate

    balance = energy_balance(simulate(replace(load("fig6"), duration=10.0)))
    share = balance["unexplained_share"] if balance else None
    return Check("energy balance of fig6, share of the work", float("inf") if share is None else share, 1e-2)


def _print(about: dict[str, Any], checks: list[Check]) -> None:
    """Print the findings."""
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    table = Table.grid(padding=(0, 2))
    table.add_column(no_wrap=True)
    code = about["machine_code"]
    kept = f"{code['folder']}, {code['files']} files, {code['megabytes']} MB"
    rows = [
        ("Python", f"{about['python']}, {about['machine']}"),
        ("versions", ", ".join(f"{name} {number}" for name, number in about["versions"].items())),
        ("machine code", kept if code["writable"] else f"{kept}; NOT WRITABLE: set SUBZERO_CACHE_DIR"),
        *(
            (f"extra [{name}]", f"not installed: {', '.join(lacks)}")
            for name, lacks in about["extras_missing"].items()
        ),
        *(
            (check.name, f"error {check.error:.1e}, allowed {check.allowed:.0e}: {_status(check)}")
            for check in checks
        ),
    ]
    for name, words in rows:
        table.add_row(escape(name), escape(words))
    Console(highlight=False).print(table)


def _status(check: Check) -> str:
    return (
        "fine" if check.is_fine else "OFF. Do not trust results of this machine; report it with this output."
    )
