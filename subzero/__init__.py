"""Simulate, compare and understand a tethered underwater vehicle.

    >>> import subzero
    >>> comparison = subzero.compare("fig6")            # with the cable and without
    >>> comparison.tethered["surge_speed"]              # labelled arrays with units
    >>> comparison.summary()["tethered"]["peak_speed_m_s"]

Names come from their modules when they are first used, so that ``import subzero`` costs nothing:
`simulate` and `compare` run a trial, `simulate_many` many at once, `Checkpoint` keeps where a long run stands,
`Comparison` holds two runs, `load_scenario` reads a trial,
`open_run` reads its file again, and ``run.subzero.plot`` draws it (`subzero.figures.accessor`),
`warnings_of` says what may be wrong with a run, `check` how much it changes with half the steps,
`read_record` a measured record, `read_log` one from a file as its logger wrote it, `draw` makes the figures,
`export` writes a run for other programs,
`Simulator` steps a run for a controller of your own,
`diagnose` says what a simulation gets wrong in measured records, `calibrate` estimates numbers of a vehicle from them,
`read_trials` reads those as `Logged`, `challenge` hides an effect in a record to try that out,
`sweep` runs a trial with many values of its parameters (`plan_sweep` says which without running them),
`autopilot` leads to linear models and controllers, `CHANNELS` is the table of everything that a run gives.
"""

from functools import cache
from importlib import import_module
from typing import Any

_NAMES = {
    "subzero.calibration.api": "calibrate",
    "subzero.channels": "CHANNELS Observation",
    "subzero.diagnosis.api": "diagnose",
    "subzero.diagnosis.hypothesis.logged": "Logged",
    "subzero.diagnosis.read_trials": "read_trials",
    "subzero.errors": "UserError",
    "subzero.figures": "draw",
    "subzero.figures.accessor": "open_run",
    "subzero.logs.api": "read_log",
    "subzero.model": "Model",
    "subzero.records.record": "Record read_record",
    "subzero.results.export": "export",
    "subzero.simulation.checkpoint": "Checkpoint",
    "subzero.simulation.comparison": "Comparison Refinement check compare",
    "subzero.simulation.run": "simulate simulate_many",
    "subzero.simulation.stepper": "RunStoppedError Simulator",
    "subzero.sweeps.api": "sweep",
    "subzero.sweeps.plan": "plan_sweep",
    "subzero.synthetic.challenge": "challenge",
    "subzero.validity": "RunWarning warnings_of",
}
"""Module → its public names."""

_HOME = {name: (module, name) for module, names in _NAMES.items() for name in names.split()}
_HOME["load_scenario"] = ("subzero.model", "load")
"""Public name → (module, name there)."""

_PACKAGES = ("autopilot", "sweeps")
"""Packages inside, fetched as a whole."""

_GIVE_RUNS = ("Comparison", "Simulator", "autopilot", "compare", "open_run", "simulate")
"""Names that lead to runs; with the first of them, datasets get their accessor ``.subzero``."""

__all__ = sorted([*_HOME, *_PACKAGES, "__version__"])


def __getattr__(name: str) -> Any:
    """Fetch a public name from its module, once.

    Raises:
        ImportError: Python finds another package by the name of one of ours.
    """
    if name in __all__ and (why := _foreign_package()):
        raise ImportError(why)
    if name in _GIVE_RUNS:
        import_module("subzero.figures.accessor")
    if name == "__version__":
        from importlib.metadata import version

        from subzero.errors import DISTRIBUTION

        value: Any = version(DISTRIBUTION)
    elif name in _PACKAGES:
        value = import_module(f"subzero.{name}")
    elif name in _HOME:
        module, inner = _HOME[name]
        value = getattr(import_module(module), inner)
    else:
        raise AttributeError(f"module 'subzero' has no attribute '{name}'; it has {', '.join(__all__)}")
    globals()[name] = value
    return value


@cache
def _foreign_package() -> str:
    from subzero.errors import foreign_package

    return foreign_package()


def __dir__() -> list[str]:
    return __all__
