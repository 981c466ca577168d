"""ArduPilot's JSON back end: an exchange over loopback with a tethered ROV, packet by packet.

Verifies: `subzero.ardupilot` against the protocol (ArduPilot, libraries/SITL/examples/JSON/readme.md), and signs.
Configuration: packets as SITL packs them, `<HHI16H` and `<HHI32H`, 50 frames a second, with the pulses of ArduSub's
frame "vectored": forward is 1 and 2 below, 3 and 4 above 1500 µs. Tolerance: signs and rests only.
"""

import json
import socket
import struct
import threading

import numpy as np
import pytest

from subzero.ardupilot import GRAVITY, Server, TetheredRov
from subzero.errors import UserError

STOPPED = [1500] * 16
FORWARD = [1100, 1100, 1900, 1900, 1500, 1500] + [1500] * 10
DOWN = [1500] * 4 + [1900, 1900] + [1500] * 10
RIGHT = [1700, 1300, 1300, 1700, 1500, 1500] + [1500] * 10
STARBOARD = [1900, 1100, 1900, 1100, 1500, 1500] + [1500] * 10


def packet(frame, pulses, rate=50, magic=18458):
    """Return a frame as SITL sends it."""
    return struct.pack(f"<HHI{len(pulses)}H", magic, rate, frame, *pulses)


def flown(pulses, frames, **rov):
    """Return the answers to frames with the same pulses, without a socket."""
    server = Server(TetheredRov(**rov), port=0)
    try:
        return [json.loads(server.reply(packet(frame, pulses))) for frame in range(frames)], server.rov
    finally:
        server.close()


def test_an_exchange_over_loopback():
    """Frames, one of them twice, one that is not ArduPilot's, one of 32 motors, and a restart."""
    server = Server(TetheredRov(), port=0)
    frames = [packet(k, FORWARD) for k in range(1, 6)]
    sent = [*frames, frames[-1], packet(6, [*FORWARD, *STOPPED], magic=29569), packet(0, STOPPED)]
    thread = threading.Thread(target=server.serve, args=(len(sent),), daemon=True)
    thread.start()
    answers = []
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as client:
        client.settimeout(60.0)
        client.sendto(b"something else", server.address)
        client.sendto(packet(1, STOPPED, magic=1), server.address)
        for each in sent:
            client.sendto(each, server.address)
            answers.append(client.recv(4096))
    thread.join(60.0)
    server.close()
    assert all(answer.startswith(b"\n{") and answer.endswith(b"}\n") for answer in answers)
    found = [json.loads(answer) for answer in answers]
    assert all(set(one) == {"timestamp", "imu", "position", "attitude", "velocity"} for one in found)
    assert all(set(one["imu"]) == {"gyro", "accel_body"} for one in found)
    assert [one["timestamp"] for one in found] == pytest.approx(
        [0.02, 0.04, 0.06, 0.08, 0.1, 0.1, 0.12, 0.02]
    )
    assert found[4] == found[5]
    assert found[6]["velocity"][0] > found[4]["velocity"][0] > 0.0


def test_a_rov_at_rest_feels_gravity_and_stays_upright():
    found, _ = flown(STOPPED, 100)
    assert found[0]["imu"]["accel_body"] == pytest.approx([0.0, 0.0, -GRAVITY], abs=0.3)
    assert np.abs(found[-1]["attitude"][:2]).max() < 0.1
    assert found[-1]["position"][2] < 5.0, "it is a little buoyant, and rises"


def test_pulses_move_it_as_ardusub_means_them():
    assert flown(FORWARD, 50)[0][-1]["velocity"][0] > 0.5
    assert flown(DOWN, 50)[0][-1]["velocity"][2] > 0.3
    assert flown(RIGHT, 50)[0][-1]["imu"]["gyro"][2] > 0.1
    assert flown(STARBOARD, 50)[0][-1]["velocity"][1] > 0.3


def test_the_tether_holds_it_at_its_length_and_is_longer_on_a_winch():
    """Full ahead for 25 s: it comes to 20 m, within the sag of the drag and the strain; with a winch it goes on."""
    found, rov = flown(FORWARD, 1250, length=20.0)
    reach = max(np.linalg.norm(one["position"]) for one in found)
    assert 18.0 < reach < 20.6
    assert np.linalg.norm(rov.pull) > 20.0
    assert rov.pull @ rov.position < 0.0
    free, rov = flown(FORWARD, 1250, length=20.0, longest=200.0)
    assert np.linalg.norm(free[-1]["position"]) > 22.0
    assert rov.tether.length > 22.0


def test_a_port_in_use_is_refused():
    first = Server(TetheredRov(), port=0)
    try:
        with pytest.raises(UserError, match="port"):
            Server(TetheredRov(), port=first.address[1])
    finally:
        first.close()
