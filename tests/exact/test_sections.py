"""Lines of several sections with bodies: closed forms, parity with a uniform cable, steady tow, a turn, messages.

Verifies: a clump and a float on a weightless line, whose halves are straight; that two equal sections are one cable;
that the forces at both ends carry both sections; a tow cable with array, depressor and drogue that is towed steadily
and remains so, with the forces added up by hand; a three-section tow in a turn of 640 m radius (of the kind of Ablow
and Schechter, Ocean Engineering 10, 1983; its numbers were not read in that paper), which converges at second order;
energy; mirror; messages. Tolerance: Newton's method leaves 1e-9; arc corrections change a steady tow by 2e-4.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose

import cable
from cable import Body, Section, SectionedCable
from cable.properties import GRAVITY
from subzero.errors import UserError

NEUTRAL = cable.CableProperties(mass_per_length=0.1, cross_section_area=1e-4)
HEAVY = cable.CableProperties(mass_per_length=0.3, cross_section_area=1e-4, diameter=0.011, compliance=1e-6)
ENDS = [(8.0, 0.0, 0.0), (0.0, 0.0, 0.0)]


def in_the_middle(**body):
    return SectionedCable(sections=[Section(10.0, NEUTRAL)], bodies=[Body(5.0, **body)])


@pytest.mark.long
@pytest.mark.parametrize(("mass", "volume"), [(2.0, 0.0), (0.5, 2e-3)], ids=["clump", "float"])
def test_a_body_on_a_weightless_line_makes_a_triangle(mass, volume):
    """Sides 5, 4, 3: the pull along the chord is 4/3 of half of the weight."""
    weight = (mass - 1000.0 * volume) * GRAVITY
    held = cable.hold(ENDS, 10.0, cable=in_the_middle(mass=mass, volume=volume))
    assert_allclose(
        held.tow_force, [-abs(weight) / 2.0 * 4.0 / 3.0, 0.0, weight / 2.0], atol=1e-8 * abs(weight)
    )
    deepest = held.shape[np.abs(held.shape[:, 2]).argmax()]
    assert_allclose(deepest, [4.0, 0.0, 3.0 * np.sign(weight)], atol=1e-9)


@pytest.mark.long
def test_two_equal_sections_are_one_cable():
    two = SectionedCable(sections=[Section(4.0, HEAVY), Section(6.0, HEAVY)])
    for current in ((0.0, 0.0, 0.0), (0.1, 0.3, 0.0)):
        whole, parts = (cable.hold(ENDS, 10.0, current, cable=line) for line in (HEAVY, two))
        assert_allclose(parts.shape, whole.shape, atol=1e-13)
        assert_allclose(parts.tow_force, whole.tow_force, rtol=1e-12, atol=1e-12)


@pytest.mark.long
def test_forces_at_both_ends_carry_both_sections():
    light = cable.CableProperties(mass_per_length=0.12, cross_section_area=1e-4)
    line = SectionedCable(sections=[Section(7.0, HEAVY), Section(3.0, light)], bodies=[Body(7.0, mass=1.0)])
    held = cable.hold([(8.0, 1.0, 0.0), (0.0, 0.0, 0.5)], 10.0, cable=line)
    weight = 7.0 * HEAVY.weight_in_water + 3.0 * light.weight_in_water + GRAVITY
    assert_allclose(held.tow_force + held.drum_force, [0.0, 0.0, weight], atol=1e-8 * weight)


@pytest.mark.long
def test_energy_of_bodies_is_booked_and_a_mirrored_run_is_mirrored():
    line = in_the_middle(mass=2.0, volume=1e-3, drag_area=0.02, lift_area=0.01)
    forces = []
    for east in (1.0, -1.0):
        start = cable.hold(ENDS, 10.0, (0.0, 0.1 * east, 0.0), cable=line)
        run = cable.pull_out(
            lambda t, east=east: (0.3 * np.sin(t), east * 0.2 * np.sin(2.0 * t), 0.0),
            8.0,
            drum=cable.Brake(),
            start=start,
            scheme=cable.MovingEnd(time_step=0.05),
        )
        assert run.outcome.energy_residual < 1e-3
        forces.append(run.tow_force * (1.0, east, 1.0))
    assert_allclose(forces[1], forces[0], atol=1e-7 * np.abs(forces[0]).max())


TOWED = SectionedCable(
    sections=[Section(200.0, cable.line_type("wire", 0.02)), Section(100.0, cable.line_type("array", 0.08))],
    bodies=[Body(200.0, mass=200.0, drag_area=0.05, lift_area=0.2), Body(300.0, drag_area=0.3)],
)


@pytest.mark.long
def test_a_steady_tow_of_sections_and_bodies_remains_steady():
    run = cable.tow(
        lambda t: (3.0, 0.0, 0.0), 300.0, 60.0, cable=TOWED, scheme=cable.MovingEnd(segment_length=5.0)
    )
    assert_allclose(run.tow_force, np.broadcast_to(run.tow_force[0], run.tow_force.shape), atol=2.0)
    down = 0.5 * 1025.0 * 0.2 * 9.0 + sum(s.length * s.cable.weight_in_water for s in TOWED.sections)
    down += 200.0 * GRAVITY
    shape, wire = run.shapes[0], TOWED.sections[0].cable
    chords = np.diff(shape, axis=0)
    t = chords / np.linalg.norm(chords, axis=1)[:, None]
    across = 3.0 * np.hypot(t[:, 1], t[:, 2])
    on_wire = np.arange(len(t)) < 40
    k = np.where(on_wire, wire.normal_drag, TOWED.sections[1].cable.normal_drag)
    kt = np.where(on_wire, wire.tangential_drag, TOWED.sections[1].cable.tangential_drag)
    along = 3.0 * t[:, 0]  # of its speed: against its direction, which points to the tail
    lift = (5.0 * (k * across + kt * np.abs(along) * -1.0) * along * t[:, 2]).sum()
    assert run.tow_force[0, 2] == pytest.approx(down + lift, rel=0.01)


def three_sections():
    """Tow cable, array and drogue in sea water."""

    def part(length, diameter, mass, across, along):
        made = cable.CableProperties(
            water_density=1025.0,
            mass_per_length=mass,
            cross_section_area=0.25 * np.pi * diameter**2,
            diameter=diameter,
            normal_drag_coefficient=across,
            tangential_drag_coefficient=along,
        )
        return Section(length, made)

    parts = [part(723.0, 0.041, 2.33, 2.0, 0.015), part(273.9, 0.079, 5.07, 1.8, 0.009)]
    return SectionedCable(sections=[*parts, part(30.5, 0.025, 0.58, 1.8, 0.02)])


def turn(t, speed=9.52, radius=640.0, straight=20.0):
    """Return the velocity of a ship at 18.5 knots that goes straight, then into a turn."""
    after = max(t - straight, 0.0)
    eased = after - 10.0 * (1.0 - np.exp(-after / 10.0))  # the rate of turn grows within 10 s
    angle = speed / radius * eased
    return speed * np.cos(angle), speed * np.sin(angle), 0.0


def turned(segment):
    line = three_sections()
    scheme = cable.MovingEnd(segment_length=segment, time_step=segment / 20.0)
    run = cable.tow(turn, line.length, 120.0, cable=line, scheme=scheme)
    assert run.outcome.completed, run.outcome.message
    head = run.shapes[-1][0]
    lengths = line.divided(segment)
    array = run.shapes[-1][int(np.searchsorted(np.cumsum(lengths), 723.0 - 1e-6)) + 1]
    return run.tow_tension[-1], array[2] - head[2], np.linalg.norm(array - head)


@pytest.mark.long
def test_a_tow_cable_with_array_and_drogue_converges_in_a_turn_of_640_m():
    found = np.array([turned(size) for size in (40.0, 20.0, 10.0, 5.0)])
    changes = np.abs(np.diff(found, axis=0)) / found[-1]
    assert (changes[-1] < 2e-3).all(), changes
    assert (changes[-1] < 0.45 * changes[-2]).all(), changes


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cable.line_type("wires", 0.01), "no line type 'wires'.*Did you mean 'wire'"),
        (
            lambda: cable.hold(ENDS, 12.0, cable=in_the_middle(mass=1.0)),
            "length is 12 m.*do not add up to it: 10 = 10",
        ),
        (lambda: cable.tow(lambda t: (1, 0, 0), 9.0, 1.0, cable=in_the_middle()), "length is 9 m"),
        (lambda: SectionedCable(sections=[]), "0 sections; a line has 1 to 16"),
        (lambda: SectionedCable(sections=[Section(3.0, NEUTRAL)], bodies=[Body(4.0)]), "a body is at 4 m"),
        (
            lambda: SectionedCable(
                sections=[Section(3.0, cable.CableProperties(strength=50.0))], bodies=[Body(3.0, mass=20.0)]
            ),
            r"weighs 196.2 N in water, and its section may carry 50 N",
        ),
        (lambda: Section(-1.0, NEUTRAL), "length is -1"),
        (lambda: Section(1.0, NEUTRAL, strumming_factor=9.0), "strumming_factor is 9"),
        (
            lambda: cable.tow(lambda t: (1, 0, 0), 10.0, 1.0, cable=in_the_middle(), scheme="lumped"),
            "does not know a cable of several sections; use 'moving_end'",
        ),
    ],
)
def test_what_makes_no_sense_is_refused(call, words):
    with pytest.raises(UserError, match=words):
        call()


def test_every_line_type_has_ranges_that_hold_its_values_and_sources():
    from cable.sections import _library

    assert set(cable.line_types()) == {"wire", "armoured_umbilical", "fibre_rope", "chain", "array", "faired"}
    for entries in _library().values():
        for entry in entries.values():
            low, high = entry["range"]
            assert low <= entry["value"] <= high
            assert entry["source"]
