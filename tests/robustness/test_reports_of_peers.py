"""Public reports of users of other codes, rebuilt with a tether: docs/tether_reports.md lists them with their links.

Verifies: `cable.Tether` and `cable.hold` where others were reported to fail or to be unclear. Configuration: the
numbers of the report where it prints them, else of its kind; what is done stands in each test. Tolerance: in each
test.
"""

import re
from pathlib import Path

import numpy as np
import pytest

import cable

PAGE = Path(__file__).parents[2] / "docs" / "tether_reports.md"
REST = np.zeros(3)
CHAIN = cable.CableProperties(
    water_density=1025.0, mass_per_length=0.75, cross_section_area=4.91e-4, diameter=0.025, compliance=2e-7
)
"""The umbilical of several reports: 25 mm, 0.75 kg/m, EA = 5 MN."""
ROPE = cable.CableProperties(mass_per_length=0.02, compliance=1e-4)
ENDS = np.array([(40.0, 0.0, 40.0), (0.0, 0.0, 0.0)])


def held_still(tether, ends, seconds=5.0, dt=0.1, winch=None):
    """Return the forces over time while the ends rest."""
    return np.array([tether.step(dt, ends, winch) for _ in range(round(seconds / dt))])


def sizes(forces, end=0):
    return np.linalg.norm(forces[:, end], axis=1)


@pytest.mark.parametrize("dt", [0.001, 0.01, 0.1, 1.0])
def test_the_tension_at_rest_does_not_depend_on_dt(dt):
    """MoorDyn 328: with nothing moved, another dt gave another tension. Tolerance: 1e-6, steps are solved to 1e-9."""
    tether = cable.Tether(CHAIN, length=62.0, ends=ENDS)
    start = np.linalg.norm(tether.forces[0])
    forces = held_still(tether, ENDS, seconds=20 * dt, dt=dt)
    assert sizes(forces) == pytest.approx(start, rel=1e-6)


def test_the_start_is_the_catenary():
    """MoorDyn 160, OpenFAST 2274: starts with other tensions than at rest, or with none found. T = w (a + height).

    Tolerance: 1e-3 for 100 segments.
    """
    heavy = cable.CableProperties(
        water_density=1025.0, mass_per_length=10.0, cross_section_area=1e-3, diameter=0.036
    )
    w, a = heavy.weight_in_water, 30.0
    half, low = 20.0, 50.0
    length, sag = 2.0 * a * np.sinh(half / a), a * (np.cosh(half / a) - 1.0)
    ends = [(half, 0.0, low - sag), (-half, 0.0, low - sag)]
    tether = cable.Tether(heavy, length=length, ends=ends, segments=100)
    assert np.linalg.norm(tether.forces, axis=1) == pytest.approx(w * (a + sag), rel=1e-3)
    assert sizes(held_still(tether, ends)) == pytest.approx(w * (a + sag), rel=1e-3)


@pytest.mark.long
def test_three_thousand_cycles_of_save_and_restore():
    """MoorDyn 298: after 2000 of them the process died. MoorDyn 259: there was no call for it, and then NaN."""
    tether = cable.Tether(ROPE, length=20.0, ends=[(17.0, 0.0, 5.0), REST], segments=20)
    tether.step(0.1, [(17.02, 0.0, 5.0), REST])
    state = tether.save()
    first = tether.step(0.1, [(17.05, 0.0, 5.0), REST])
    for _ in range(3000):
        tether.restore(state)
        assert np.array_equal(tether.step(0.1, [(17.05, 0.0, 5.0), REST]), first)


