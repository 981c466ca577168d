"""Every public function, called with a value of a wrong kind in the place of each of its arguments.

Verifies: what `subzero` and `cable` export, sweeps, calibration, diagnosis, exports, figures, validity, synthetic
records, the Gymnasium environment, `Simulator`, the accessor of runs, `Current`.
Configuration: calls that work, of a fraction of a second, each with one argument replaced.
Tolerance: none; a call raises `UserError`, or is listed as legal and succeeds.
"""

from __future__ import annotations

import dataclasses
import functools
import inspect
import time
from collections import UserList
from collections.abc import Callable, Iterable, Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pytest
import xarray as xr

import cable
import subzero
from subzero import diagnosis, sweeps, validity
from subzero.arguments import checked_arguments
from subzero.calibration.api import read
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.figures.accessor import figures_of
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
    "path": Path("x\0y"),
    "bytes": b"x",
    "object": object(),
    "[]": [],
    "{}": {},
    "[None]": [None],
    "{x: None}": {"x": None},
    "array": np.zeros((2, 2)),
    "no arguments": lambda: None,
    "10**12 numbers": range(10**12),
    "empty dataset": xr.Dataset(),
}
"""Name → a value that hardly any argument can have."""

LEGAL = {
    "True":
        "simulate.tethered simulate_many.tethered check.tethered plan_sweep.tethered Simulator.tethered "
        "TetheredHeading.tethered Paper.implicit",
    "None":
        "Design.samples Kept.channels Kept.every Kept.function Kept.scalars Model.missing Model.profile "
        "Model.vessel Model.winch Simulator.model Simulator.sample_time Simulator.step.command "
        "TetheredHeading.render_mode TetheredHeading.reset.options TetheredHeading.reset.seed "
        "TetheredHeading.sample_time "
        "TetheredHeadings.workers calibration.read.commands calibration.read.scenario calibration.read.vehicle "
        "check.model check.progress compare.checkpoint compare.every compare.measured compare.model "
        "compare.progress draw.record export.kind extended_toml.effects extended_toml.effects_file hold.cable "
        "hold.current hold.segment_length hold.start load_scenario.commands_csv load_scenario.motion_csv "
        "plan_sweep.changes pull_out.cable pull_out.current pull_out.drum simulate.checkpoint simulate.every "
        "simulate.model simulate.progress simulate_many.every simulate_many.progress simulate_many.workers "
        "tow.cable tow.current pull_out.bed tow.bed hold.bed pull_out.clamps tow.clamps hold.clamps "
        "pull_out.surface tow.surface hold.surface",
    "[]":
        "simulate.later simulate_many.trials compare.later check.later read_trials.paths catalogue.channels "
        "catalogue.more all_effects.more calibration.read.records Kept.scalars Kept.channels",
    "400 digits":
        "simulate_many.workers Design.seed TetheredHeading.reset.seed TetheredHeadings.workers",
    "{}":
        "with_changes.changes catalogue.channels catalogue.more all_effects.more apply_extended.effects "
        "extended_toml.effects unseen.effects plan_sweep.changes TetheredHeading.reset.options "
        "Simulator.step.command",
    "empty dataset":
        "with_changes.changes catalogue.channels catalogue.more all_effects.more apply_extended.effects "
        "extended_toml.effects unseen.effects warnings_of.run plan_sweep.changes TetheredHeading.reset.options "
        "Simulator.step.command",
    "-1":
        "with_onset.time with_free_onset.time with_free_onset.end TetheredHeading.propeller_rps turn.turn "
        "TetheredHeading.step.action Current.at.time pull_out.surface tow.surface hold.surface",
    "{x: None}":
        "TetheredHeading.reset.options",
}  # fmt: skip
"""Odd value → where it is none: function.argument."""


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
        "read_log": (subzero.read_log, {"path": missing, "map": missing}),
        "read_record": (subzero.read_record, {"path": missing}),
        "read_trials": (subzero.read_trials, {"paths": missing}),
        "diagnose": (subzero.diagnose, {"records": missing}),
        "diagnose_trials": (diagnosis.diagnose_trials, {"records": []}),
        "load_effects": (diagnosis.load_effects, {"path": missing}),
        "catalogue": (diagnosis.catalogue, {"channels": ["heading"]}),
        "all_effects": (diagnosis.all_effects, {}),
        "apply_extended": (
            diagnosis.apply_extended, {"extended": diagnosis.Extended(), "setting": setting, "effects": {}},
        ),
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


def arguments_of(call):
    """Return the names of the arguments of a call; those of `Kept`, where it says none."""
    kinds = (inspect.Parameter.VAR_POSITIONAL, inspect.Parameter.VAR_KEYWORD)
    named = [name for name, row in inspect.signature(call).parameters.items() if row.kind not in kinds]
    return named or [field.name for field in dataclasses.fields(sweeps.Kept)]


