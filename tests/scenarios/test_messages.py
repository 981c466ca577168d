"""Bad input, word by word: file, line, key, what was found, why it cannot be, what is allowed."""

import pytest

import scenarios

GOOD = """\
description = "A short run"
vehicle = "subzero2"
cable = "table1"
[run]
duration_s = 10.0
hull_step_s = 0.02
cable_step_s = 0.1
[start]
wet_length_m = 0.0
[commands]
time_s = [0.0, 5.0]
propeller_rps = [20.0, 27.0]
rudder_deg = [0.0, 2.0]
stern_plane_port_deg = [0.0, 0.0]
stern_plane_starboard_deg = [0.0, 0.0]
"""
HEADER = "time_s,propeller_rps,rudder_deg,stern_plane_port_deg,stern_plane_starboard_deg\n"


@pytest.fixture
def complaints(tmp_path, monkeypatch):
    """Write files, load mine.toml, and return the lines of the message below its headline."""
    monkeypatch.chdir(tmp_path)

    def complain(text=GOOD, *, name="mine.toml", commands_csv=None, **files):
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        for stem, content in files.items():
            ending = "csv" if stem == "log" else "toml"
            (tmp_path / f"{stem}.{ending}").write_text(content, encoding="utf-8")
        with pytest.raises(scenarios.ScenarioError) as caught:
            scenarios.load(name, commands_csv=commands_csv)
        headline, *lines = str(caught.value).splitlines()
        assert headline.startswith("The scenario cannot be used (")
        assert len(lines) == len(caught.value.problems)
        return [line.removeprefix("  ") for line in lines]

    return complain


RUDDER = "Allowed: -90 to 90 degree (rudder, positive turns to starboard)."
PROPELLER = "Allowed: -200 to 200 rev/s (propeller speed, positive drives forward)."

