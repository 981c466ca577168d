"""Logs that need a library: ArduPilot, MAVLink, PX4, MCAP and ROS, read, or named in one line.

Verifies: `subzero.logs.files`, through `subzero.read_log`. Configuration: a vehicle that turns and dives, written by
the libraries of these loggers, or byte by byte as their formats are specified. Tolerance: single precision.
"""

from __future__ import annotations

import json
import math
import struct
import sys

import numpy as np
import pytest
from numpy.testing import assert_allclose

import subzero
from subzero.errors import UserError
from subzero.logs.files import angles_of

EPOCH = 1_700_000_000
TIME = 0.1 * np.arange(200)
ROLL, PITCH = 0.05 * np.sin(0.5 * TIME), 0.2 * np.sin(0.3 * TIME)
YAW = 0.5 + 0.3 * np.sin(0.2 * TIME)
DEPTH = 2.0 - np.cumsum(0.1 * 1.2 * np.sin(PITCH))
YAW_RATE = np.gradient(YAW, TIME)


def quaternion(roll, pitch, yaw):
    """Return w, x, y, z of the turn by yaw, pitch, roll about z, y, x, one after the other."""
    half = [(math.cos(0.5 * angle), math.sin(0.5 * angle)) for angle in (yaw, pitch, roll)]
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    for (c, s), (i, j, k) in zip(half, ((0, 0, 1), (0, 1, 0), (1, 0, 0)), strict=True):
        i, j, k = s * i, s * j, s * k
        w, x, y, z = w * c - x * i - y * j - z * k, w * i + x * c + y * k - z * j, \
            w * j - x * k + y * c + z * i, w * k + x * j - y * i + z * c  # fmt: skip
    return w, x, y, z


def hold(record, *, digits=1e-4, names=("depth", "heading", "pitch", "roll_angle")):
    truth = dict(
        zip(
            ("depth", "heading", "pitch", "roll_angle"),
            (DEPTH, *map(np.degrees, (YAW, PITCH, ROLL))),
            strict=True,
        )
    )
    for name in names:
        known = np.isfinite(record.values[name])
        assert_allclose(record.values[name][known], truth[name], atol=digits, err_msg=name)
        assert_allclose(record.time[known] - record.time[known][0], TIME, atol=1e-5)


def dataflash(path, *, rows=TIME.size):
    """Write a log of ArduPilot: messages FMT that say what follows, then ATT, CTUN, BARO and RCOU."""
    kinds = {
        128: ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns", 89),
        1: ("ATT", "Qfff", "TimeUS,Roll,Pitch,Yaw", 23),
        2: ("CTUN", "Qf", "TimeUS,BAlt", 15),
        3: ("BARO", "QBf", "TimeUS,I,Press", 16),
        4: ("RCOU", "QHH", "TimeUS,C1,C2", 15),
        5: ("FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds", 44),
    }
    parts = [
        struct.pack("<BBBBB4s16s64s", 0xA3, 0x95, 128, kind, length, *(text.encode() for text in texts))
        for kind, (*texts, length) in kinds.items()
    ]
    parts.append(
        struct.pack("<BBBQB16s16s", 0xA3, 0x95, 5, 0, 3, b"s#-", b"F--")
    )  # I is the instance of BARO
    for at, *angles, depth in list(zip(TIME, ROLL, PITCH, YAW, DEPTH, strict=True))[:rows]:
        head, us = (0xA3, 0x95), int(1e6 * (at + 100.0))
        parts.append(struct.pack("<BBBQfff", *head, 1, us, *map(math.degrees, angles)))
        parts.append(struct.pack("<BBBQf", *head, 2, us, -depth))
        parts.append(struct.pack("<BBBQBf", *head, 3, us, 0, 101_325.0))
        parts.append(struct.pack("<BBBQBf", *head, 3, us, 1, 101_325.0 + 1025.0 * 9.80665 * depth))
        parts.append(struct.pack("<BBBQHH", *head, 4, us, 1500, 1600))
    path.write_bytes(b"".join(parts))
    return path