def places():
    """Give name, call, good arguments and the argument to replace, of every argument of every call."""
    for public, (call, good) in calls().items():
        for name in arguments_of(call):
            yield f"{public}.{name}", call, good, name


@pytest.mark.long
def test_an_odd_value_in_any_place_is_refused_in_words_or_legal(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    legal = {(odd, place) for odd, listed in LEGAL.items() for place in listed.split()}
    wrong, seen = [], 0
    for place, call, good, name in places():
        for odd, value in ODD.items():
            seen += 1
            try:
                call(**good | {name: value})
                wrong += [] if (odd, place) in legal else [f"{place} = {odd}: it is taken"]
            except subzero.UserError as error:
                is_wrong = (odd, place) in legal or not 10 < len(str(error)) < 2000
                wrong += [f"{place} = {odd}: refused, {error}"] if is_wrong else []
            except Exception as error:
                wrong.append(f"{place} = {odd}: {type(error).__name__}: {str(error)[:80]}")
    assert not wrong, "\n".join([f"{len(wrong)} of {seen}", *wrong])
    assert seen > 3000


@pytest.mark.parametrize(
    "call, said",
    [
        (lambda: subzero.simulate("fig6", progress=[]),
         "simulate: progress is []; it must be a function of 1 argument or None."),
        (lambda: subzero.simulate("fig6", progress=lambda: None), "it must be a function of 1 argument or None."),
        (lambda: subzero.simulate("fig6", tethered=1), "simulate: tethered is 1; it must be True or False."),
        (lambda: subzero.simulate("fig6", every=float("nan")), "every is nan; it must be a finite number or None."),
        (lambda: subzero.simulate("fig6", later=[(1.0, 2.0)]), "each a list of 2 (each a finite number or Model))."),
        (lambda: subzero.open_run(np.zeros(2)), "open_run: path is array([0., 0.]); it must be a text or a Path."),
        (lambda: subzero.compare("fig6", measured=3), "measured is 3; it must be a text or a Path or Record or None."),
        (lambda: subzero.draw(5), "draw: runs is 5; it must be a mapping (each Dataset) or Dataset."),
        (lambda: subzero.draw({"tethered": 5}), "draw: runs is {'tethered': 5}; it must be a mapping (each Dataset)"),
        (lambda: subzero.export(xr.Dataset(), "x.mat"), "it must be a run, such as of subzero.simulate."),
        (lambda: subzero.calibrate("x.csv", free=["rudder.lift_slope", 3]), "it must be a list (each a text)."),
        (lambda: subzero.sweep("fig6", {"run.rtol": [0.0]}, out=np.datetime64("NaT")), "sweep: out is "),
        (lambda: TetheredHeading(propeller_rps="fast"), "TetheredHeading: propeller_rps is 'fast'; it must"),
    ],
)  # fmt: skip
def test_the_message_names_function_argument_value_and_what_is_allowed(call, said):
    with pytest.raises(subzero.UserError) as caught:
        call()
    assert said in str(caught.value)


class OwnPath(type(Path())):
    """A path of somebody's own."""


class OwnFloat(float):
    """A number of somebody's own."""


def test_right_values_of_every_kind_are_taken(tmp_path):
    @checked_arguments
    def taken(
        number: float = 0.0,
        count: int = 0,
        flag: bool = True,
        path: str | Path = "",
        names: Sequence[str] = (),
        more: Iterable[str] = (),
        numbers: Sequence[float] | np.ndarray = (),
        values: Mapping[str, float] | None = None,
        progress: Callable[[float], None] | None = None,
    ) -> bool:
        return True

    right = {
        "number": (1, np.float32(1.0), np.int64(1), OwnFloat(1.0), Fraction(1, 3)),
        "count": (3, np.int32(3), np.uint8(3), 10**400),
        "flag": (False, np.bool_(True)),
        "path": ("x", np.str_("x"), OwnPath("x"), tmp_path),
        "names": ((), [], ["x"], ("x",), np.array(["x"]), UserList(["x"])),
        "more": ({"x"}, {"x": 1}.keys(), (name for name in "xy"), ["x"]),
        "numbers": ([1, 2.0], (np.float32(1.0),), np.zeros((2, 2)), range(3)),
        "values": ({}, {"x": 1}, MappingProxyType({"x": np.float64(1.0)}), None),
        "progress": (print, lambda _: None, lambda *_: None, functools.partial(print, "x"), [].append, None),
    }
    for name, values in right.items():
        for value in values:
            assert taken(**{name: value})


def test_arguments_are_looked_at_in_microseconds():
    started = time.perf_counter()
    for _ in range(1000):
        cable.Current.uniform((0.1, 0.0, 0.0))
    assert time.perf_counter() - started < 1.0
