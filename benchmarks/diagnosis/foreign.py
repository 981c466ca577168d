"""Records in which nothing that can be named is wrong: ``python -m benchmarks.diagnosis.foreign --data FOLDER``.

By the engine for any model, given as the tethered vehicle (`subzero2`):

    bolt     measured logs of another vehicle, imported as a user does    FOLDER/bolt_auv/*.csv
    remus    a REMUS 100 by another simulator, with noise                 FOLDER/pvs_remus100_reference/*.csv
    numbers  `subzero2` with 3 % (one standard deviation) on every number of the vehicle, the cable and the drum, by the
             other formulation of the cable, manoeuvres and noise of the world; in trim, as the nominal vehicle is: the
             centre of buoyancy remains above the centre of gravity (3 % of either's place alone, measured from the
             middle of the hull, would be three tolerances of `cg_offset`, a cause that is rightly named), and the
             cable's weight in water and the propeller's diameter remain

Each name of a cause or of an error in the data is an invention. That something acts which is no cause is none: the
model misses it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from time import process_time
from typing import Any

import cyclopts
import numpy as np

import scenarios
import subzero
from cable import CableProperties, DrumProperties
from subzero import identification
from subzero.diagnosis.api import SEARCH_S
from subzero.diagnosis.hypothesis.catalogue import NOISE
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.logged import Logged
from subzero.diagnosis.read_trials import read_trials
from subzero.diagnosis.vehicle_model import vehicle_model
from subzero.logs.api import import_log, to_csv, trial_of
from subzero.model import Model
from subzero.records.record import Record
from vehicle import from_mapping, to_mapping

from . import world
from .manoeuvres import AFTER, CHANNELS
from .truth import NoRunError, agreed

OFF = 0.03
"""Standard deviation of every number over itself. [-]"""
REMUS = {
    "surge_speed": ("u_m_s", 1.0),
    "heading": ("psi_rad", 180.0 / np.pi),
    "yaw_rate": ("r_rad_s", 180.0 / np.pi),
    "pitch": ("theta_rad", 180.0 / np.pi),
    "roll_angle": ("phi_rad", 180.0 / np.pi),
    "depth": ("z_m", 1.0),
}
"""Channel → its column in the file of the other simulator, and display units per unit there."""
LAST = 30.0
"""What is used of that record. [s]"""
app = cyclopts.App(name="python -m benchmarks.diagnosis.foreign", help_format="plaintext", version_flags=[])


def bolt(file: Path) -> Logged:
    """Return a log with the trial that ``subzero import --trial`` writes for it."""
    record = import_log(file).record
    assert record is not None
    with tempfile.TemporaryDirectory() as folder:
        flown, trial = Path(folder) / "flown.csv", Path(folder) / "trial.toml"
        flown.write_text(to_csv(record), encoding="utf-8")
        trial.write_text(trial_of(record, "flown.csv"), encoding="utf-8")
        (logged,) = read_trials([flown], scenario=trial)
    return logged


def remus(file: Path) -> Logged:
    """Return the record of the other simulator as a trial with its commands: full ahead, rudder and planes 5°."""
    table, rng = np.genfromtxt(file, delimiter=",", names=True), np.random.default_rng(0)
    table = table[table["t_s"] <= LAST]
    values = {
        name: scale * table[column] + (name == "depth") + NOISE[name] * rng.standard_normal(table.size)
        for name, (column, scale) in REMUS.items()
    }
    trial = subzero.load_scenario("fig6")
    angles = np.radians(5.0)
    commands = scenarios.Commands(
        time=np.array([0.0]), values=np.array([[1525.0 / 60.0, angles, angles, angles]])
    )
    trial = replace(trial, duration=LAST, commands=commands, start=replace(trial.start, heading=0.0))
    return Logged(
        record=Record(source="peer", time=table["t_s"], values=values),
        setting=Setting(trial=trial, model=Model.of(trial)),
        name=file.stem,
    )


def numbers(index: int, seed: int) -> Logged:
    """Return a record of a vehicle whose every number is off, with its nominal trial."""
    one = world.drawn(seed, 2 * index + 1)[2 * index]
    for attempt in range(20):
        rng = one.rng(attempt)
        setting, family = world.flown(one, rng), world.FAMILIES[one.family]
        times = np.arange(0.0, setting.trial.duration + 1e-9, family.step)
        true = setting.with_model(**_off(setting.model, rng))
        longer = replace(true, trial=replace(true.trial, duration=true.trial.duration + AFTER))
        try:
            shown = agreed(longer, times, CHANNELS)
        except (NoRunError, subzero.UserError):
            continue
        values = {name: world.seen_by(family, name, x, times, rng) for name, x in shown.items()}
        name = f"{one.flown} {one.family}"
        return Logged(record=Record(source="world", time=times, values=values), setting=setting, name=name)
    message = f"Vehicle {index} has no truth."
    raise NoRunError(message)


def _off(model: Model, rng: np.random.Generator) -> dict[str, Any]:
    """Return vehicle, cable and drum with every number off; the water's density is one, and gravity is known."""

    def off(value: Any) -> Any:
        if isinstance(value, Mapping):
            return {key: value[key] if key == "water" else off(value[key]) for key in value}
        return value * (1.0 + OFF * rng.standard_normal()) if isinstance(value, float) else value

    cable, drum = (
        {name: value for name, value in model.parameters()[part].items() if name != "water_density"}
        for part in ("cable", "drum")
    )
    vehicle = off(to_mapping(model.vehicle))
    cable = off(cable)
    # As buoyant as before: 3 % of the mass or the cross-section alone are three tolerances of `cable_weight`.
    cable["mass_per_length"] = (
        model.cable.mass_per_length * cable["cross_section_area"] / model.cable.cross_section_area
    )
    # 3 % of its diameter alone would be 12 % of the propeller's thrust and 15 % of its torque, which are rightly named.
    vehicle["propeller"]["diameter"] = model.vehicle.propeller.diameter
    vehicle["buoyancy"]["centre_of_buoyancy_x"] = vehicle["rigid_body"]["centre_of_gravity_x"]
    return {
        "vehicle": from_mapping(vehicle),
        "cable": CableProperties(water_density=model.cable.water_density, **cable),
        "drum": DrumProperties(**off(drum)),
    }