@pytest.mark.parametrize("seconds", [0.2, 1.0, 5.0])
def test_a_step_of_five_metres_of_pay_out_has_no_spike(seconds):
    """OpenFAST 2274: a commanded DeltaL of 5 m showed a big step of the tension, then returned.

    62 m of umbilical hang 40 m down; the force goes over to that of 67 m. It never exceeds that at rest before by more
    than the drag of the cable at the rate of the winch, along (½ρπdC_t u² L) and, for what sags, across 5 m of it.
    """
    tether = cable.Tether(CHAIN, length=62.0, ends=ENDS, winch=cable.Brake())
    before = np.linalg.norm(tether.forces[0])
    rate = 5.0 / seconds
    paid = held_still(tether, ENDS, seconds, 0.1, cable.PayOutRate(rate=rate))
    after = held_still(tether, ENDS, 40.0, 0.1, cable.Brake())
    drag = CHAIN.tangential_drag * rate**2 * 67.0 + CHAIN.normal_drag * min(rate, 5.0) ** 2 * 5.0
    assert tether.length == pytest.approx(67.0, abs=1e-9)
    assert max(sizes(paid).max(), sizes(after).max()) < before + drag
    rest = np.linalg.norm(cable.hold(ENDS, 67.0, cable=CHAIN, segment_length=1.24).tow_force)
    assert sizes(after)[-50:] == pytest.approx(rest, rel=0.02)


@pytest.mark.parametrize("dt", [0.02, 0.1, 0.5])
def test_a_winch_has_one_number_and_the_length_is_its_integral(dt):
    """OpenFAST 2297 and 2393: length and rate had to be given both, and to agree; what a signal 10, 0 means was
    unclear.

    Tolerance: rounding. A ramp of the rate from 0 to 0.4 m/s in 4 s pays out 0.8 m, whatever the steps.
    """
    tether = cable.Tether(
        CHAIN, length=62.0, ends=ENDS, winch=cable.PayOutRate(rate=lambda t: 0.1 * min(t, 4.0))
    )
    held_still(tether, ENDS, 4.0, dt)
    assert tether.length == pytest.approx(62.8, abs=1e-9)
    held_still(tether, ENDS, 2.0, dt, cable.Brake())
    assert tether.length == pytest.approx(62.8, abs=1e-9)


def test_a_small_model_has_no_nan():
    """MoorDyn 169: a model at 1:70 ended in NaN at the start, with any time step. Here: 1.5 m of thin chain."""
    thin = cable.CableProperties(
        mass_per_length=0.07, cross_section_area=1e-5, diameter=0.0036, compliance=1.0 / 1.6e4
    )
    ends = np.array([(1.2, 0.0, 0.2), (0.0, 0.0, 0.7)])
    tether = cable.Tether(thin, length=1.5, ends=ends, segments=40)
    for k in range(1, 201):
        x = ends + np.array([[0.05 * np.sin(6.0 * 0.05 * k), 0.0, 0.0], [0.0, 0.0, 0.0]])
        assert np.isfinite(tether.step(0.05, x)).all()


@pytest.mark.parametrize("way", [30.0, 33.4])
@pytest.mark.parametrize("density", [993.683, 1025.0])
def test_a_nearly_neutral_and_very_stiff_line(way, density):
    """WEC-Sim 1214: 47.34 m, 62 mm, 993.7 kg/m³ in sea water, E = 17.9 GPa: all nodes NaN. Also exactly neutral.

    At rest it holds nothing but its buoyancy. Tolerance: 1 % of a newton.
    """
    A = 0.25 * np.pi * 0.062**2
    line = cable.CableProperties(
        water_density=1025.0,
        mass_per_length=density * A,
        cross_section_area=A,
        diameter=0.062,
        compliance=1.0 / (1.78863e10 * A),
    )
    ends = np.array([(way, 0.0, way), REST])
    tether = cable.Tether(line, length=47.34, ends=ends, segments=39)
    total = held_still(tether, ends, 2.0).sum(axis=1)
    assert total == pytest.approx(np.tile([0.0, 0.0, line.weight_in_water * 47.34], (20, 1)), abs=0.01)


@pytest.mark.parametrize("frequency", [1.0, 10.0, 40.0])
def test_a_vibrating_end(frequency):
    """MoorDyn 29: a connector that vibrates fast. One end shakes across by 2 mm in 20 steps a period.

    It stays finite, pulls at no moment with more than its rest and the inertia and drag of the whole cable.
    """
    tether = cable.Tether(ROPE, length=20.0, ends=[(17.0, 0.0, 5.0), REST])
    w, dt, A = 2.0 * np.pi * frequency, 1.0 / (20.0 * frequency), 0.002
    before = np.linalg.norm(tether.forces[0])
    most = before + ROPE.virtual_mass_per_length * 20.0 * A * w**2 + ROPE.normal_drag * 20.0 * (A * w) ** 2
    for k in range(1, 101):
        y, v = A * (1.0 - np.cos(w * k * dt)), A * w * np.sin(w * k * dt)
        pull = np.linalg.norm(tether.step(dt, [((17.0, y, 5.0), (0.0, v, 0.0)), (REST, REST)])[0])
        assert pull < 1.05 * most


@pytest.mark.parametrize("strain", [1e-4, 1e-2, 0.15])
def test_a_taut_line_starts_with_its_pretension(strain):
    """OpenFAST 2244, MoorPy 45, WEC-Sim 912: can a taut line be simulated, and how is it pre-tensioned? T = EA ε.

    1.3 m of rope of EA = 10 kN, neutral, between ends further apart. Tolerance: rounding and the tolerance of a step.
    """
    rope = cable.CableProperties(compliance=1e-4)
    ends = [(0.5, 0.0, 1.5), (0.5, 0.0, 1.5 + 1.3 * (1.0 + strain))]
    tether = cable.Tether(rope, length=1.3, ends=ends, segments=10)
    assert sizes(held_still(tether, ends, 1.0)) == pytest.approx(1e4 * strain, rel=1e-5)


def test_a_line_lighter_than_water_arches():
    """MoorPy 14: it curved up above the surface, and nobody said so. Here it arches too, and is warned of."""
    light = cable.CableProperties(mass_per_length=0.4, cross_section_area=4.91e-4, diameter=0.025)
    ends = [(20.0, 0.0, 6.0), (0.0, 0.0, 6.0)]
    tether = cable.Tether(light, length=30.0, ends=ends)
    forces = held_still(tether, ends, 2.0)
    assert tether.shape[:, 2].min() < 0.0
    assert forces[-1, :, 2].sum() == pytest.approx(light.weight_in_water * 30.0, rel=1e-6)
    assert cable.hold(ends, 30.0, cable=light).warnings


def test_a_slack_line_pulls_with_nothing_and_snaps_like_a_spring():
    """WEC-Sim 399, OpenFAST 3339, gz-sim 2216: how is slack defined, and are spikes real? v√(M·EA/L) is, within 3 %.

    While slack, once it has been set in motion, it pulls with its drag and inertia only: 2 N, a seventieth of the snap.
    """
    line, mass, speed, dt = cable.CableProperties(compliance=1e-4), 40.0, 0.85, 0.005
    tether = cable.Tether(line, length=12.0, ends=[(11.5, 0.0, 0.0), REST])
    x, v, pull, pulls = 11.5, speed, 0.0, []
    while v > 0.0 and tether.time < 5.0:
        a = -pull / mass
        x += dt * v + 0.5 * dt * dt * a
        pull = -tether.step(dt, [((x, 0.0, 0.0), (v + dt * a, 0.0, 0.0)), (REST, REST)])[0, 0]
        v += 0.5 * dt * (a - pull / mass)
        pulls.append((x, pull))
    assert max(abs(pull) for x, pull in pulls if 11.6 < x < 11.95) < 2.0
    assert max(pull for _, pull in pulls) == pytest.approx(speed * np.sqrt(mass * 1e4 / 12.0), rel=0.03)


