"""Every public function, called with a value of a wrong kind in the place of each of its arguments.

Verifies: what `subzero` and `cable` export, sweeps, calibration, diagnosis, exports, figures, validity, synthetic records,
the Gymnasium environment, the methods of `Simulator`, the accessor of runs, `Current`.
Configuration: calls that work, of a fraction of a second, each with one argument replaced.
Tolerance: none; a call raises `UserError`, or is listed as legal and succeeds.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

import cable
import subzero
from subzero import diagnosis, sweeps, validity
from subzero.accessor import figures_of
from subzero.calibration.api import read
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.gym_environment import TetheredHeading, TetheredHeadings
from subzero.synthetic.sealed_answer import reveal

ODD = {
    "None": None,
    "True": True,
    "-1": -1,
    "NaN": float("nan"),
    "NaT": np.datetime64("NaT"),
    "400 digits": 10**400,
    "text": "x\0y",
    "bytes": b"x",
    "object": object(),
    "[]": [],
    "[None]": [None],
    "{x: None}": {"x": None},
    "array": np.zeros((2, 2)),
    "no arguments": lambda: None,
    "10**12 numbers": range(10**12),
    "empty dataset": xr.Dataset(),
}
"""Name → a value that hardly any argument can have."""


def ahead(_: float) -> tuple[float, float, float]:
    return (1.0, 0.0, 0.0)


@functools.cache
def calls() -> dict[str, tuple[Callable[..., Any], dict[str, Any]]]:
    """Return name → what is called, and the arguments that it works with."""
    trial = subzero.load_scenario("fig6").with_changes({"run.duration_s": 0.2, "run.rtol": 0.0})
    run, model = subzero.simulate(trial), subzero.Model.of(trial)
    missing, lengths = Path("missing.csv"), {"start.wet_length_m": [1.0]}
    setting = diagnosis.Setting(trial=trial, model=model)
    effect = next(iter(diagnosis.all_effects().values()))
    env, many, sim = TetheredHeading(), TetheredHeadings(2), subzero.Simulator(trial)
    env.reset(), many.reset()
    record = subzero.Record(source="x", time=np.array([0.0, 0.1]), values={"heading": np.zeros(2)})
    logged = Logged(record=record, setting=setting, name="x")
    return {
        "simulate": (subzero.simulate, {"scenario": trial}),
        "simulate_many": (subzero.simulate_many, {"trials": [trial]}),
        "compare": (subzero.compare, {"scenario": trial}),
        "check": (subzero.check, {"scenario": trial}),
        "load_scenario": (subzero.load_scenario, {"name_or_path": "fig6"}),
        "with_changes": (trial.with_changes, {"changes": {}}),
        "Model": (subzero.Model, {name: getattr(model, name) for name in ("vehicle", "cable", "drum")}),
        "Model.of": (subzero.Model.of, {"trial": trial}),
        "Checkpoint": (subzero.Checkpoint, {"folder": "kept"}),
        "open_run": (subzero.open_run, {"path": missing}),
        "read_record": (subzero.read_record, {"path": missing}),
        "read_trials": (subzero.read_trials, {"paths": missing}),
        "diagnose": (subzero.diagnose, {"records": missing}),
        "diagnose_trials": (diagnosis.diagnose_trials, {"records": []}),
        "load_effects": (diagnosis.load_effects, {"path": missing}),
        "catalogue": (diagnosis.catalogue, {"channels": ["heading"]}),
        "all_effects": (diagnosis.all_effects, {}),
        "apply_extended": (diagnosis.apply_extended, {"extended": diagnosis.Extended(), "setting": setting, "effects": {}}),
        "extended_toml": (diagnosis.extended_toml, {"extended": diagnosis.Extended(), "setting": setting}),
        "read_extended": (diagnosis.read_extended, {"path": missing}),
        "unseen": (diagnosis.unseen, {"extended": diagnosis.Extended(), "effects": {}}),
        "with_onset": (diagnosis.with_onset, {"effect": effect, "time": 1.0}),
        "with_free_onset": (diagnosis.with_free_onset, {"effect": effect, "time": 1.0, "end": 2.0}),
        "calibrate": (subzero.calibrate, {"records": missing}),
        "calibration.read": (read, {"records": [logged], "scenario": None, "vehicle": None}),
        "challenge": (subzero.challenge, {"scenario": "fig5"}),
        "reveal": (reveal, {"folder": "x"}),
        "draw": (subzero.draw, {"runs": run}),
        "figures_of": (figures_of, {"run": run, "what": ["motion"]}),
        "plot.channel": (run.subzero.plot.channel, {"name": "heading"}),
        "export": (subzero.export, {"run": run, "path": "run.mat"}),
        "warnings_of": (subzero.warnings_of, {"run": run}),
        "check_run": (validity.check_run, {"run": run, "trial": trial, "model": model}),
        "sweep": (subzero.sweep, {"scenario": trial, "parameters": {"start.wet_length_m": []}}),
        "sweep, more": (
            lambda design, changes, kept, tethered, description: subzero.sweep(
                trial, {"start.wet_length_m": []}, design=design, changes=changes, kept=kept,
                tethered=tethered, description=description,
            ),
            {"design": sweeps.Design(), "changes": {}, "kept": sweeps.Kept(), "tethered": True, "description": ""},
        ),
        "plan_sweep": (subzero.plan_sweep, {"scenario": trial, "parameters": lengths}),
        "values": (lambda values: subzero.plan_sweep(trial, {"run.rtol": values}), {"values": [0.0]}),
        "count": (
            lambda count: subzero.plan_sweep(trial, {"run.rtol": {"from": 0.0, "to": 0.1, "count": count}}),
            {"count": 2},
        ),
        "normal": (lambda normal: subzero.plan_sweep(trial, {"run.rtol": {"normal": normal}}), {"normal": [0.1, 0.01]}),
        "Design": (sweeps.Design, {}),
        "Kept": (lambda **kept: subzero.plan_sweep(trial, lengths, kept=sweeps.Kept(**kept)), {}),
        "Simulator": (subzero.Simulator, {"scenario": trial}),
        "Simulator.step": (sim.step, {"command": (25.0, 0.0, 0.0, 0.0)}),
        "TetheredHeading": (TetheredHeading, {}),
        "TetheredHeading.reset": (env.reset, {}),
        "turn": (lambda turn: env.reset(options={"turn": turn}), {"turn": 0.1}),
        "TetheredHeading.step": (env.step, {"action": np.zeros(1)}),
        "TetheredHeadings": (TetheredHeadings, {"num_envs": 1, "workers": 1}),
        "TetheredHeadings.step": (many.step, {"actions": np.zeros((2, 1))}),
        "pull_out": (cable.pull_out, {"tow_velocity": ahead, "duration": 0.2}),
        "tow": (cable.tow, {"tow_velocity": ahead, "length": 5.0, "duration": 0.2}),
        "hold": (cable.hold, {"ends": ((0, 0, 0), (5, 0, 1)), "length": 8.0}),
        "MovingDrum": (cable.MovingDrum, {"velocity": ahead}),
        "Current": (cable.Current, {"velocity": np.zeros((1, 1, 1, 1, 3))}),
        "Current.uniform": (cable.Current.uniform, {"velocity": (0.1, 0.0, 0.0)}),
        "Current.profile": (cable.Current.profile, {"down": [0.0], "velocity": [[0.1, 0.0, 0.0]]}),
        "Current.sampled": (cable.Current.sampled, {"function": lambda *_: (0.0, 0.0, 0.0)}),
        "Current.at": (cable.Current.uniform((0.1, 0.0, 0.0)).at, {"place": (0.0, 0.0, 0.0)}),
        "Paper": (cable.Paper, {}),
        "MovingEnd": (cable.MovingEnd, {}),
        "CableProperties": (cable.CableProperties, {}),
    }  # fmt: skip


def arguments_of(call, good):
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    named = [name for name, one in inspect.signature(call).parameters.items() if one.kind not in kinds]
    return named or [one.name for one in dataclasses.fields(sweeps.Kept)]


if __name__ == "__main__":
    import collections
    import os
    import signal
    import sys
    import tempfile
    import time
    import warnings

    warnings.simplefilter("ignore")

    class Late(BaseException):
        pass

    def late(*_):
        raise Late

    signal.signal(signal.SIGALRM, late)
    os.chdir(tempfile.mkdtemp())
    n, raw, legal, slow = (
        collections.Counter(),
        collections.defaultdict(list),
        collections.defaultdict(list),
        [],
    )
    for public, (call, good) in calls().items():
        for name in arguments_of(call, good):
            for odd, value in ODD.items():
                t = time.perf_counter()
                signal.alarm(3)
                print(public, name, odd, file=sys.stderr, flush=True)
                try:
                    call(**good | {name: value})
                    n["legal"] += 1
                    legal[f"{public}.{name}"].append(odd)
                except subzero.UserError as e:
                    n["refused"] += 1
                    m = str(e)
                except (Exception, Late) as e:
                    n["raw"] += 1
                    raw[f"{public}.{name}"].append(f"{odd}: {type(e).__name__} {str(e)[:60]}")
                if time.perf_counter() - t > 0.3:
                    slow.append((public, name, odd, round(time.perf_counter() - t, 1)))
    print(n)
    print("RAW")
    [print(k, v) for k, v in raw.items()]
    print("LEGAL")
    [print(k, v) for k, v in legal.items()]
    print("SLOW", slow)
