"""Every cause of the catalogue, hidden with either sign in a record of the other cable formulation, gets no wrong name.

Verifies: the whole diagnosis. Configuration: the rich manoeuvre (fig6 where a heavy drum has no one truth on it), six
channels at 10 Hz, coloured noise, outliers, gaps, and every parameter drawn from its tolerance. All of it is slow; what
the default tests hide and find is in `test_verdicts` and `test_change_points`, and how often a diagnosis is right is
`docs/diagnosis_world.md`.
"""

import numpy as np
import pytest

import subzero
from benchmarks.diagnosis import draws, manoeuvres, outside
from benchmarks.diagnosis.distance import discriminations, sensitivities
from benchmarks.diagnosis.truth import NoRunError, agreed, noisy, with_true_noise
from subzero.diagnosis import SPECS, Logged, catalogue
from subzero.diagnosis.inference import pose

pytestmark = pytest.mark.slow
SEED = 7
CLEAR = 16.0
IDS = sorted(catalogue(manoeuvres.CHANNELS))
SIGNED = [
    (name, sign)
    for name in IDS
    for sign in (1, -1)
    if any(draws.room(parameter, sign) > 0.0 for parameter in manoeuvres.effects()[name].parameters)
]


def hidden_record(name, sign):
    """Return a record with a cause hidden in it, and the values of that; drawn again where there is no one truth."""
    setting = manoeuvres.nominal("fig6" if name == "drum_inertia" else "rich")
    times = manoeuvres.times(setting)
    for attempt in range(20):
        rng = np.random.default_rng([SEED, IDS.index(name), attempt])
        values = draws.hidden(rng, name, sign)
        true = draws.with_values(setting, {**draws.nuisances(rng), name: values})
        try:
            shown = agreed(true, times, manoeuvres.CHANNELS)
        except NoRunError:
            continue
        return Logged(record=noisy(shown, times, rng), setting=setting, name="rich"), values
    raise NoRunError(name)


@pytest.mark.parametrize(("name", "sign"), SIGNED)
def test_every_effect_is_found_with_both_signs(name, sign):
    """No wrong name, and the right one first where D says that the record can show it."""
    logged, values = hidden_record(name, sign)
    problem = with_true_noise(pose([logged]))
    ((D, _),) = discriminations(problem, sensitivities(problem), {name: values}).values()
    verdict = subzero.diagnose(logged, seed=IDS.index(name), budget="verdict")
    assert {cause.id for cause in verdict.causes} <= {name}, verdict
    if D >= CLEAR:
        assert next(iter(verdict.probabilities)) == name, verdict


def test_a_swell_has_its_history_beside_noise_of_its_own():
    """A slow part of the noise takes none of it: the history is within its band of the truth."""
    case = next(case for case in outside.drawn(75, 60) if case.index == 149)
    made = outside.made(case)
    verdict = subzero.diagnose(made.logged, seed=case.index)
    found, force = verdict.unknown, made.strange.force
    true = np.interp(found.time, force.time, np.array(force.wrench)[:, 0])
    assert (verdict.verdict, found.axis) == ("outside_catalogue", "X"), verdict
    assert np.sqrt(np.mean((found.force - true) ** 2)) < 1.5 * np.sqrt(np.mean(found.band**2))
    assert found.force @ true == pytest.approx(true @ true, rel=0.15)
    speed = verdict.gain.held_out["surge_speed"]
    assert speed.after < 0.9 * speed.before
    level = verdict.misfit[made.logged.name]["surge_speed"].noise_sd
    assert level < 1.4 * SPECS["surge_speed"].noise, "twice the sensor's, with the swell in it"