def test_a_tension_only_cable_whose_length_changes():
    """MuJoCo 1704, 1212, 885: a cable that pulls, never pushes, and is wound in. A weight of 30 N in water is hoisted.

    At a steady rate the pull is the weight, of load and of cable: within its drag and 2 %.
    """
    tether = cable.Tether(ROPE, length=20.0, ends=[(0.0, 0.0, 19.99), REST], winch=cable.Brake())
    mass, weight, drag, dt = 5.0, 30.0, 20.0, 0.01
    z, v, lowest = 19.99, 0.0, np.inf
    hoist = cable.PayOutRate(rate=lambda t: -0.5 * min(t / 2.0, 1.0))
    for _ in range(1500):
        v += dt * (weight + tether.forces[0, 2] - drag * abs(v) * v) / mass
        z += dt * v
        forces = tether.step(dt, [((0.0, 0.0, z), (0.0, 0.0, v)), (REST, REST)], hoist)
        lowest = min(lowest, tether.tension.min())
    assert lowest >= 0.0
    assert v == pytest.approx(-0.5, abs=0.02)
    assert -forces[0, 2] == pytest.approx(weight + drag * 0.25, rel=0.02)
    assert tether.length < 13.6


@pytest.mark.parametrize("segments", [1, 2, 3, 5, 6, 7, 12, 50, 200])
def test_any_number_of_segments_starts_and_steps(segments):
    """KiteModels 126: six segments failed, while fewer and more worked."""
    ends = [(17.0, 0.0, 5.0), REST]
    tether = cable.Tether(ROPE, length=20.0, ends=ends, segments=segments)
    assert np.isfinite(held_still(tether, ends, 1.0)).all()


def test_a_winch_that_turns_from_the_start_on_starts_without_a_jolt():
    """KiteModels 99: the reel-out speed at the start was not taken into account. Here the cable moves along from t = 0
    on.

    The first end goes away at 0.5 m/s, as fast as the winch gives: no pull of the first second is larger than that
    after 3 s by more than a tenth.
    """
    away = np.array([0.5, 0.0, 0.0])
    tether = cable.Tether(
        ROPE, length=20.0, ends=[((17.0, 0.0, 5.0), away), (REST, REST)], winch=cable.PayOutRate(rate=0.5)
    )
    states = [[((17.0 + 0.05 * k, 0.0, 5.0), away), (REST, REST)] for k in range(1, 31)]
    pulls = sizes(np.array([tether.step(0.1, state) for state in states]))
    assert pulls[:10].max() < 1.1 * pulls[-1]
    assert tether.length == pytest.approx(21.5)


def test_a_winch_stops_where_its_cable_ends():
    """asv_sim 26: stop the winch at set points, least and most. Both are refused in words, and the tether stays."""
    tether = cable.Tether(ROPE, length=20.0, longest=21.0, ends=[(17.0, 0.0, 5.0), REST])
    for rate, word in ((11.0, "longest"), (-201.0, "reel in")):
        with pytest.raises(cable.TetherError, match=word):
            tether.step(0.1, [(17.0, 0.0, 5.0), REST], cable.PayOutRate(rate=rate))
    assert (tether.time, tether.length) == (0.0, pytest.approx(20.0))


def test_two_drones_on_one_tether():
    """mrs_uav_system 14, gz-sim 1039: both ends move, only the pull matters. Mirrored motions give mirrored forces.

    Tolerance: 2 % of the largest force: the first end takes its load a quarter into its segment, the second one half
    into it.
    """
    air = cable.CableProperties(
        water_density=1.2, mass_per_length=0.02, cross_section_area=2e-5, diameter=0.005, compliance=1e-4
    )
    tether = cable.Tether(air, length=11.0, ends=[(5.0, 0.0, -10.0), (-5.0, 0.0, -10.0)], segments=60)
    mirror, largest, gap = np.array([-1.0, 1.0, 1.0]), 0.0, 0.0
    for k in range(1, 101):
        t = 0.05 * k
        place = np.array([5.0 + 0.3 * (1.0 - np.cos(t)), 0.2 * (1.0 - np.cos(t)), -10.0])
        speed = np.array([0.3 * np.sin(t), 0.2 * np.sin(t), 0.0])
        forces = tether.step(0.05, [(place, speed), (mirror * place, mirror * speed)])
        largest, gap = (
            max(largest, np.abs(forces).max()),
            max(gap, np.abs(forces[0] - mirror * forces[1]).max()),
        )
    assert gap < 0.02 * largest