def telemetry(path):
    from pymavlink.dialects.v20 import common

    with open(path, "wb") as file:
        for system, shift in ((1, 0.0), (7, 1.0)):  # a second vehicle is heard, too
            link = common.MAVLink(None, srcSystem=system)
            for k, at in enumerate(TIME):
                stamp = struct.pack(">Q", int(1e6 * (EPOCH + at)) + 10 * system)
                attitude = link.attitude_encode(
                    int(1e3 * at), ROLL[k] + shift, PITCH[k], YAW[k], 0.0, 0.0, YAW_RATE[k]
                )
                place = link.global_position_int_encode(
                    int(1e3 * at), 0, 0, 0, int(-1e3 * DEPTH[k]), 0, 0, 0, 0
                )
                hull = link.scaled_pressure_encode(int(1e3 * at), 1013.0, 0.0, 2000)
                for message in (attitude, place, hull):
                    file.write(stamp + message.pack(link))
    return path


def ulog(path):
    def message(kind, body):
        return struct.pack("<HB", len(body), ord(kind)) + body

    parts = [b"\x55\x4c\x6f\x67\x01\x12\x35\x01" + struct.pack("<Q", 0)]
    parts += [message("F", text) for text in (
        b"vehicle_attitude:uint64_t timestamp;float[4] q;",
        b"vehicle_local_position:uint64_t timestamp;float z;",
        b"vehicle_angular_velocity:uint64_t timestamp;float[3] xyz;",
        b"vehicle_attitude_setpoint:uint64_t timestamp;float[4] q;",
    )]  # fmt: skip
    names = (
        b"vehicle_attitude",
        b"vehicle_local_position",
        b"vehicle_angular_velocity",
        b"vehicle_attitude_setpoint",
    )
    parts += [message("A", struct.pack("<BH", 0, k) + name) for k, name in enumerate(names)]
    for k, at in enumerate(TIME):
        us, q = int(1e6 * at) + 5_000_000, quaternion(ROLL[k], PITCH[k], YAW[k])
        parts.append(message("D", struct.pack("<HQffff", 0, us, *q)))
        parts.append(message("D", struct.pack("<HQf", 1, us, DEPTH[k])))
        parts.append(message("D", struct.pack("<HQfff", 2, us, 0.0, 0.0, YAW_RATE[k])))
        parts.append(message("D", struct.pack("<HQffff", 3, us, 1.0, 0.0, 0.0, 0.0)))
    path.write_bytes(b"".join(parts))
    return path


def in_axes_of_ros(k):
    """Return position and attitude of a sample in east, north, up and forward, left, up."""
    x, y, z, w = np.roll(quaternion(ROLL[k], -PITCH[k], 0.5 * math.pi - YAW[k]), -1)
    position = {"x": 0.3 * k, "y": 0.1 * k, "z": -DEPTH[k]}
    return position, {"x": x, "y": y, "z": z, "w": w}


def mcap_of_json(path):
    from mcap.writer import Writer

    with open(path, "wb") as file:
        log = Writer(file)
        log.start()
        schema = log.register_schema("odom", "jsonschema", b"{}")
        topics = [log.register_channel(topic, "json", schema) for topic in ("/odom", "/pose_command")]
        other = log.register_channel("/camera", "protobuf", schema)
        for k, at in enumerate(TIME):
            position, orientation = in_axes_of_ros(k)
            body = {
                "header": {"frame_id": "odom"},
                "pose": {"pose": {"position": position, "orientation": orientation}},
            }
            wanted = {
                "pose": {
                    "position": {"x": 0, "y": 0, "z": 0},
                    "orientation": {"x": 0, "y": 0, "z": 0, "w": 1},
                }
            }
            ns = int(1e9 * (EPOCH + at))
            body["arm"] = {"child_frame_id": "arm", "rotation": {"x": 0, "y": 0, "z": 1, "w": 0}}
            for topic, message in zip(topics, (body, wanted), strict=True):
                log.add_message(topic, log_time=ns, publish_time=ns, data=json.dumps(message).encode())
            log.add_message(other, log_time=ns, publish_time=ns, data=b"?")
        log.finish()
    return path


