"""An umbilical over a sea bed that it reaches, while its vehicle is deployed.

Verifies: with the bed at 50 m (the vehicle goes to 44.6 m, the cable without a bed to 63.9 m) no node is deeper than
the bed by a diameter, hundreds of results have cable on the bed, the pull changes, and the run takes no more than twice
the iterations of today's. Tolerance: a diameter, 25 mm, as the pages say.
"""

import numpy as np
import pytest

import subzero

BED = 50.0


@pytest.mark.long
def test_an_umbilical_lies_on_the_bed_and_costs_no_more():
    trial = subzero.load_scenario("rov_umbilical")
    free, laid = (subzero.simulate(trial.with_changes({"water.sea_bed_m": bed})) for bed in (80.0, BED))
    depths = [
        run["cable_position"].values[:, :, 2] + run["depth"].values[0] - run["cable_position"].values[0, 0, 2]
        for run in (free, laid)
    ]
    assert np.nanmax(depths[0]) > BED + 10.0
    assert np.nanmax(depths[1]) < BED + 0.025
    assert (np.nanmax(depths[1], axis=1) > BED).sum() > 500
    assert np.abs(free["cable_tension"].values - laid["cable_tension"].values).max() > 1.0
    iterations = [float(run["newton_iterations"].sum()) for run in (free, laid)]
    assert iterations[1] < 2.0 * iterations[0]
    assert not [warning for warning in subzero.warnings_of(laid) if warning.check == "below_sea_bed"]
