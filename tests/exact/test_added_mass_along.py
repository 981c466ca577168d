"""Added mass along a cable: closed forms of a line that is pulled along itself, invariance, energy.

Verifies: a straight line that is accelerated along itself, by its tow point or by the water, feels (m + C_at ρA) a and
C_at ρA dJ/dt per length; a run in moving water is that in still water seen from a boat that drifts, but for its first
steps; the energy is booked. Tolerance: the scheme is exact for a constant acceleration.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable

LENGTH, ALONG = 10.0, 0.7
SMOOTH = {"tangential_drag_coefficient": 0.0, "normal_drag_coefficient": 0.0}
LINE = cable.CableProperties(tangential_added_mass_coefficient=ALONG, **SMOOTH)
WATER = LINE.water_density * LINE.cross_section_area


@pytest.mark.long
def test_a_line_that_is_pulled_along_itself_carries_water_with_it():
    run = cable.tow(lambda t: (1.0 + 0.5 * t, 0.0, 0.0), LENGTH, 2.0, cable=LINE)
    pull = (LINE.mass_per_length + ALONG * WATER) * LENGTH * 0.5
    assert_allclose(run.tow_force[2:], np.broadcast_to([-pull, 0.0, 0.0], (len(run.time) - 2, 3)), atol=1e-8)


@pytest.mark.long
def test_water_that_accelerates_along_a_line_pulls_it():
    times = np.linspace(0.0, 2.0, 201)
    flow = cable.Current.sampled(lambda n, e, d, t: (-1.0 - 0.5 * t * t, 0.0, 0.0), time=times)
    run = cable.tow(lambda t: (0.0, 0.0, 0.0), LENGTH, 2.0, cable=LINE, current=flow)
    pull = ALONG * WATER * LENGTH * run.time
    assert_allclose(run.tow_force[2:, 0], -pull[2:], rtol=1e-3)
    assert run.outcome.energy_residual < 3e-3


def pulled(drift):
    """Return a run off a drum on a boat that drifts with the water."""
    line = cable.CableProperties(mass_per_length=0.006, tangential_added_mass_coefficient=ALONG)
    drum = cable.MovingDrum(velocity=lambda t: tuple(drift))
    way = lambda t: np.add(drift, (1.0 + 0.3 * np.sin(t), 0.4 * np.sin(2.0 * t), 0.1))  # noqa: E731
    return cable.pull_out(way, 6.0, cable=line, drum=drum, current=drift, start=3.0)


@pytest.mark.long
def test_a_run_in_moving_water_is_one_in_still_water_seen_from_a_drifting_boat():
    still, moving = pulled(np.zeros(3)), pulled(np.array([0.3, -0.2, 0.1]))
    assert_allclose(moving.tow_force[9:], still.tow_force[9:], atol=1e-5 * np.abs(still.tow_force).max())
    assert still.outcome.energy_residual < 2e-3


@pytest.mark.long
def test_a_line_of_sections_feels_the_same_as_one_cable():
    whole = cable.SectionedCable(sections=[cable.Section(4.0, LINE), cable.Section(6.0, LINE)])
    way = lambda t: (1.0 + 0.4 * t, 0.2 * t, 0.0)  # noqa: E731
    runs = [cable.tow(way, LENGTH, 2.0, cable=line).tow_force[2:] for line in (LINE, whole)]
    assert_allclose(runs[1], runs[0], atol=1e-7 * np.abs(runs[0]).max())


@pytest.mark.parametrize("scheme", ["lumped", "equation7"])
def test_schemes_that_do_not_know_it_say_so(scheme):
    with pytest.raises(ValueError, match="does not know added mass along the cable; use 'moving_end'"):
        cable.pull_out(lambda t: (1.0, 0.0, 0.0), 1.0, cable=LINE, scheme=scheme)