def bag(path, *, kind="geometry_msgs/msg/PoseStamped", definition="float64 x\n"):
    """Write a bag of ROS 1 or 2 by rosbags."""
    from rosbags import rosbag1, rosbag2
    from rosbags.typesys import Stores, get_typestore

    is_first = path.suffix == ".bag"
    store = get_typestore(Stores.ROS1_NOETIC if is_first else Stores.ROS2_HUMBLE)
    writer = rosbag1.Writer(path) if is_first else rosbag2.Writer(path.with_suffix(""), version=9)
    pose, point, turn, header, stamp = (store.types[f"{name}"] for name in (
        "geometry_msgs/msg/Pose", "geometry_msgs/msg/Point", "geometry_msgs/msg/Quaternion", "std_msgs/msg/Header",
        "builtin_interfaces/msg/Time"))  # fmt: skip
    with writer as log:
        if kind.startswith("geometry_msgs"):
            link = log.add_connection("/rov/pose", kind, typestore=store)
        else:
            link = log.add_connection("/rov/pose", kind, msgdef=definition, md5sum="0" * 32)
        for k, at in enumerate(TIME):
            position, orientation = in_axes_of_ros(k)
            ns = int(1e9 * (EPOCH + at))
            first = (k,) if is_first else ()
            head = header(*first, stamp=stamp(EPOCH, 0), frame_id="map")
            message = store.types["geometry_msgs/msg/PoseStamped"](
                head, pose(point(**position), turn(**orientation))
            )
            pack = store.serialize_ros1 if is_first else store.serialize_cdr
            log.write(link, ns, pack(message, "geometry_msgs/msg/PoseStamped"))
    return path if is_first else next(path.with_suffix("").glob("*.db3"))


def test_a_quaternion_becomes_the_angles_that_it_was_made_of():
    for angles in ((0.1, -0.4, 3.0), (-2.0, 1.2, -1.0), (0.0, 0.0, 0.7)):
        assert_allclose(angles_of(*quaternion(*angles)), angles, atol=1e-12)


def test_a_log_of_ardupilot_is_read_and_what_is_not_used_is_said(tmp_path):
    pytest.importorskip("pymavlink")
    record = subzero.read_log(dataflash(tmp_path / "00000007.BIN"))
    hold(record)
    assert "BARO[0].Press: not used: a barometer inside the hull." in record.notes
    assert any(note.startswith("RCOU.C1, RCOU.C2: not used: the pulse of a motor") for note in record.notes)


def test_a_log_of_ardupilot_that_was_cut_is_read_as_far_as_it_goes_and_nothing_else_is_printed(
    tmp_path, capfd
):
    pytest.importorskip("pymavlink")
    path = dataflash(tmp_path / "log.bin")
    whole = path.read_bytes()
    path.write_bytes(whole[:4000] + b"\x17" * 500 + whole[4500:-7])
    record = subzero.read_log(path)
    assert "Parts of it are damaged or cut off, and are left out." in record.notes
    assert_allclose(np.nanmin(record.values["depth"]), DEPTH.min(), atol=1e-4)
    assert capfd.readouterr() == ("", "")


def test_a_log_of_telemetry_is_read_of_the_first_vehicle_in_it(tmp_path):
    pytest.importorskip("pymavlink")
    record = subzero.read_log(telemetry(tmp_path / "log.tlog"))
    hold(record, digits=1.1e-3)
    assert "400 messages of other systems are left out." in record.notes
    assert "SCALED_PRESSURE.press_abs: not used: a barometer inside the hull." in record.notes


