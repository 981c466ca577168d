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

_HOME = {
    "CHANNELS": ("subzero.channels", "CHANNELS"),
    "Checkpoint": ("subzero.simulation.checkpoint", "Checkpoint"),
    "Comparison": ("subzero.simulation.comparison", "Comparison"),
    "Logged": ("subzero.diagnosis.hypothesis.logged", "Logged"),
    "Model": ("subzero.model", "Model"),
    "Observation": ("subzero.channels", "Observation"),
    "Record": ("subzero.records.record", "Record"),
    "Refinement": ("subzero.simulation.comparison", "Refinement"),
    "RunWarning": ("subzero.validity", "RunWarning"),
    "RunStoppedError": ("subzero.simulation.stepper", "RunStoppedError"),
    "Simulator": ("subzero.simulation.stepper", "Simulator"),
    "UserError": ("subzero.errors", "UserError"),
    "calibrate": ("subzero.calibration.api", "calibrate"),
    "challenge": ("subzero.synthetic.challenge", "challenge"),
    "check": ("subzero.simulation.comparison", "check"),
    "compare": ("subzero.simulation.comparison", "compare"),
    "diagnose": ("subzero.diagnosis.api", "diagnose"),
    "draw": ("subzero.figures", "draw"),
    "export": ("subzero.results.export", "export"),
    "load_scenario": ("subzero.model", "load"),
    "open_run": ("subzero.figures.accessor", "open_run"),
    "plan_sweep": ("subzero.sweeps.plan", "plan_sweep"),
    "read_log": ("subzero.logs.api", "read_log"),
    "read_record": ("subzero.records.record", "read_record"),
    "read_trials": ("subzero.diagnosis.read_trials", "read_trials"),
    "simulate": ("subzero.simulation.run", "simulate"),
    "simulate_many": ("subzero.simulation.run", "simulate_many"),
    "sweep": ("subzero.sweeps.api", "sweep"),
    "warnings_of": ("subzero.validity", "warnings_of"),
}
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