def given(data: Path | None, count: int, seed: int) -> Iterator[tuple[str, Any]]:
    """Yield the kind and what makes each record."""
    for kind, folder in (("bolt", "bolt_auv"), ("remus", "pvs_remus100_reference")):
        for file in sorted((data / folder).glob("*.csv")) if data else []:
            yield kind, file
    for index in range(count):
        yield "numbers", (index, seed)


def said(kind_made: tuple[str, Any]) -> tuple[str, str, identification.Verdict | None, float]:
    """Return the kind of a record, its name, the verdict (None if it cannot be used), and the time. [s]"""
    kind, made = kind_made
    try:
        logged = numbers(*made) if kind == "numbers" else {"bolt": bolt, "remus": remus}[kind](made)
    except (subzero.UserError, NoRunError) as error:
        return kind, f"{made}: {error}", None, 0.0
    begun = process_time()
    model, records = vehicle_model([logged])
    verdict = identification.diagnose(records, model, seconds=SEARCH_S)
    return kind, logged.name if kind == "numbers" else Path(made).stem, verdict, process_time() - begun


@app.default
def benchmark(*, data: Path | None = None, count: int = 50, seed: int = 1, workers: int = 2) -> None:
    """Diagnose records in which nothing that can be named is wrong, and print what is named.

    Args:
        data: folder of the logs; none of them if not given.
        count: how many vehicles with every number off.
        seed: of them.
        workers: processes.
    """
    invented = total = 0
    with ProcessPoolExecutor(workers) as pool:
        for kind, name, verdict, seconds in pool.map(said, given(data, count, seed)):
            if verdict is None:
                print(f"  {kind:8} {name}", flush=True)
                continue
            is_invented = any(not each.history for each in verdict.named)
            total, invented = total + 1, invented + is_invented
            names = ", ".join(f"{each.id} {each.probability:.3f}" for each in verdict.named) or "nothing"
            mark = "!" if is_invented else " "
            print(f"{mark} {kind:8} {name:24} {verdict.verdict:14} {names} {seconds:.0f} s", flush=True)
    print(f"{total} records: a cause or an error in the data is named in {invented}")


if __name__ == "__main__":
    app()