def test_a_log_of_px4_is_read(tmp_path):
    pytest.importorskip("pyulog")
    record = subzero.read_log(ulog(tmp_path / "log.ulg"))
    hold(record)
    assert_allclose(record.values["yaw_rate"], np.degrees(YAW_RATE), atol=1e-4)


def test_an_mcap_log_in_json_is_read_in_the_axes_of_the_vehicle_but_for_commands(tmp_path):
    pytest.importorskip("mcap")
    record = subzero.read_log(mcap_of_json(tmp_path / "log.mcap"))
    hold(record)
    assert_allclose(record.values["east"] - record.values["east"][0], 0.3 * np.arange(TIME.size), atol=1e-6)
    assert any(note.startswith("Its axes are those of ROS") for note in record.notes)
    assert "Messages in protobuf are left out; JSON and ROS 2 are read." in record.notes


@pytest.mark.parametrize("name", ["log.bag", "log.db3"])
def test_a_bag_of_ros_is_read(name, tmp_path):
    pytest.importorskip("rosbags")
    hold(subzero.read_log(bag(tmp_path / name)))


@pytest.mark.parametrize(
    "kind, definition",
    [
        ("a/msg/B:\n    pass\nMARK\nclass C", "float64 x\n"),
        ("a/msg/B(*[MARK])", "float64 x\n"),
        ("a/msg/B", "float64 x = MARK\n"),
        ("a/msg/B", "float64 x\n    MARK\n"),
        ("a/msg/B", "string X='+MARK+'\nstring Y=\"'+MARK+'\"\nfloat64 x\n"),
    ],
)
def test_no_definition_in_a_bag_is_executed(kind, definition, tmp_path):
    """Rosbags makes classes of the definitions in a bag, by text."""
    pytest.importorskip("rosbags")
    mark = f"open({str(tmp_path / 'mark')!r}, 'w')"
    path = bag(
        tmp_path / "log.bag", kind=kind.replace("MARK", mark), definition=definition.replace("MARK", mark)
    )
    with pytest.raises(UserError):
        subzero.read_log(path)
    assert not (tmp_path / "mark").exists()


def test_matlab_7_3_says_how_to_save_it(tmp_path):
    head = b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + struct.pack("<H", 0x0200) + b"IM"
    (tmp_path / "log.mat").write_bytes(head + b"\0" * 384 + b"\x89HDF\r\n\x1a\n")
    with pytest.raises(UserError, match=r"version 7\.3\. In MATLAB: x = load"):
        subzero.read_log(tmp_path / "log.mat")


MODULES = {"bin": "pymavlink.DFReader", "tlog": "pymavlink", "ulg": "pyulog", "mcap": "mcap.reader",
           "bag": "rosbags.highlevel", "db3": "rosbags.highlevel"}  # fmt: skip


@pytest.mark.parametrize("ending", MODULES)
def test_without_its_library_a_log_says_what_to_install(ending, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, MODULES[ending], None)
    (tmp_path / f"log.{ending}").write_bytes(b"\xa3\x95")
    with pytest.raises(UserError, match=r"needs .*: pip install 'subzero-auv\[logs\]'"):
        subzero.read_log(tmp_path / f"log.{ending}")


@pytest.mark.parametrize("ending", MODULES)
def test_what_is_no_such_log_is_one_message(ending, tmp_path, capfd):
    pytest.importorskip(MODULES[ending])
    (tmp_path / f"log.{ending}").write_bytes(b"time_s,depth_m\n0,1\n1,2\n" + bytes(range(256)) * 8)
    with pytest.raises(UserError, match="cannot be imported") as error:
        subzero.read_log(tmp_path / f"log.{ending}")
    assert str(error.value).count("\n") == 0
    assert capfd.readouterr() == ("", "")
