"""A function that only compiled code calls says so when Python calls it: without a gate to it, the interpreter crashed.

Both before anything called it and behind compiled code that did; asked in a process of its own, which a crash ends.
"""

import subprocess
import sys

CODE = """
import subzero
from subzero.diagnosis import Setting
from subzero.diagnosis.inference import economical, simulator

def ask():
    try:
        simulator._write(*range(5))
    except TypeError as error:
        print(error)

ask()
trial = subzero.load_scenario("fig6")
simulator.simulate_track(economical(Setting(trial=trial, model=subzero.Model.of(trial)), 1.0))
ask()
"""


def test_python_is_told_what_it_may_not_call():
    asked = subprocess.run([sys.executable, "-c", CODE], capture_output=True, text=True, check=False)
    assert asked.returncode == 0, asked.stderr
    before, behind = asked.stdout.splitlines()
    assert before == behind
    assert "_write is for compiled code only" in before
