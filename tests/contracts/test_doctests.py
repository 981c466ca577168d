"""The examples in docstrings run, and give what they say."""

import doctest
from importlib import import_module

import pytest

MODULES = (
    "scenarios", "scenarios.checks", "scenarios.instructions", "scenarios.steps", "cable.current", "cable.schemes",
    "subzero.model",
    "subzero.simulation.stepper", "subzero.diagnosis.assessment.trial_library",
)  # fmt: skip


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_docstring_run(name):
    reported = doctest.testmod(import_module(name), optionflags=doctest.ELLIPSIS)
    assert reported.attempted > 1
    assert reported.failed == 0
