"""What the cable is called with: it is taken as it is said, or refused where it is made, with what to do instead.

Verifies: `cable.MovingEnd` and the other schemes, `cable.pull_out`, `cable.tow`, the drum. Configuration: values that
make no sense, arguments of older versions, schemes that do not know what is asked for; a metre of cable where one runs.
Tolerance: none; messages.
"""

import math

import numpy as np
import pytest

import cable
import subzero

RESTING = cable.Brake()


def ahead(time):
    return (1.0, 0.0, 0.0)


@pytest.mark.parametrize(
    "make, said",
    [
        (lambda: cable.MovingEnd(time_step=0.0), "MovingEnd: time_step is 0"),
        (lambda: cable.MovingEnd(time_step=math.nan), "MovingEnd: time_step is nan"),
        (lambda: cable.MovingEnd(segment_length=0.0), "MovingEnd: segment_length is 0"),
        (lambda: cable.MovingEnd(rtol=0.6), "MovingEnd: rtol is 0.6"),
        (lambda: cable.MovingEnd(rtol=-1e-3), "MovingEnd: rtol is -0.001"),
        (lambda: cable.MovingEnd(grading=0.6), "MovingEnd: grading is 0.6"),
        (lambda: cable.MovingEnd(run_in=101.0), "MovingEnd: run_in is 101"),
        (lambda: cable.MovingEnd(tolerance=1e-13), "MovingEnd: tolerance is 1e-13"),
        (lambda: cable.MovingEnd(tolerance=1e-2), "MovingEnd: tolerance is 0.01"),
        (lambda: cable.MovingEnd(time_step="0.1"), "MovingEnd: time_step is '0.1'"),
        (lambda: cable.Lumped(time_step=1e-10), "Lumped: time_step is 1e-10"),
        (lambda: cable.Lumped(segment_length=-1.0), "Lumped: segment_length is -1"),
        (lambda: cable.Equation7(time_step=math.inf), "Equation7: time_step is inf"),
        (lambda: cable.Equation7(segment_length=0.0), "Equation7: segment_length is 0"),
        (lambda: cable.Paper(time_step=0.0), "Paper: time_step is 0"),
        (lambda: cable.Paper(reading="drumm"), "Did you mean 'drum'"),
        (lambda: cable.Paper(implicit="yes"), "Paper: implicit is 'yes'"),
        (lambda: cable.DrumProperties(radius=0.0), "DrumProperties: radius is 0"),
        (lambda: cable.DrumProperties(inertia=-1e-3), "DrumProperties: inertia is -0.001"),
        (lambda: cable.DrumProperties(friction_torque=math.nan), "DrumProperties: friction_torque is nan"),
        (lambda: cable.DrumProperties(radius=1e-200, inertia=1.0).numbers(), "so small that"),
        (
            lambda: cable.MovingDrum(velocity=(1.0, 0.0, 0.0)),
            "MovingDrum: velocity is (1.0, 0.0, 0.0); it must be a function of 1 argument.",
        ),
        (lambda: cable.MovingDrum(velocity=ahead, drum=0.1), "drum is 0.1; it must be DrumProperties or"),
    ],
)
def test_a_value_that_makes_no_sense_is_refused_where_it_is_made(make, said):
    with pytest.raises(subzero.UserError) as caught:
        make()
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "options, said",
    [
        ({"duration": 0.0}, "duration is 0"),
        ({"scheme": "lumpd"}, "Did you mean 'lumped'"),
        ({"scheme": cable.MovingEnd}, "must be a text or MovingEnd or Lumped or Equation7 or Paper."),
        ({"drum": 0.1}, "pull_out: drum is 0.1; it must be DrumProperties or"),
        ({"cable": 0.1}, "cable is 0.1; it must be CableProperties or SectionedCable or None."),
        ({"start": -1.0}, "start is -1"),
    ],
)
def test_a_pull_that_makes_no_sense_is_refused_with_what_to_do(options, said):
    with pytest.raises(subzero.UserError) as caught:
        cable.pull_out(ahead, **({"duration": 1.0} | options))
    assert said in str(caught.value)


@pytest.mark.parametrize(
    "call", [lambda: cable.pull_out(ahead, 1.0, 0.1, 0.5), lambda: cable.pull_out(ahead, 1.0, stepp=0.1)]
)
def test_an_argument_that_never_was_is_no_argument(call):
    with pytest.raises(TypeError, match=r"pull_out\(\)"):
        call()


@pytest.mark.parametrize(
    "scheme, asked, lacks, able",
    [
        ("equation7", {"drum": RESTING}, "a winch", "'moving_end' or 'lumped'"),
        ("equation7", {"start": 5.0}, "cable in the water at the start", "'moving_end' or 'lumped'"),
        (
            "paper_drum",
            {"drum": cable.MovingDrum(velocity=ahead)},
            "a drum that moves",
            "'moving_end' or 'lumped'",
        ),
        (
            "paper",
            {"current": cable.Current.profile([0.0, 5.0], np.zeros((2, 3)))},
            "a current that changes",
            "'moving_end' or 'lumped'",
        ),
    ],
)
def test_a_scheme_that_does_not_know_what_is_asked_for_names_those_that_do(scheme, asked, lacks, able):
    with pytest.raises(subzero.UserError) as caught:
        cable.pull_out(ahead, 1.0, scheme=scheme, **asked)
    assert f"does not know {lacks}; use {able}." in str(caught.value)


def test_a_start_from_a_cable_that_hangs_is_for_the_default_scheme_only():
    hanging = cable.hold([(0.0, 0.0, 0.0), (5.0, 0.0, 1.0)], 8.0)
    with pytest.raises(
        subzero.UserError, match=r"does not know a start from cable\.hold; use 'moving_end'\."
    ):
        cable.pull_out(ahead, 1.0, scheme="lumped", start=hanging)


def test_what_cannot_tow_says_what_can():
    with pytest.raises(
        subzero.UserError, match=r"'paper_tangent' cannot tow a free end; choose 'moving_end' or"
    ):
        cable.tow(ahead, 5.0, 1.0, scheme="paper")


def test_the_options_of_a_scheme_are_those_it_runs_with():
    fine = cable.pull_out(ahead, 1.0, scheme=cable.MovingEnd(time_step=0.5, segment_length=0.2))
    usual, by_name = (
        cable.pull_out(ahead, 1.0, scheme=scheme) for scheme in (cable.MovingEnd(), "moving_end")
    )
    assert fine.time.tolist() == [0.0, 0.5, 1.0]
    assert len(fine.shapes[-1]) > len(usual.shapes[-1])
    assert np.array_equal(usual.tow_force, by_name.tow_force)


def test_a_drum_on_a_boat_is_the_drum_that_it_is_given():
    """A drum that rubs holds the cable with C_f/R_d, on a boat that stands as on the shore."""
    rubbing = cable.DrumProperties(radius=0.2, friction_torque=0.02)
    shore = cable.pull_out(ahead, 2.0, drum=rubbing)
    boat = cable.pull_out(ahead, 2.0, drum=cable.MovingDrum(velocity=lambda t: (0.0, 0.0, 0.0), drum=rubbing))
    assert np.array_equal(shore.tow_force, boat.tow_force)
    assert shore.drum_tension[-1] == pytest.approx(0.02 / 0.2, rel=1e-3)
