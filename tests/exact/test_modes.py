"""Natural modes of a cable: closed forms of strings, chains, catenaries, rods and beams, and a free vibration in time.

Verifies: `Equilibrium.modes` and `Tether.modes`. Configuration: a taut string, with a body, of two sections, stiff, on
a bed, in a current; a hanging chain (zeros of J₀); Irvine's shallow catenary; stretch waves. Tolerance: frequencies of
the n-th of N segments are (nπ/N)²/12 too high, which the tests of order confirm; a run in time agrees within 0.5 %.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import brentq
from scipy.special import jn_zeros

import cable
from cable.modes import find_modes
from cable.task import current_of
from subzero.errors import UserError

STRING = cable.CableProperties(mass_per_length=0.1, cross_section_area=2e-5, compliance=1e-7)
LENGTH, TENSION, SEGMENTS = 8.0, 50.0, 80
FINE = (np.pi / SEGMENTS) ** 2 / 12.0
"""Relative error of the first mode of a string."""


def taut(line, segments=SEGMENTS, current=(0.0, 0.0, 0.0), **others):
    """A straight line along north at a tension, laid by hand."""
    lengths = np.full(segments, LENGTH / segments)
    arc = np.concatenate([[0.0], np.cumsum(lengths)])
    pull = np.array([TENSION, 0.0, 0.0])
    return cable.Equilibrium(
        cable=line,
        current=current_of(current),
        length=LENGTH,
        shape=np.outer(arc * (1.0 + line.compliance * TENSION), [1.0, 0.0, 0.0]),
        tensions=np.full(segments + 1, TENSION),
        tow_force=pull,
        drum_force=-pull,
        segment_lengths=lengths,
        segment_tensions=np.full(segments, TENSION),
        steps=0,
        **others,
    )


def string_omega(n, m1=STRING.virtual_mass_per_length):
    return n * np.pi / LENGTH * np.sqrt(TENSION / m1)


def omegas(modes, direction):
    """Angular frequencies of the modes that move most in a direction, 0 north, 1 east, 2 down."""
    there = np.abs(modes.shapes).max(axis=1).argmax(axis=1) == direction
    return 2.0 * np.pi * modes.frequencies[there]


def orders(errors):
    return np.log2(np.array(errors)[:-1] / np.array(errors)[1:])


def test_a_taut_string_has_its_harmonics_at_second_order():
    exact = string_omega(np.repeat([1, 2, 3], 2))
    errors = [2.0 * np.pi * taut(STRING, n).modes(6).frequencies / exact - 1.0 for n in (20, 40, 80)]
    assert_allclose(errors[-1], np.repeat([1, 4, 9], 2) * FINE, rtol=0.02)
    assert_allclose(orders(errors), 2.0, atol=0.05)


def test_a_string_that_is_stretched_by_half_is_that_much_longer():
    soft = cable.CableProperties(mass_per_length=0.1, cross_section_area=2e-5, compliance=0.5 / TENSION)
    exact = string_omega(np.array([1, 2])) / np.sqrt(1.5)
    assert_allclose(omegas(taut(soft).modes(40), 1)[:2], exact, rtol=4.5 * FINE)


def test_a_hanging_chain_has_the_zeros_of_bessel():
    chain = cable.CableProperties(mass_per_length=0.2, cross_section_area=1e-5)
    rate = np.sqrt(chain.weight_in_water / chain.virtual_mass_per_length / LENGTH)
    exact, errors = 0.5 * jn_zeros(0, 3) * rate, []
    for segments in (20, 40, 80):
        tether = cable.Tether(chain, ends=[(0.0, 0.0, 0.0)], length=LENGTH, segments=segments)
        errors.append(2.0 * np.pi * tether.modes().frequencies[::2] / exact - 1.0)
    assert np.abs(errors[-1]).max() < 3e-3
    assert_allclose(orders(errors), 2.0, atol=0.15)


@pytest.mark.parametrize("stiffness", [200.0, 2000.0, 20000.0])
def test_a_shallow_catenary_is_that_of_irvine(stiffness):
    """λ² = (wL/H)² EA L/(H L_e): the first symmetric mode in the plane passes the second one out of it."""
    weight = 0.1
    H = STRING.weight_in_water * LENGTH / weight
    sagging = cable.CableProperties(
        mass_per_length=0.1, cross_section_area=2e-5, compliance=1.0 / (stiffness * H)
    )
    stretched = LENGTH * (1.0 + weight**2 / 8.0)
    square = weight**2 * stiffness * LENGTH / stretched
    arc = LENGTH * (1.0 + weight**2 / 24.0)
    modes = cable.hold(
        [(LENGTH, 0.0, 0.0), (0.0, 0.0, 0.0)], arc / (1.0 + 1.0 / stiffness), cable=sagging
    ).modes(5)
    rate = np.sqrt(H / sagging.virtual_mass_per_length) / LENGTH
    within = sorted(
        [2.0 * np.pi, 2.0 * brentq(lambda x: np.sin(x) - np.cos(x) * (x - 4.0 * x**3 / square), 0.1, 4.5)]
    )
    assert_allclose(omegas(modes, 1)[:2] / rate, [np.pi, 2.0 * np.pi], rtol=5e-3)
    assert_allclose(omegas(modes, 2)[:2] / rate, within, rtol=5e-3)


@pytest.mark.parametrize("free_end", [False, True])
def test_stretch_waves_carry_no_added_mass(free_end):
    soft = cable.CableProperties(mass_per_length=0.1, cross_section_area=2e-5, compliance=0.5 / TENSION)
    modes = find_modes(taut(soft), 40, free_end=free_end)
    count = (np.arange(3) + (0.5 if free_end else 1.0)) * np.pi / LENGTH
    exact = count / np.sqrt(soft.mass_per_length * soft.compliance)
    assert_allclose(omegas(modes, 0)[:3], exact, rtol=9.5 * FINE)
    first = np.flatnonzero(np.abs(modes.shapes).max(axis=1).argmax(axis=1) == 0)[0]
    amplitude = count[0] * LENGTH / LENGTH / soft.compliance  # EA du/ds of sin(ks)
    assert_allclose(np.abs(modes.segment_tensions[first]).max(), amplitude, rtol=2e-3)


def test_a_cable_that_does_not_stretch_is_the_limit_of_one_that_does():
    shapes = []
    for compliance in (0.0, 1e-9):
        heavy = cable.CableProperties(mass_per_length=0.02, compliance=compliance)
        shapes.append(cable.hold([(9.0, 0.0, 0.0), (0.0, 0.0, 0.0)], 10.0, cable=heavy).modes().frequencies)
    assert_allclose(shapes[0], shapes[1], rtol=1e-6)


def test_bending_stiffness_raises_the_harmonics_of_a_hinged_string():
    stiff = cable.CableProperties(
        mass_per_length=0.1, cross_section_area=2e-5, compliance=1e-7, bending_stiffness=20.0
    )
    n = np.repeat([1, 2, 3], 2)
    raised = np.sqrt(1.0 + (n * np.pi / LENGTH) ** 2 * 20.0 / TENSION)
    assert_allclose(2.0 * np.pi * taut(stiff).modes(6).frequencies, string_omega(n) * raised, rtol=9.5 * FINE)


def test_clamped_ends_hold_a_stiff_string_at_second_order():
    """1 − cosh(aL) cos(bL) + (a² − b²)/(2ab) sinh(aL) sin(bL) = 0, a² − b² = T/EI, ab = ω √(m/EI)."""
    EI = 20.0
    stiff = cable.CableProperties(
        mass_per_length=0.1, cross_section_area=2e-5, compliance=1e-7, bending_stiffness=EI
    )

    def zero(w):
        half, ab = 0.5 * TENSION / EI, w * np.sqrt(stiff.virtual_mass_per_length / EI)
        a, b = np.sqrt(np.hypot(half, ab) + half), np.sqrt(np.hypot(half, ab) - half)
        return (
            1.0 / np.cosh(a * LENGTH)
            - np.cos(b * LENGTH)
            + half / ab * np.tanh(a * LENGTH) * np.sin(b * LENGTH)
        )

    hinged = string_omega(1) * np.sqrt(1.0 + (np.pi / LENGTH) ** 2 * EI / TENSION)
    exact = brentq(zero, 1.01 * hinged, 2.0 * hinged)
    both = cable.Clamps(first=(1.0, 0.0, 0.0), second=(-1.0, 0.0, 0.0))
    found = [taut(stiff, n, clamps=both).modes(1).frequencies[0] * 2.0 * np.pi for n in (20, 40, 80)]
    errors = np.abs(np.array(found) / exact - 1.0)
    assert (orders(errors) > 1.8).all()
    assert errors[-1] < 2e-3
    one = taut(stiff, clamps=cable.Clamps(first=(1.0, 0.0, 0.0))).modes(1).frequencies[0] * 2.0 * np.pi
    assert hinged < one < found[-1]


def test_a_body_in_the_middle_lowers_the_odd_harmonics():
    """The wave number solves k tan(kL/2) = 2 m1/M; the even modes have a node there."""
    body = cable.Body(0.5 * LENGTH, mass=0.7, volume=4e-4)
    M = body.mass + 0.5 * 1000.0 * body.volume
    line = cable.SectionedCable(sections=[cable.Section(LENGTH, STRING)], bodies=[body])
    m1 = STRING.virtual_mass_per_length
    k = brentq(lambda k: k * np.tan(0.5 * k * LENGTH) - 2.0 * m1 / M, 1e-3, 0.999 * np.pi / LENGTH)
    exact = np.repeat([k * np.sqrt(TENSION / m1), string_omega(2)], 2)
    assert_allclose(2.0 * np.pi * taut(line).modes(4).frequencies, exact, rtol=4.5 * FINE)


def test_two_sections_vibrate_as_one_string_of_two_speeds():
    """√m_a cot(k_a L_a) + √m_b cot(k_b L_b) = 0."""
    thick = cable.CableProperties(mass_per_length=0.4, cross_section_area=8e-5, compliance=1e-7)
    line = cable.SectionedCable(sections=[cable.Section(3.0, STRING), cable.Section(5.0, thick)])
    a, b = np.sqrt(STRING.virtual_mass_per_length), np.sqrt(thick.virtual_mass_per_length)

    def sides(w):
        x, y = w * 3.0 * a / np.sqrt(TENSION), w * 5.0 * b / np.sqrt(TENSION)
        return a * np.cos(x) * np.sin(y) + b * np.cos(y) * np.sin(x)

    exact = brentq(sides, 0.3 * string_omega(1), string_omega(1))
    assert_allclose(2.0 * np.pi * taut(line).modes(2).frequencies, exact, rtol=3.0 * FINE)


def test_a_bed_is_a_foundation_below_a_string():
    bed = cable.SeaBed(depth=-0.01, modulus=1e5, damping_ratio=0.3, lateral_friction=0.0, axial_friction=0.0)
    modes = taut(STRING, bed=bed).modes(40)
    k, m1 = bed.modulus * STRING.diameter, STRING.virtual_mass_per_length
    exact = np.sqrt(string_omega(np.array([1, 2])) ** 2 + k / m1)
    down = omegas(modes, 2)[:2]
    assert_allclose(down, exact, rtol=1e-3)
    assert_allclose(omegas(modes, 1)[0], string_omega(1), rtol=1.5 * FINE)
    first = np.flatnonzero(np.isclose(2.0 * np.pi * modes.frequencies, down[0]))[0]
    assert_allclose(modes.damping_ratios[first], 0.3 * np.sqrt(k / m1) / down[0], rtol=2e-3)


def test_friction_that_sticks_is_a_spring_along_the_bed():
    bed = cable.SeaBed(depth=-0.01, modulus=1e4, slip=0.2, lateral_friction=0.5, axial_friction=0.0)
    pressure = bed.modulus * STRING.diameter * (0.01 - STRING.diameter / 8.0)
    stuck = pressure * 0.5 / (0.2 * STRING.diameter) / STRING.virtual_mass_per_length
    across = omegas(taut(STRING, bed=bed).modes(40), 1)
    assert_allclose(across[0], np.sqrt(string_omega(1) ** 2 + stuck), rtol=1e-3)


def test_a_current_damps_a_string_along_itself_and_across():
    m1, speed = STRING.virtual_mass_per_length, 0.4
    ratios = taut(STRING, current=(0.0, speed, 0.0)).modes(2).damping_ratios
    # Both modes have one frequency, and so mix: their sum is fixed.
    exact = STRING.normal_drag * speed / (2.0 * m1 * string_omega(1)) * (2.0 + 1.0)
    assert ratios.sum() == pytest.approx(exact, rel=2.0 * FINE)


def test_a_drogue_in_the_middle_damps_the_first_mode():
    speed, drag = 0.4, 0.5 * 1000.0 * 0.01
    line = cable.SectionedCable(
        sections=[cable.Section(LENGTH, STRING)], bodies=[cable.Body(0.5 * LENGTH, drag_area=0.01)]
    )
    ratios = taut(line, current=(0.0, speed, 0.0)).modes(2).damping_ratios
    across = speed * (STRING.normal_drag * 0.5 * LENGTH + drag)
    inertia = STRING.virtual_mass_per_length * 0.5 * LENGTH
    exact = across * (2.0 + 1.0) / (2.0 * string_omega(1) * inertia)
    assert ratios.sum() == pytest.approx(exact, rel=3.0 * FINE)


def test_a_flow_along_the_cable_damps_stretch_waves():
    soft = cable.CableProperties(mass_per_length=0.1, cross_section_area=2e-5, compliance=0.5 / TENSION)
    modes = taut(soft, current=(1.5, 0.0, 0.0)).modes(40)
    first = np.flatnonzero(np.abs(modes.shapes).max(axis=1).argmax(axis=1) == 0)[0]
    rate = 2.0 * soft.tangential_drag * 1.5 * np.sqrt(1.5) / soft.mass_per_length
    assert_allclose(modes.damping_ratios[first], rate / (4.0 * np.pi * modes.frequencies[first]), rtol=1e-9)


def test_internal_damping_is_that_of_a_rod():
    """ζ = ω B/(2 EA) of stretch waves; none of the first waves across."""
    rope = cable.CableProperties(
        mass_per_length=0.1, cross_section_area=2e-5, compliance=0.01, internal_damping=0.2
    )
    modes = taut(rope).modes(40)
    first = np.flatnonzero(np.abs(modes.shapes).max(axis=1).argmax(axis=1) == 0)[0]
    assert_allclose(modes.damping_ratios[first], np.pi * modes.frequencies[first] * 0.2 * 0.01, rtol=1e-9)
    assert modes.damping_ratios[0] < 1e-12


@pytest.mark.parametrize("axis", [1, 2], ids=["out of the plane", "in the plane"])
def test_a_free_vibration_in_time_has_the_period_of_its_mode(axis):
    """One end is nudged for a period, then held; the force there crosses its mean once up in each period."""
    line = cable.CableProperties(
        mass_per_length=0.05, cross_section_area=1e-5, diameter=0.004, compliance=1e-5
    )
    ends = np.array([(10.0, 0.0, 0.0), (0.0, 0.0, 0.0)])
    tether = cable.Tether(line, ends=ends, length=11.0, segments=30, rtol=0.0)
    frequency = omegas(tether.modes(3), axis)[0] / (2.0 * np.pi)
    step, force = 1.0 / (200.0 * frequency), []
    for k in range(1, 1601):
        states = np.stack([ends, np.zeros((2, 3))], axis=1)
        turn = np.pi * min(k / 200.0, 1.0)
        states[0, :, axis] += 2e-4 * np.array([np.sin(turn) ** 2, np.pi * frequency * np.sin(2.0 * turn)])
        force.append(tether.step(step, states)[0, axis])
    wave = np.array(force[300:]) - np.mean(force[300:])
    up = np.flatnonzero((wave[:-1] < 0.0) & (wave[1:] >= 0.0))
    crossings = up - wave[up] / (wave[up + 1] - wave[up])
    assert len(up) in (6, 7)
    assert 1.0 / (np.diff(crossings).mean() * step) == pytest.approx(frequency, rel=5e-3)


def test_modes_are_labelled_and_drawn():
    modes = taut(STRING, 10).modes(8)
    data = modes.to_dataset()
    assert all("long_name" in data[name].attrs for name in data.variables if name != "earth_axis")
    assert_allclose(np.linalg.norm(data["shape"], axis=2).max(axis=1), 1.0)
    assert len(modes.plot().axes) == 6
    assert "damping 0 % of critical" in repr(modes)
    assert (
        taut(cable.CableProperties(), 5).modes(100).frequencies.size == 8
    )  # 3 · 4 ways less 4 along the cable


def test_what_has_no_modes_is_refused():
    ends = [(9.0, 0.0, 0.0), (0.0, 0.0, 0.0)]
    with pytest.raises(UserError, match="100 % of the cable is slack"):
        cable.hold(ends, 10.0).modes()
    with pytest.raises(UserError, match="nothing brings the cable back to its shape"):
        cable.Tether(ends=ends).modes()
    with pytest.raises(UserError, match="part of the cable is at the free surface"):
        taut(STRING, surface=0.0).modes()
    assert taut(STRING, surface=-1.0).modes(1).frequencies.size == 1
    with pytest.raises(UserError, match="2000 segments; at most 1000"):
        taut(STRING, 2000).modes()
    with pytest.raises(UserError, match="count is 0; it must be a whole number of at least 1"):
        taut(STRING).modes(0)
