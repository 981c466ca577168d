"""A tether exported as a functional mock-up unit gives the numbers of `cable.Tether`, steps back, and refuses.

Verifies: `subzero export-fmu` and `subzero.fmu`, by FMPy. Configuration: 30 m of the cable of fig6, made heavy and
elastic by parameters, in a current, with one end that swings and a winch that pays out. Tolerance: none, same bits.
The unit runs in a process of its own, as one that a master loads.
"""

import json
import subprocess
import sys

import numpy as np
import pytest

import cable
from subzero.cli.app import FINE, MISTAKE, main

pytest.importorskip("pythonfmu", reason="the extra [fmu] is not installed")
pytest.importorskip("fmpy", reason="FMPy, which checks the unit, is not installed")

START = {
    "first_north": 26.0,
    "first_down": 6.0,
    "cable.mass_per_length": 0.02,
    "cable.compliance": 1e-4,
    "current_east": 0.2,
}
SCRIPT = """
import json, sys, time
from fmpy import extract, fmi2, read_model_description
from fmpy.validation import validate_fmu

path, start, steps, bad = sys.argv[1], *map(json.loads, sys.argv[2:])
about = read_model_description(path)
reference = {variable.name: variable.valueReference for variable in about.modelVariables}
outputs = [variable.name for variable in about.modelVariables if variable.causality == "output"]
began = time.perf_counter()
unit = fmi2.FMU2Slave(
    guid=about.guid, unzipDirectory=extract(path), instanceName="one",
    modelIdentifier=about.coSimulation.modelIdentifier,
)
unit.instantiate()
unit.setupExperiment(startTime=0.0)
unit.enterInitializationMode()

def put(values):
    unit.setReal([reference[name] for name in values], list(values.values()))

def got():
    return unit.getReal([reference[name] for name in outputs])

def go(values, at):
    put(values)
    unit.doStep(0.1 * at, 0.1)
    return got()

put(start)
unit.exitInitializationMode()
seconds = time.perf_counter() - began
first = got()
before = [go(values, k) for k, values in enumerate(steps[:10])]
state = unit.getFMUstate()
after = [go(values, k + 10) for k, values in enumerate(steps[10:])]
unit.setFMUstate(state)
again = [go(values, k + 10) for k, values in enumerate(steps[10:])]
unit.setFMUstate(unit.deSerializeFMUstate(unit.serializeFMUstate(state)))
once_more = [go(values, k + 10) for k, values in enumerate(steps[10:])]
try:
    go(bad, len(steps))
    refused = False
except Exception as error:
    refused = "discard" in str(error) or "error" in str(error)
unit.terminate()
unit.freeInstance()
json.dump({"problems": validate_fmu(path), "outputs": outputs, "first": first, "steps": before + after, "again": again,
           "once_more": once_more, "refused": refused, "seconds": seconds}, sys.stdout)
"""


def state(time):
    """Return place and velocity of the end that swings."""
    s, c = np.sin(0.5 * time), np.cos(0.5 * time)
    return np.array([26.0 + 1.0 - c, 0.5 * s, 6.0]), np.array([0.5 * s, 0.25 * c, 0.0])


def inputs(time):
    place, velocity = state(time)
    names = ("north", "east", "down")
    return (
        {f"first_{axis}": x for axis, x in zip(names, place, strict=True)}
        | {f"first_velocity_{axis}": v for axis, v in zip(names, velocity, strict=True)}
        | {"pay_out_rate": 0.1}
    )


@pytest.fixture
def unit(tmp_path):
    path = tmp_path / "tether.fmu"
    words = [
        "export-fmu",
        "fig6",
        "--length",
        "30",
        "--segments",
        "40",
        "--longest",
        "100",
        "--out",
        str(path),
        "--quiet",
    ]
    assert main(words) == FINE
    return path


@pytest.mark.long
def test_a_unit_gives_the_numbers_of_a_tether(unit):
    times = [0.1 * k for k in range(1, 21)]
    bad = inputs(times[-1]) | {"first_north": 60.0}
    answer = subprocess.run(
        [sys.executable, "-c", SCRIPT, str(unit), *map(json.dumps, (START, [inputs(t) for t in times], bad))],
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(answer.stdout[answer.stdout.index("{") :])
    tether = cable.Tether(
        cable.CableProperties(mass_per_length=0.02, compliance=1e-4),
        length=30.0,
        ends=[(26.0, 0.0, 6.0), (0.0, 0.0, 0.0)],
        winch=cable.PayOutRate(rate=0.0),
        longest=100.0,
        segments=40,
        current=(0.0, 0.2, 0.0),
    )
    place = found["outputs"].index("first_force_north")
    assert found["first"][place : place + 6] == tether.forces.ravel().tolist()
    for k, time in enumerate(times):
        forces = tether.step(0.1, [state(time), (np.zeros(3), np.zeros(3))], cable.PayOutRate(rate=0.1))
        assert found["steps"][k][place : place + 6] == forces.ravel().tolist()
        assert found["steps"][k][found["outputs"].index("length")] == tether.length
    assert found["again"] == found["once_more"] == found["steps"][10:]
    assert found["problems"] == []
    assert found["refused"]


def test_what_cannot_be_exported_is_refused(tmp_path, capsys):
    assert main(["export-fmu", "--length", "30", "--out", str(tmp_path / "tether.zip")]) == MISTAKE
    assert ".fmu" in capsys.readouterr().err
    assert main(["export-fmu", "--length", "-1", "--out", str(tmp_path / "tether.fmu")]) == MISTAKE
    assert "length" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []
