"""`cable.hold`: a cable at rest between two ends, from any start, and as the start of a run.

Verifies: catenary and elastic catenary in closed form, either way up; a taut and an upright one; a cable across a
current against the differential equations solved by another method (scipy's collocation); that the forces at the
ends carry weight and drag; symmetry; that any shape will do as a start; that a run that begins so stays at rest.
Tolerance: a polygon of 100 segments is of second order, 1e-4 of the forces and of the length; a run that begins at
rest moves by what Newton's method leaves, 1e-7.
"""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp
from scipy.optimize import brentq

import cable
from benchmarks.validation import catenary as elastic
from subzero.errors import UserError

ENDS = ((9.0, 0.0, 0.0), (0.0, 0.0, 0.0))
LENGTH = 10.0
STILL = (0.0, 0.0, 0.0)
ABOVE_BELOW = cable.Current.profile(
    down=[-5.0, 0.0, 10.0], velocity=[[0.0, 0.4, 0.0], [0.2, 0.3, 0.0], [0.1, 0.0, 0.0]]
)


def made(mass_per_length, **values):
    return cable.CableProperties(mass_per_length=mass_per_length, **values)


def parameter(span, length):
    """Return a of the catenary, length = 2a sinh(span/2a). [m]"""
    return brentq(lambda a: 2.0 * a * np.sinh(span / (2.0 * a)) - length, span / 50.0, 50.0 * span)


def catenary(span, length, x):
    """Return how far below its ends a heavy cable hangs at distances x from one of them. [m]"""
    a = parameter(span, length)
    return a * (np.cosh(0.5 * span / a) - np.cosh((x - 0.5 * span) / a))


@pytest.mark.parametrize("mass_per_length", [0.02, 0.001], ids=["sinking", "floating"])
def test_a_cable_at_rest_hangs_in_a_catenary(mass_per_length):
    cord = made(mass_per_length)
    held, weight, a = cable.hold(ENDS, LENGTH, cable=cord), cord.weight_in_water, parameter(9.0, LENGTH)
    scale = abs(weight) * LENGTH
    assert_allclose(held.tow_force, [-abs(weight) * a, 0.0, 0.5 * weight * LENGTH], atol=1e-4 * scale)
    assert_allclose(held.drum_force, [abs(weight) * a, 0.0, 0.5 * weight * LENGTH], atol=1e-4 * scale)
    depth = np.sign(weight) * catenary(9.0, LENGTH, held.shape[:, 0])
    assert_allclose(held.shape[:, 2], depth, atol=1e-4 * LENGTH)


def test_the_error_falls_with_the_square_of_the_segments():
    cord, a = made(0.02), parameter(9.0, LENGTH)
    sizes = np.array([0.4, 0.2, 0.1, 0.05])
    pulls = [cable.hold(ENDS, LENGTH, cable=cord, segment_length=size).tow_force[0] for size in sizes]
    errors = np.abs(np.array(pulls) + cord.weight_in_water * a)
    assert np.polyfit(np.log(sizes), np.log(errors), 1)[0] == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize("depth", [0.0, 3.0])
@pytest.mark.parametrize("compliance", [0.0, 0.02, 0.2])
def test_a_cable_that_stretches_hangs_in_an_elastic_catenary(compliance, depth):
    cord = elastic.heavy(compliance)
    held = cable.hold(((9.0, 0.0, depth), STILL), LENGTH, cable=cord)
    H, V = elastic.ends(LENGTH, depth, cord)
    assert_allclose(held.tow_force, [-H, 0.0, V], atol=1e-4 * np.hypot(H, V))
    s = np.concatenate([[0.0], np.cumsum(held.segment_lengths)])
    assert_allclose(held.shape[:, 2] - depth, elastic.places(H, V, s, cord)[1], atol=1e-4 * LENGTH)


@pytest.mark.parametrize("short_by", [1e-2, 1e-4, 1e-6])
def test_a_nearly_taut_cable_pulls_as_a_shallow_catenary_does(short_by):
    """A catenary that is nearly straight has H = w_c L √(1/(24 short_by)), to within short_by itself."""
    cord = made(0.02)
    held = cable.hold(((LENGTH * (1.0 - short_by), 0.0, 0.0), STILL), LENGTH, cable=cord)
    expected = cord.weight_in_water * LENGTH * np.sqrt(1.0 / (24.0 * short_by))
    assert np.hypot(*held.tow_force[[0, 2]]) == pytest.approx(expected, rel=max(2.0 * short_by, 2e-4))


def test_a_cable_stretched_beyond_its_length_pulls_as_a_spring():
    cord = made(0.0049, compliance=0.1)
    held = cable.hold(((11.0, 0.0, 0.0), STILL), LENGTH, cable=cord)
    assert_allclose(held.tow_force, [-1.0, 0.0, 0.0], atol=1e-9)  # a strain of 0.1 at 0.1/N


def test_a_cable_whose_ends_are_above_one_another_carries_its_weight_in_two_legs():
    """The deeper end carries a leg of (L − h)/2, the upper one the rest, but for the segment that the fold lies in."""
    cord = made(0.02)
    held = cable.hold(((0.0, 0.0, 8.0), STILL), LENGTH, cable=cord)
    weight = cord.weight_in_water
    assert_allclose(held.tow_force, [0.0, 0.0, weight * 1.0], atol=0.1 * weight)
    assert_allclose(held.drum_force, [0.0, 0.0, weight * 9.0], atol=0.1 * weight)
    assert_allclose(held.shape[:, :2], 0.0, atol=1e-6)


@pytest.mark.parametrize("start", ["parabola", "catenary", "straight", "wrong side", "astray"])
@pytest.mark.parametrize("compliance", [0.0, 0.02])
def test_any_start_will_do(start, compliance):
    x = np.linspace(9.0, 0.0, 101)
    down = {
        "parabola": x * (9.0 - x) / 4.0,
        "catenary": catenary(9.0, LENGTH, x),
        "straight": 0.0 * x,
        "wrong side": -x * (9.0 - x) / 4.0,
        "astray": 5.0 * np.sin(2.0 * x),
    }[start]
    cord = made(0.02, compliance=compliance)
    found = cable.hold(ENDS, LENGTH, cable=cord, start=np.column_stack([x, 0.0 * x, down]))
    assert_allclose(found.shape, cable.hold(ENDS, LENGTH, cable=cord).shape, atol=1e-7)


def collocated(cord, length, current, ends):
    """Return the force at the first end (3,) by collocation on f' = D − w_c k and x' = (1 + eT) f/T."""
    start, end = np.asarray(ends, dtype=float)

    def slope(_, y):
        f, x = y[:3], y[3:]
        T = np.sqrt((f * f).sum(axis=0))
        t, J = f / T, np.array([current.at(place) for place in x.T]).T
        along = -(J * t).sum(axis=0)
        across = -J - along * t
        stretch = np.sqrt(1.0 + cord.compliance * T)
        drag = stretch * cord.tangential_drag * np.abs(along) * along * t
        drag += stretch * cord.normal_drag * np.sqrt((across * across).sum(axis=0)) * across
        drag[2] -= cord.weight_in_water
        return np.vstack([drag, (1.0 + cord.compliance * T) * t])

    def misses(a, b):
        return np.concatenate([a[3:] - start, b[3:] - end])

    # Begins with the cable's own answer, coarse, to be quick: collocation converges to its own solution from there.
    held = cable.hold(ends, length, current, cable=cord, segment_length=length / 20)
    s = np.concatenate([[0.0], np.cumsum(held.segment_lengths)])
    chords = np.diff(held.shape, axis=0)
    t = chords / np.linalg.norm(chords, axis=1)[:, None]
    f = np.vstack([t[:1], 0.5 * (t[1:] + t[:-1]), t[-1:]]) * held.tensions[:, None]
    solved = solve_bvp(slope, misses, s, np.hstack([f, held.shape]).T, tol=1e-8, max_nodes=20000)
    assert solved.success, solved.message
    return solved.y[:3, 0]


@pytest.mark.long
@pytest.mark.parametrize(
    ("mass", "compliance", "current", "ends"),
    [
        (0.0049, 0.0, cable.Current.uniform((0.0, 0.5, 0.0)), ENDS),
        (0.02, 0.0, cable.Current.uniform((0.3, 0.5, 0.0)), ((8.0, 1.0, 4.0), STILL)),
        (0.001, 0.01, cable.Current.uniform((-0.3, 0.2, 0.1)), ((7.0, 2.0, -3.0), STILL)),
        (0.02, 0.0, ABOVE_BELOW, ((3.0, 0.0, 8.0), STILL)),
    ],
    ids=["neutral across", "heavy oblique", "buoyant elastic", "sheared"],
)
def test_a_current_bows_a_cable_as_collocation_says(mass, compliance, current, ends):
    cord = made(mass, compliance=compliance)
    held = cable.hold(ends, LENGTH, current, cable=cord)
    reference = collocated(cord, LENGTH, current, ends)
    assert_allclose(held.tow_force, reference, atol=2e-4 * np.linalg.norm(reference))


def test_the_current_bows_the_cable_downstream_and_pulls_both_ends_that_way():
    held = cable.hold(ENDS, LENGTH, (0.0, 0.5, 0.0))
    assert held.shape[50, 1] > 1.0
    assert held.tow_force[1] > 0.0
    assert held.drum_force[1] == pytest.approx(held.tow_force[1], rel=1e-3)
    assert held.tow_force[0] < 0.0 < held.drum_force[0]  # each end is drawn to the other