ONE_EDIT = {
    "unknown key": (
        "hull_step_s = 0.02", "hull_stpe_s = 0.02",
        "mine.toml, line 6, run.hull_stpe_s: found 0.02, but [run] has no such key. "
        "Did you mean 'hull_step_s'?",
    ),
    "unknown section": (
        "[start]", "[strat]",
        "mine.toml, line 8, strat: found {'wet_length_m': 0.0}, but a trial file has no such key. "
        "Did you mean 'start'?",
    ),
    "unknown vehicle": (
        '"subzero2"', '"subzro"',
        "mine.toml, line 2, vehicle: found 'subzro', but we ship no such vehicle. "
        "Did you mean 'subzero2'? Or give the path of a file that ends in .toml.",
    ),
    "no such vehicle file": (
        '"subzero2"', '"min.toml"',
        "min.toml: there is no such file. Did you mean 'mine.toml'?",
    ),
    "unknown scheme": (
        "[start]", 'scheme = "papers"\n[start]',
        "mine.toml, line 8, run.scheme: found 'papers', but this is not a scheme. "
        "Allowed: moving_end, paper, paper_tangent, paper_drum.",
    ),
    "missing key": (
        "duration_s = 10.0\n", "",
        "mine.toml, line 4, run.duration_s: this key is missing in [run]. "
        "Allowed: 0.001 to 86400 s (how long the run lasts).",
    ),
    "missing section": (
        GOOD[GOOD.index("[run]") : GOOD.index("[start]")], "",
        "mine.toml, run.duration_s: this key is missing in [run]. "
        "Allowed: 0.001 to 86400 s (how long the run lasts).",
    ),
    "missing list": (
        "rudder_deg = [0.0, 2.0]\n", "",
        f"mine.toml, line 10, commands.rudder_deg: this key is missing in [commands]. {RUDDER}",
    ),
    "number for a text": (
        '"A short run"', "3",
        "mine.toml, line 1, description: found 3, but this is not a text in quotes.",
    ),
    "text for a number": (
        "27.0]", '"fast"]',
        f"mine.toml, line 12, commands.propeller_rps[1]: found 'fast', but this is not a number. {PROPELLER}",
    ),
    "truth for a number": (
        "27.0]", "true]",
        f"mine.toml, line 12, commands.propeller_rps[1]: found True, but this is not a number. {PROPELLER}",
    ),
    "number for a list": (
        "[0.0, 2.0]", "2.0",
        f"mine.toml, line 13, commands.rudder_deg: found 2.0, but this is not a list of numbers. {RUDDER}",
    ),
    "not a number": (
        "2.0]", "nan]",
        f"mine.toml, line 13, commands.rudder_deg[1]: found nan, but this is not a finite number. {RUDDER}",
    ),
    "infinite": (
        "2.0]", "inf]",
        f"mine.toml, line 13, commands.rudder_deg[1]: found inf, but this is not a finite number. {RUDDER}",
    ),
    "rudder beyond 90 degrees": (
        "2.0]", "90.1]",
        f"mine.toml, line 13, commands.rudder_deg[1]: found 90.1, but this is outside its limits. {RUDDER}",
    ),
    "revolutions a minute": (
        "27.0]", "1620]",
        f"mine.toml, line 12, commands.propeller_rps[1]: found 1620, but this is outside its limits. "
        f"{PROPELLER}",
    ),
    "time not increasing": (
        "[0.0, 5.0]", "[0.0, 0.0]",
        "mine.toml, line 11, commands.time_s[1]: found 0.0, but the time before it is 0. "
        "Times must increase from sample to sample.",
    ),
    "late first time": (
        "[0.0, 5.0]", "[1.0, 5.0]",
        "mine.toml, line 11, commands.time_s[0]: found 1.0, but what holds from 0 s until then is not said. "
        "The first time must be 0.",
    ),
    "lists of unequal length": (
        "[0.0, 2.0]", "[0.0]",
        "mine.toml, line 13, commands.rudder_deg: this list has 1 and time_s has 2 values. "
        "Give one value for each time.",
    ),
    "list too long": (
        "[0.0, 2.0]", "[0.0, 2.0, 0.0]",
        "mine.toml, line 13, commands.rudder_deg: this list has 3 and time_s has 2 values. "
        "Give one value for each time.",
    ),
    "integer of thousands of digits": (
        "0.02", "0x1" + "0" * 5000,
        "mine.toml, line 6, run.hull_step_s: found a number far too long, but this is not a number. "
        "Allowed: 0.0001 to 1 s (time step of the vehicle).",
    ),
    "zero step": (
        "0.02", "0",
        "mine.toml, line 6, run.hull_step_s: found 0, but this is outside its limits. "
        "Allowed: 0.0001 to 1 s (time step of the vehicle).",
    ),
    "hull step longer than cable step": (
        "0.02", "0.2",
        "mine.toml, line 7, run.cable_step_s: found 0.1, but it must be a whole number of steps "
        "hull_step_s = 0.2. Nearest: 0.2.",
    ),
    "cable step not a whole number of hull steps": (
        "0.02", "0.03",
        "mine.toml, line 7, run.cable_step_s: found 0.1, but it must be a whole number of steps "
        "hull_step_s = 0.03. Nearest: 0.09 or 0.12.",
    ),
    "no duration": (
        "10.0", "0",
        "mine.toml, line 5, run.duration_s: found 0, but this is outside its limits. "
        "Allowed: 0.001 to 86400 s (how long the run lasts).",
    ),
    "endless run": (
        "10.0\nhull_step_s = 0.02", "86400\nhull_step_s = 0.001",
        "mine.toml, line 6, run.hull_step_s: found 0.001, but a run of 86400 s would take 8.64e+07 steps, "
        "more than 1e+07. At least 0.00864 s.",
    ),
    "negative wet length": (
        "wet_length_m = 0.0", "wet_length_m = -1",
        "mine.toml, line 9, start.wet_length_m: found -1, but this is outside its limits. "
        "Allowed: 0 to 10000 m (cable already in the water, laid straight).",
    ),
    "countless segments": (
        "[start]\nwet_length_m = 0.0", "segment_length_m = 0.01\n[start]\nwet_length_m = 2000",
        "mine.toml, line 8, run.segment_length_m: found 0.01, but a cable of 2000 m at the start would have "
        "more than 100000 segments. At least 0.02 m.",
    ),
    "no commands": (
        GOOD[GOOD.index("[commands]") :], "",
        "mine.toml: neither [commands] nor [motion] is given. Give one of the two; fig6 and fig5 show how.",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", ONE_EDIT)
def test_one_mistake_gives_this_one_line(case, complaints):
    before, after, expected = ONE_EDIT[case]
    assert GOOD.count(before) >= 1
    assert complaints(GOOD.replace(before, after, 1)) == [expected]


CHANGES = {
    '"cable.diametre" = 1.0':
        "changes.cable.diametre: no vehicle and no cable has such a value. Did you mean 'cable.diameter'?",
    '"speed" = 1.0':
        "changes.speed: no vehicle and no cable has such a value. "
        "Write vehicle.section.key, cable.key or drum.key, as in the files of vehicle and cable.",
    '"cable.diameter" = -0.0025':
        "changes.cable.diameter: found -0.0025, but this is outside its limits. "
        "Allowed: 1e-06 to 1 m; plausible is 0.0024 to 0.0026.",
    '"cable.normal_drag_coefficient" = "one"':
        "changes.cable.normal_drag_coefficient: found 'one', but this is not a number. "
        "Allowed: 0 to 10; plausible is 0.8 to 1.5.",
    '"vehicle.rigid_body.mass" = true':
        "changes.vehicle.rigid_body.mass: found True, but this is not a number. "
        "Allowed: above 0 kg; plausible is 6.4 to 7.5.",
    '"vehicle.rigid_body.mass" = -7.0':
        "changes.vehicle.rigid_body.mass: found -7.0, but this is outside its limits. "
        "Allowed: above 0 kg; plausible is 6.4 to 7.5.",
    '"vehicle.hull.diameter" = 0':
        "changes.vehicle.hull.diameter: found 0, but this is outside its limits. "
        "Allowed: above 0 m; plausible is 0.095 to 0.105.",
    '"vehicle.buoyancy.net_buoyancy" = nan':
        "changes.vehicle.buoyancy.net_buoyancy: found nan, but this is not a finite number. "
        "Allowed: any finite number N; plausible is -0.5 to 0.5.",
}  # fmt: skip


@pytest.mark.parametrize("line", CHANGES)
def test_a_change_that_cannot_be_gives_this_one_line(line, complaints):
    expected = f"mine.toml, line 17, {CHANGES[line]}"
    assert complaints(f"{GOOD}[changes]\n{line}\n") == [expected]


def test_an_unknown_scenario_is_answered_with_the_nearest(complaints):
    expected = "fig66: there is no such scenario. Did you mean 'fig6'? Or give the path of a TOML file."
    assert complaints(name="fig66") == [expected]


def test_a_file_that_is_not_there_is_answered_with_its_neighbour(complaints):
    assert complaints(name="mime.toml") == ["mime.toml: there is no such file. Did you mean 'mine.toml'?"]
    assert complaints(name="no/mine.toml") == [
        "no/mine.toml: there is no such file. Its folder does not exist either: check the path."
    ]


def test_a_folder_is_no_scenario_and_no_command_file(complaints, tmp_path):
    folder = str(tmp_path)
    expected = [f"{folder}: this is a folder, not a file. Name a file in it."]
    assert complaints(name=folder) == expected
    assert complaints(commands_csv=folder) == expected


def test_a_file_that_is_no_text_is_refused(complaints, tmp_path):
    (tmp_path / "image.toml").write_bytes(b"\x89PNG\xff\xfe")
    expected = "image.toml: this is not a text file in UTF-8. Save it as plain text, encoding UTF-8."
    assert complaints(name="image.toml") == [expected]


def test_a_file_that_is_not_toml_is_refused_with_line_and_column(complaints):
    (line,) = complaints(GOOD.replace("duration_s = 10.0", "duration_s = 10,0"))
    assert line.startswith(
        "mine.toml, line 5: found 'duration_s = 10,0', but this is not valid TOML, at column 16: "
    )
    assert line.endswith("Write one 'key = value' a line, text in double quotes, lists as [1, 2, 3].")


def test_commands_and_motion_exclude_each_other(complaints):
    motion = "[motion]\ntime_s = [0.0]\nsurge_speed_m_s = [1.0]\npitch_deg = [0.0]\nheading_deg = [0.0]\n"
    expected = "motion: [commands] is given too. Keep one of [commands] and [motion]."
    assert complaints(GOOD + motion) == [f"mine.toml, line 16, {expected}"]
    prescribed = GOOD[: GOOD.index("[commands]")] + motion
    log = HEADER + "0,27,0,0,0\n10,27,0,0,0\n"
    assert complaints(prescribed, log=log, commands_csv="log.csv") == [
        "mine.toml, line 10, motion: a prescribed motion takes no commands. "
        "Leave out the file of commands, or take a scenario with [commands]."
    ]


def test_a_prescribed_motion_leaves_no_room_for_another_start(complaints):
    motion = "[motion]\ntime_s = [0.0]\nsurge_speed_m_s = [1.0]\npitch_deg = [0.0]\nheading_deg = [0.0]\n"
    text = GOOD[: GOOD.index("[commands]")].replace("[start]", "[start]\nheading_deg = 27.0") + motion
    assert complaints(text) == [
        "mine.toml, line 9, start.heading_deg: found 27.0, but the prescribed motion says how the run "
        "starts. Leave it out, and set it in [motion]."
    ]


def test_an_own_cable_is_held_against_the_shipped_one(complaints):
    own = (scenarios.path("fig6").parent.parent / "cables" / "table1.toml").read_text(encoding="utf-8")
    lines = [line for line in own.splitlines() if line and not line.startswith("#")]
    lines[1] = 'water_densty = { value = 1000.0, unit = "kg/m3" }'
    lines[2] = 'mass_per_length = { value = 4.9, unit = "g/m" }'
    lines[4] = 'diameter = { value = -0.0025, unit = "m" }'
    lines[5] = 'tangential_drag_coefficient = { value = "low", unit = "1", origin = "me" }'
    lines[6] = "normal_drag_coefficient = 1.0"
    assert complaints(GOOD.replace("table1", "own.toml"), own="\n".join(lines)) == [
        "own.toml, line 1, cable.water_density: this key is missing. "
        'Add it as { value = ..., unit = "kg/m3" }.',
        "own.toml, line 2, cable.water_densty: this file has no such key. "
        "Did you mean 'cable.water_density'?",
        "own.toml, line 3, cable.mass_per_length: found 4.9, but its unit is 'g/m'. "
        'Allowed: unit = "kg/m".',
        "own.toml, line 5, cable.diameter: found -0.0025, but this is outside its limits. "
        "Allowed: 1e-06 to 1 m; plausible is 0.0024 to 0.0026.",
        "own.toml, line 6, cable.tangential_drag_coefficient: found 'low', but 'origin' says nothing here. "
        "Allowed: value, unit, range, tolerance, limits, source.",
        "own.toml, line 7, cable.normal_drag_coefficient: found 1.0, but its unit is not given. "
        'Allowed: unit = "1".',
    ]


def test_all_problems_of_all_files_come_at_once(complaints):
    text = GOOD.replace('"table1"', '"own.toml"').replace("0.02", "0").replace("wet_length_m", "wet_length")
    lines = complaints(text, log=HEADER + "0,nan,0,0,0\n", commands_csv="log.csv")
    assert [line.partition(":")[0] for line in lines] == [
        "mine.toml, line 6, run.hull_step_s",
        "mine.toml, line 9, start.wet_length",
        "own.toml",
        "log.csv, line 2, propeller_rps",
        "log.csv, line 2, time_s",
    ]
