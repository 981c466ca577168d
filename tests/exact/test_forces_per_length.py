"""What a metre of cable weighs, displaces and drags: the constants of Table 1 worked out by hand, and a taut tether
that water passes.

    ½ρdC_n = ½ 1000 0.0025 1.0 = 1.25,   ½ρπdC_t = ½ 1000 π 0.0025 0.01 = 0.03927 N per metre at 1 m/s
"""

from dataclasses import replace

import numpy as np
import pytest

import cable

TABLE_1 = cable.CableProperties()


def test_the_forces_of_a_metre_of_table_1():
    assert TABLE_1.normal_drag == pytest.approx(1.25, rel=1e-12)
    assert TABLE_1.tangential_drag == pytest.approx(0.0392699, rel=1e-6)
    assert TABLE_1.virtual_mass_per_length == pytest.approx(0.0049 + 0.0049, rel=1e-12)
    assert TABLE_1.buoyancy == pytest.approx(0.0049 * 9.81, rel=1e-3)  # g of the place
    assert TABLE_1.weight_in_water == pytest.approx(0.0, abs=1e-9)


def test_a_heavier_cable_sinks_and_a_lighter_one_rises():
    assert replace(TABLE_1, mass_per_length=0.0100).weight_in_water == pytest.approx(0.0051 * 9.81, rel=1e-3)
    assert replace(TABLE_1, mass_per_length=0.0040).weight_in_water == pytest.approx(-0.0009 * 9.81, rel=1e-3)


@pytest.mark.parametrize("speed", [0.5, 1.0])
@pytest.mark.parametrize(
    "along, per_metre, within",
    [(False, 1.25, 5e-3), (True, 0.03927, 1e-3)],  # across, it bows by 3 degrees: sin² is 0.997
)
def test_water_that_passes_a_taut_tether_pulls_its_ends_downstream(along, per_metre, within, speed):
    """Ten metres from north to south, stretched by 1 % at 100 N; both ends together feel the whole drag. The volume
    stays as it is, so a stretched cable is thinner: length times diameter grows with the root of the stretch.
    """
    stretchy = replace(TABLE_1, compliance=1e-4)
    where = 0 if along else 1
    flow = np.eye(3)[where] * speed
    tether = cable.Tether(stretchy, length=10.0, ends=[(10.1, 0.0, 5.0), (0.0, 0.0, 5.0)], current=flow)
    for _ in range(100):
        forces = tether.step(0.1, [(10.1, 0.0, 5.0), (0.0, 0.0, 5.0)])
    total = forces.sum(axis=0)
    assert total[where] == pytest.approx(per_metre * speed**2 * 10.0 * np.sqrt(1.01), rel=within)
    assert np.delete(total, where) == pytest.approx([0.0, 0.0], abs=1e-3 * abs(total[where]) + 1e-6)
