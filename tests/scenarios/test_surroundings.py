"""Water that changes with depth, a winch, a vessel: what is in a file is what comes out, and every mistake is told.

Verifies: `scenarios.reader`. Configuration: a short trial with these sections. Tolerance: none, texts and numbers
are those of the file.
"""

import pytest

import scenarios

BASE = """\
description = "A short run"
vehicle = "subzero2"
cable = "table1"
[run]
duration_s = 10.0
[motion]
time_s = [0.0]
surge_speed_m_s = [1.0]
pitch_deg = [0.0]
heading_deg = [0.0]
"""
AROUND = """\
[water]
current_east_m_s = 0.1
depth_m = [0.0, 20]
profile_east_m_s = [0.4, 0.0]
[winch]
control = "pay_out_rate"
time_s = [0.0, 5.0]
pay_out_rate_m_s = [1.2, -0.3]
[vessel]
time_s = [0.0, 4.0]
velocity_north_m_s = [0.0, 0.5]
"""


@pytest.fixture
def read(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def reader(text):
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        return scenarios.load("mine.toml")

    return reader


def test_what_is_said_arrives_and_what_is_left_out_is_zero(read):
    trial = read(BASE + AROUND)
    assert trial.current == (0.0, 0.1, 0.0)
    assert trial.profile == scenarios.Profile(depth=(0.0, 20.0), velocity=((0.0, 0.4, 0.0), (0.0, 0.0, 0.0)))
    assert trial.winch == scenarios.Winch(control="pay_out_rate", time=(0.0, 5.0), setpoint=(1.2, -0.3))
    assert trial.vessel == scenarios.Vessel(time=(0.0, 4.0), velocity=((0.0, 0.0, 0.0), (0.5, 0.0, 0.0)))


def test_without_these_sections_the_drum_is_free_and_on_the_shore(read):
    trial = read(BASE)
    assert (trial.profile, trial.winch, trial.vessel, trial.grading) == (None, None, None, 0.0)


def test_the_other_winches_and_grading_are_read(read):
    assert read(BASE + '[winch]\ncontrol = "brake"\n').winch == scenarios.Winch(control="brake")
    keep = '[winch]\ncontrol = "constant_tension"\ntime_s = [0.0]\ntension_N = [50]\n'
    assert read(BASE + keep).winch == scenarios.Winch(
        control="constant_tension", time=(0.0,), setpoint=(50.0,)
    )
    assert read(BASE.replace("[motion]", "grading = 0.02\n[motion]")).grading == 0.02


def test_a_sea_bed_is_read_and_is_not_known_by_default(read):
    assert read(BASE + AROUND.replace("[water]", "[water]\nsea_bed_m = 35.5")).sea_bed == 35.5
    assert read(BASE + AROUND).sea_bed == 0.0
    with pytest.raises(
        scenarios.ScenarioError, match=r"sea_bed_m: found -3\.0, but this is outside its limits"
    ):
        read(BASE + AROUND.replace("[water]", "[water]\nsea_bed_m = -3.0"))


@pytest.mark.parametrize("key", ["strength", "minimum_bend_radius"])
def test_a_cable_file_may_leave_out_what_the_cable_may_bear(key, read, tmp_path):
    table1 = scenarios.path("fig6").parent.parent / "cables" / "table1.toml"
    lines = [line for line in table1.read_text().splitlines() if not line.startswith(key)]
    (tmp_path / "own.toml").write_text("\n".join(lines))
    own = BASE.replace('"table1"', '"own.toml"')
    assert read(own).cable[key] == 0.0
    assert read(f'{own}[changes]\n"cable.{key}" = 2.5\n').cable[key] == 2.5
    with pytest.raises(
        scenarios.ScenarioError, match=rf"cable\.{key}: found -1\.0, but this is outside its limits"
    ):
        read(f'{own}[changes]\n"cable.{key}" = -1.0\n')


def test_a_cable_file_may_leave_out_the_bending_stiffness(read, tmp_path):
    table1 = scenarios.path("fig6").parent.parent / "cables" / "table1.toml"
    lines = [line for line in table1.read_text().splitlines() if not line.startswith("bending_stiffness")]
    (tmp_path / "own.toml").write_text("\n".join(lines))
    assert read(BASE.replace('"table1"', '"own.toml"')).cable["bending_stiffness"] == 0.0
    stiff = '[changes]\n"cable.bending_stiffness" = 2.5\n'
    assert read(BASE.replace('"table1"', '"own.toml"') + stiff).cable["bending_stiffness"] == 2.5


MISTAKES = {
    "no control": (
        'control = "pay_out_rate"\n', "",
        "mine.toml, line 15, winch.control: this key is missing in [winch]. "
        "Allowed: pay_out_rate, constant_tension, brake.",
    ),
    "unknown control": (
        '"pay_out_rate"', '"payout"',
        "mine.toml, line 16, winch.control: found 'payout', but a winch cannot do this. "
        "Allowed: pay_out_rate, constant_tension, brake.",
    ),
    "misspelt list": (
        "pay_out_rate_m_s", "payout_rate_m_s",
        "mine.toml, line 18, winch.payout_rate_m_s: found [1.2, -0.3], but [winch] has no such key. "
        "Did you mean 'pay_out_rate_m_s'?",
    ),
    "missing list": (
        "pay_out_rate_m_s = [1.2, -0.3]\n", "",
        'mine.toml, line 15, winch.pay_out_rate_m_s: a winch with control = "pay_out_rate" needs this list. '
        "Allowed: -10 to 10 m/s (rate at which cable comes off the drum, negative reels in).",
    ),
    "list of another control": (
        "pay_out_rate_m_s = [1.2, -0.3]\n", "pay_out_rate_m_s = [1.2, -0.3]\ntension_N = [5.0, 5.0]\n",
        'mine.toml, line 19, winch.tension_N: it says nothing to a winch with control = "pay_out_rate". '
        'Leave it out, or set control = "constant_tension".',
    ),
    "rate in metres a minute": (
        "1.2,", "72,",
        "mine.toml, line 18, winch.pay_out_rate_m_s[0]: found 72, but this is outside its limits. "
        "Allowed: -10 to 10 m/s (rate at which cable comes off the drum, negative reels in).",
    ),
    "unequal lists": (
        "[1.2, -0.3]", "[1.2]",
        "mine.toml, line 18, winch.pay_out_rate_m_s: this list has 1 and time_s has 2 values. "
        "Give one value for each time.",
    ),
    "late first time of a winch": (
        "[0.0, 5.0]", "[1.0, 5.0]",
        "mine.toml, line 17, winch.time_s[0]: found 1.0, but what holds from 0 s until then is not said. "
        "The first time must be 0.",
    ),
    "times of a vessel that do not increase": (
        "[0.0, 4.0]", "[0.0, 0.0]",
        "mine.toml, line 20, vessel.time_s[1]: found 0.0, but the time before it is 0. "
        "Times must increase from sample to sample.",
    ),
    "a vessel without times": (
        "time_s = [0.0, 4.0]\n", "",
        "mine.toml, line 19, vessel.time_s: this key is missing in [vessel]. "
        "Allowed: 0 to 86400 s (time since the start).",
    ),
    "misspelt velocity": (
        "velocity_north_m_s", "velocity_nord_m_s",
        "mine.toml, line 21, vessel.velocity_nord_m_s: found [0.0, 0.5], but [vessel] has no such key. "
        "Did you mean 'velocity_north_m_s'?",
    ),
    "depths that do not increase": (
        "[0.0, 20]", "[20, 0.0]",
        "mine.toml, line 13, water.depth_m[1]: found 0.0, but the depth before it is 20. "
        "Depths must increase from top to bottom.",
    ),
    "a depth above the water": (
        "[0.0, 20]", "[-2.0, 20]",
        "mine.toml, line 13, water.depth_m[0]: found -2.0, but this is outside its limits. "
        "Allowed: 0 to 11000 m (depths of a profile that is added to the current, positive down).",
    ),
    "a profile of unequal lists": (
        "[0.4, 0.0]", "[0.4]",
        "mine.toml, line 14, water.profile_east_m_s: this list has 1 and depth_m has 2 values. "
        "Give one value for each depth.",
    ),
    "a profile without depths": (
        "depth_m = [0.0, 20]\n", "",
        "mine.toml, line 13, water.profile_east_m_s: [water] does not say at which depths. "
        "Add depth_m, from top to bottom.",
    ),
    "depths without velocities": (
        "profile_east_m_s = [0.4, 0.0]\n", "",
        "mine.toml, line 13, water.depth_m: [water] does not say how the water moves there. "
        "Add profile_north_m_s, profile_east_m_s, or both.",
    ),
    "grading too steep": (
        "[motion]", "grading = 2.0\n[motion]",
        "mine.toml, line 6, run.grading: found 2.0, but this is outside its limits. "
        "Allowed: 0 to 0.5 (how much longer segments get per metre of cable from the vehicle).",
    ),
    "the paper's scheme": (
        "[motion]", 'scheme = "paper"\n[motion]',
        "mine.toml, line 6, run.scheme: found 'paper', but the paper's scheme knows a limp cable on a free drum on the "
        "shore, and a uniform current. "
        'Set scheme = "moving_end", or leave out [winch] and [vessel] and a profile in [water].',
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", MISTAKES)
def test_one_mistake_gives_this_one_line(case, read):
    before, after, expected = MISTAKES[case]
    assert (BASE + AROUND).count(before) >= 1
    with pytest.raises(scenarios.ScenarioError) as caught:
        read((BASE + AROUND).replace(before, after, 1))
    lines = [str(problem) for problem in caught.value.problems]
    if case == "misspelt list":  # and the list that is meant is missing
        assert len(lines) == 2
        lines = [line for line in lines if "no such key" in line]
    assert lines == [expected]


@pytest.mark.parametrize("section", ["winch", "vessel", "water"])
def test_a_number_in_place_of_a_section_is_told_once(section, read):
    with pytest.raises(scenarios.ScenarioError) as caught:
        read(f"{section} = 3\n{BASE}")
    (problem,) = caught.value.problems
    assert str(problem) == f"mine.toml, line 1, {section}: found 3, but this is not a section."


def test_a_stiff_cable_is_not_for_the_papers_scheme(read):
    text = (
        BASE.replace("[motion]", 'scheme = "paper_drum"\n[motion]')
        + '[changes]\n"cable.bending_stiffness" = 1.0\n'
    )
    with pytest.raises(scenarios.ScenarioError, match="leave out the cable's bending_stiffness"):
        read(text)