@pytest.mark.parametrize("current", [STILL, (0.3, -0.5, 0.1)])
def test_what_weighs_and_drags_hangs_on_the_ends(current):
    """The sum of both forces is weight and drag, summed here over chords; what arcs add to the drag is 1e-3 of it."""
    cord = made(0.02)
    held = cable.hold(((7.0, 2.0, 3.0), STILL), LENGTH, current, cable=cord)
    chords = np.diff(held.shape, axis=0)
    t, J = chords / np.linalg.norm(chords, axis=1)[:, None], np.array(current)
    along = (t @ J)[:, None] * t
    across = J - along
    drag = cord.tangential_drag * np.linalg.norm(along, axis=1)[:, None] * along
    drag += cord.normal_drag * np.linalg.norm(across, axis=1)[:, None] * across
    carried = (held.segment_lengths[:, None] * drag).sum(axis=0)
    carried[2] += cord.weight_in_water * LENGTH
    assert_allclose(held.tow_force + held.drum_force, carried, atol=1e-3 * np.linalg.norm(carried))


def test_a_mirrored_problem_has_the_mirrored_answer():
    cord, mirror = made(0.02), np.array([1.0, -1.0, 1.0])
    ends, current = np.array([[7.0, 2.0, 3.0], STILL]), np.array([0.3, 0.4, 0.0])
    held = cable.hold(ends, LENGTH, current, cable=cord)
    mirrored = cable.hold(ends * mirror, LENGTH, current * mirror, cable=cord)
    assert_allclose(mirrored.shape, held.shape * mirror, atol=1e-8)
    assert_allclose(mirrored.tow_force, held.tow_force * mirror, atol=1e-8)
    turned = cable.hold(ends[::-1], LENGTH, current, cable=cord)
    assert_allclose(turned.shape[::-1], held.shape, atol=1e-6)


@pytest.mark.long
def test_bending_stiffness_flattens_the_bottom_of_a_loop():
    """A cable that bends over (EI/w_c)^⅓ = 0.4 m turns more gently than a limp one, and is as heavy."""
    limp, stiff = (
        cable.hold(((4.0, 0.0, 0.0), STILL), LENGTH, cable=made(0.02, bending_stiffness=EI))
        for EI in (0.0, 0.01)
    )
    sharpest = [np.linalg.norm(np.diff(held.shape, 2, axis=0), axis=1).max() for held in (limp, stiff)]
    assert sharpest[1] < 0.95 * sharpest[0]
    assert_allclose(stiff.tow_force[2], limp.tow_force[2], rtol=1e-3)


@pytest.mark.long
@pytest.mark.parametrize("ends", [((0.0, 0.0, 0.3), STILL), (STILL, STILL)])
def test_a_stiff_cable_that_would_be_folded_is_refused(ends):
    with pytest.raises(UserError, match=r"only found folded, by 1\d\d degrees|No equilibrium was found"):
        cable.hold(ends, LENGTH, cable=made(0.02, bending_stiffness=1e-2))


RESTING = {
    "catenary": (ENDS, LENGTH, STILL, {}),
    "sheared": (((3.0, 0.0, 8.0), STILL), LENGTH, ABOVE_BELOW, {}),
    "elastic": (ENDS, LENGTH, (0.0, 0.5, 0.0), {"compliance": 0.02}),
    "chain of 270 m": (((100.0, 0.0, 200.0), STILL), 270.0, STILL, {}),
    "120 m, high drag": (((100.0, 0.0, 0.0), STILL), 120.0, (0.0, 0.5, 0.0), {"diameter": 0.05}),
}


@pytest.mark.parametrize("name", RESTING)
def test_a_run_that_begins_so_stays_at_rest(name):
    ends, length, current, values = RESTING[name]
    held = cable.hold(ends, length, current, cable=made(0.02, **values))
    run = cable.pull_out(lambda _: STILL, 10.0, start=held, drum=cable.Brake())
    assert run.outcome.completed, run.outcome.message
    assert run.length[-1] == length
    assert np.abs(run.tow_force - held.tow_force).max() < 1e-7 * np.linalg.norm(held.tow_force)
    assert np.abs(run.shapes[-1] - (held.shape - held.shape[-1])).max() < 1e-7 * length


def test_a_winch_pays_out_from_a_chain_of_270_m():
    """With the winch the cable hangs deeper and deeper, and the vehicle carries half of what is new."""
    held = cable.hold(((100.0, 0.0, 200.0), STILL), 270.0, cable=made(0.02))
    winch = cable.PayOutRate(rate=lambda t: 0.25 * (1.0 - np.cos(0.1 * np.pi * t)))
    run = cable.pull_out(lambda _: STILL, 20.0, start=held, drum=winch)
    assert run.outcome.completed, run.outcome.message
    assert run.length[-1] == pytest.approx(275.0, abs=1e-6)
    assert run.shapes[-1][:, 2].max() > run.shapes[0][:, 2].max()


def test_both_ends_may_be_towed_along():
    """In axes that move with the ends, the water streams by: nothing changes."""
    held = cable.hold(ENDS, LENGTH, (-0.5, 0.0, 0.0), cable=made(0.02))
    boat = cable.MovingDrum(velocity=lambda _: (0.5, 0.0, 0.0), drum=cable.Brake())
    run = cable.pull_out(lambda _: (0.5, 0.0, 0.0), 5.0, start=held, drum=boat, current=STILL)
    assert np.abs(run.tow_force - held.tow_force).max() < 1e-7 * np.linalg.norm(held.tow_force)


def random_problem(rng):
    """Return ends, length, current and cable: slack to nearly taut, sinking, floating, neutral, in any current."""
    length = 10.0 ** rng.uniform(0.0, 3.0)
    ratio = rng.choice(
        [rng.uniform(0.05, 0.95), rng.uniform(0.9, 0.999), 1.0 - 10.0 ** rng.uniform(-6.0, -2.0)]
    )
    direction = rng.normal(size=3) if rng.random() < 0.8 else np.array([0.0, 0.0, 1.0])
    ends = np.array([ratio * length * direction / np.linalg.norm(direction), STILL])
    diameter, speed = 10.0 ** rng.uniform(-3.0, -1.3), 10.0 ** rng.uniform(-2.0, 0.0)
    area = 0.25 * np.pi * diameter**2
    velocity = speed * rng.normal(size=(4, 3)) * [1.0, 1.0, 0.0]
    depths = np.sort(rng.uniform(-length, length, 4))
    currents = (None, velocity[0], velocity[0], cable.Current.profile(depths, velocity))
    compliance = 0.0 if rng.random() < 0.6 else 10.0 ** rng.uniform(-8.0, -4.0)
    cord = made(
        1000.0 * area * rng.choice([1.0, rng.uniform(0.3, 1.0), rng.uniform(1.0, 6.0)]),
        cross_section_area=area,
        diameter=diameter,
        compliance=compliance,
    )
    return ends, length, currents[rng.integers(4)], cord


def unsolved(problems, seed):
    rng, failed = np.random.default_rng(seed), 0
    for _ in range(problems):
        ends, length, current, cord = random_problem(rng)
        try:
            held = cable.hold(ends, length, current, cable=cord)
        except cable.HoldError:
            failed += 1
            continue
        assert_allclose(held.shape[[0, -1]], ends, atol=1e-9 * length)
        stretched = held.segment_lengths * (1.0 + cord.compliance * held.segment_tensions)
        assert (np.linalg.norm(np.diff(held.shape, axis=0), axis=1) <= stretched * (1.0 + 1e-8)).all()
    return failed


@pytest.mark.long
def test_of_random_problems_nearly_all_are_solved():
    assert unsolved(400, 1) <= 2


@pytest.mark.slow
def test_of_10_000_random_problems_995_in_a_thousand_are_solved():
    assert unsolved(10_000, 2) <= 50


@pytest.mark.parametrize(
    ("ends", "length", "settings", "said"),
    [
        (((1.0, 2.0), STILL), 10.0, {}, "two places of three finite numbers"),
        (((np.nan, 0.0, 0.0), STILL), 10.0, {}, "two places of three finite numbers"),
        (ENDS, -1.0, {}, "length is -1.0"),
        (ENDS, 9.0, {}, "does not stretch, is 9 m long"),
        (ENDS, 4.0, {"cable": made(0.0049, compliance=1e-6)}, "it would stretch by 125 %"),
        (ENDS, 10.0, {"segment_length": 0.0}, "segment_length is 0.0"),
        (ENDS, 10.0, {"segment_length": 1e-9}, "segments of 1e-09 m"),
        (ENDS, 10.0, {"start": [[0.0, 0.0, 0.0]]}, "start must be"),
    ],
)
def test_what_cannot_be_held_is_said(ends, length, settings, said):
    with pytest.raises(UserError, match=said):
        cable.hold(ends, length, **settings)


@pytest.mark.parametrize("scheme", ["lumped", "paper_drum", "equation7"])
def test_schemes_that_cannot_begin_with_a_hanging_cable_say_so(scheme):
    said = f"scheme '{scheme}' does not know a start from cable.hold; use 'moving_end'"
    with pytest.raises(ValueError, match=said):
        cable.pull_out(lambda _: STILL, 1.0, start=cable.hold(ENDS, LENGTH), scheme=scheme)
