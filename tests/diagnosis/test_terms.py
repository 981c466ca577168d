"""Terms of any model in the words of a trial: sizes and signs of errors in the data, and deviations of a fit.

Verifies: y = a + b x with the regression of the term and what the fit adds to it, and that its correction is x; a
delay that is positive is late; numbers of a fit are the deviations of the same effects. Truth: arithmetic.
"""

from types import SimpleNamespace

import numpy as np
import pytest

from subzero.diagnosis.verdict import cause_of, data_error, deviations
from subzero.identification.explanation import CLOCK, Entry, Term


def fit(*numbers, terms=()):
    """Return all that is read of a fit: (kind, name, value) of its numbers."""
    entries = [Entry(kind, name, 0.0, 1.0) for kind, name, _ in numbers]
    x = np.array([value for *_, value in numbers])
    return SimpleNamespace(entries=entries, x=x, variance=np.full(x.size, 0.01), terms=terms)


def test_a_regression_and_the_fit_about_it_are_one_error_whose_correction_is_the_true_value():
    term = Term("affine:depth", "", "affine", "depth", factor=8.0, offset=0.2)
    error = data_error(None, fit(("gain", "depth", 0.05), ("offset", "depth", 1.0)), term)
    assert (error.kind, error.channels) == ("affine", ("depth",))
    assert (error.amount, error.scale) == pytest.approx((0.2 + 8.0 * 1.0, 8.0 * 1.05))
    assert error.remedy() == "subtract 8.2, and divide it by 8.4"


def test_a_unit_of_the_table_has_its_name():
    error = data_error(None, fit(), Term("unit:depth", "", "unit", "depth", factor=1.0 / 0.3048))
    assert error.id == "unit:depth=feet"


@pytest.mark.parametrize("delay", [3.0, -3.0])
def test_a_delay_that_is_positive_is_late(delay):
    late = data_error(None, fit(("delay", CLOCK, delay)), Term(f"delay:{CLOCK}", "", "delay", CLOCK))
    assert (late.kind, late.amount, late.amount_sd) == ("late_clock", delay, pytest.approx(0.1))
    assert ("late" if delay > 0.0 else "early") in late.sentence()
    own = data_error(None, fit(("delay", "depth", delay)), Term("delay:depth", "", "delay", "depth"))
    assert (own.id, own.amount) == ("latency:depth", delay)


def test_a_clock_that_is_hardly_late_is_a_cause_of_the_catalogue():
    found = fit(("delay", CLOCK, 0.4))
    term = Term(f"delay:{CLOCK}", "", "delay", CLOCK)
    assert cause_of(found, term) == "clock_offset"
    assert data_error(None, found, term) is None


def test_a_clock_that_runs_fast_makes_a_minute_longer():
    """True time is t (1 − rate), so that the record's minute has 60/(1 − rate) s."""
    error = data_error(None, fit(("rate", CLOCK, 0.05)), Term(f"rate:{CLOCK}", "", "rate", CLOCK))
    assert 60.0 * (1.0 + error.amount) == pytest.approx(60.0 / 0.95)


def test_numbers_of_a_fit_are_deviations_of_the_same_effects(plant):
    problem = plant(duration=6.0).problem
    found = fit(
        ("number", "hull_drag:share", 0.3),
        ("offset", "heading", -2.0),
        ("gain", "depth", 0.02),
        ("delay", CLOCK, 0.4),
        ("delay", "depth", 9.0),
    )
    z = dict(zip([entry.name for entry in problem.entries], deviations(problem, found).tolist(), strict=True))
    assert {name: value for name, value in z.items() if value} == {
        "hull_drag.share": 0.3,
        "sensor_bias:heading.shift": -2.0,
        "sensor_scale:depth.share": 0.02,
        "clock_offset.late": 0.4,
    }