def test_the_other_end_rides_on_a_rover():
    """ArduPilot 28749: "also make the tether on the ground movable". Both ends drive on alike, in still
    air: the force stays that at rest. Tolerance: 5 % for the drag of the air.
    """
    air = cable.CableProperties(
        water_density=1.2, mass_per_length=0.02, cross_section_area=2e-5, diameter=0.005, compliance=1e-4
    )
    ends, drive = np.array([(3.0, 0.0, -8.0), (0.0, 0.0, 0.0)]), np.array([1.0, 0.0, 0.0])
    rest = cable.Tether(air, length=10.0, ends=ends).forces
    states = np.stack([ends, [drive, drive]], axis=1)
    tether = cable.Tether(air, length=10.0, ends=states)
    for k in range(1, 51):
        states[:, 0] = ends + 0.1 * k * drive
        forces = tether.step(0.1, states)
    assert forces == pytest.approx(rest, abs=0.05 * np.abs(rest).max())


def test_a_slung_payload_swings_like_a_pendulum():
    """ArduPilot 27536 and ardupilot_gazebo 87: 0.75 kg on 4 m of rope of 6 mm below a hovering vehicle, in 20 pieces.

    ω² = g/L (1 + m/2M)/(1 + m/3M) for a rope of mass m. Tolerance: 1 % of the period, an amplitude of 0.05 rad and the
    stretch.
    """
    g, mass, length, dt = 9.81, 0.75, 4.0, 0.005
    rope = cable.CableProperties(
        water_density=1.2, mass_per_length=0.026, cross_section_area=2.83e-5, diameter=0.006, compliance=1e-4
    )
    above, x, v = np.array([0.0, 0.0, -10.0]), np.array([0.2, 0.0, -10.0 + np.sqrt(16.0 - 0.04)]), np.zeros(3)
    tether = cable.Tether(rope, length=length - 1e-3, ends=[x, above], segments=20)
    crossings, before = [], x[0]
    while len(crossings) < 4 and tether.time < 15.0:
        a = tether.forces[0] / mass + [0.0, 0.0, g]
        v = v + dt * a
        x = x + dt * v
        tether.step(dt, [(x, v), (above, REST)])
        if before * x[0] < 0.0:
            crossings.append(tether.time - dt * x[0] / (x[0] - before))
        before = x[0]
    share = 0.026 * length / mass
    w = np.sqrt(g / length * (1.0 + share / 2.0) / (1.0 + share / 3.0))
    assert crossings[3] - crossings[1] == pytest.approx(2.0 * np.pi / w, rel=0.01)


def test_a_hundred_segments_at_a_tenth_of_a_second_stay_stable():
    """mbari_wec_gz 14: a chain of links "is tough on the physics engine, hurting performance and causing
    instabilities".

    Steps of 0.1 s, ends that heave by 1 m; the energy balance closes to 5 % and no force exceeds EA times the strain
    that the ends can cause.
    """
    line = cable.CableProperties(mass_per_length=0.1, compliance=1e-5)
    tether = cable.Tether(line, length=60.0, ends=[(50.0, 0.0, 20.0), REST], segments=100)
    for k in range(1, 301):
        z, v = np.sin(0.1 * k), np.cos(0.1 * k)
        forces = tether.step(0.1, [((50.0, 0.0, 20.0), REST), ((0.0, 0.0, z), (0.0, 0.0, v))])
        assert np.linalg.norm(forces, axis=1).max() < 200.0
    assert tether.energy_residual < 0.05


def test_the_page_lists_every_test_of_this_file_and_no_other():
    text = PAGE.read_text(encoding="utf-8")
    source = Path(__file__).read_text(encoding="utf-8")
    named = set(re.findall(r"`(test_\w+)`", text))
    assert named == set(re.findall(r"^def (test_\w+)", source, re.MULTILINE)) - {
        "test_the_page_lists_every_test_of_this_file_and_no_other"
    }
    assert len(re.findall(r"https://github\.com/\S+/(?:issues|pull)/\d+", text)) >= 20
