"""A run that books no energies is the same run: what the ledger fills is read by nothing in the loop.

Configuration: 4 s of fig6, with forces that depend on the wet length. Tolerance: none, bit for bit. The runs of the
engine are asked for what no face of it offers, a run in the steps of a diagnosis with its energies.
"""

import numpy as np

from subzero.diagnosis.inference import simulate_track, simulator
from subzero.external_force import MissingForce, Term

from .conftest import nominal


def test_a_run_without_its_energies_is_the_same_run(monkeypatch):
    force = MissingForce(terms=(Term("X", "wet_length*u2", -0.02), Term("N", "time*u2", 0.01)))
    setting = nominal(4.0).with_model(missing=force)
    without, eased = simulate_track(setting)[1], simulator._ease

    def ease(setup):
        eased(setup)
        assert not setup.fixed.booked
        setup.fixed.booked = True

    monkeypatch.setattr(simulator, "_ease", ease)
    assert np.array_equal(simulate_track(setting)[1], without)
