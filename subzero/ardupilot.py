"""A tethered ROV for ArduPilot: ArduSub flies it through the JSON back end of its simulation in the loop (SITL).

    $ python -m subzero.ardupilot --length 40 --depth 5
    $ sim_vehicle.py -v ArduSub -f vectored --model JSON:127.0.0.1        # in another shell

ArduPilot sends its motor outputs over UDP (port 9002), binary; the answer is a line of JSON with time, gyro, specific
force, position, attitude and velocity, north, east, down (ArduPilot, libraries/SITL/examples/JSON/readme.md). Frames
are answered one by one: a repeated frame gets the same answer again, a count that starts anew starts the simulation
anew.

    (M_RB + M_A) ν' = thrusters − C(ν) ν − (D + D₂|ν|) ν + weight and buoyancy + tether        (Fossen, 2011, 6.1)

The ROV is a BlueROV2: mass, added mass, damping and buoyancy of C.-J. Wu (Flinders University, 2018), six thrusters of
40 N as ArduSub's frame "vectored" mixes them. Munk's moment is left out: that of a closed hull with this added mass
would turn it over from 0.5 m/s on, and that of an open frame is not known. Its tether is a `cable.Tether` from the top
of its stern to a drum on a boat; the winch pays out as far as the ROV asks by a constant, small tension, or holds a
fixed length.
"""

from __future__ import annotations

import argparse
import json
import socket
import struct
from dataclasses import dataclass, field

import numpy as np

from cable import Brake, CableProperties, ConstantTension, Tether
from subzero.errors import UserError

PORT = 9002
PACKETS = {18458: struct.Struct("<HHI16H"), 29569: struct.Struct("<HHI32H")}
"""First number of a packet → its layout: magic, frame rate [Hz], frame count, pulses of 16 or 32 motors [µs]."""
GRAVITY = 9.80665
LONGEST_STEP = 0.02
"""A frame takes no longer than this, whatever its rate. [s]"""
STOPPED_US, RANGE_US = 1500.0, 400.0
"""A pulse at which a thruster stands, and how far from there its full thrust is. [µs]"""
THRUST = 40.0
"""Of a thruster at full pulse. [N]"""
ARM, SIDE_ARM = 0.19, 0.11
"""Lever of the four horizontal thrusters about the vertical axis, and of the two vertical ones in roll. [m]"""
SLANT = float(np.sqrt(0.5))
"""The horizontal thrusters stand at 45 degrees. [-]"""
# Rows: surge, sway, heave (down), roll, pitch, yaw; columns: thrusters 1 to 6, their signs as in ArduSub's frame.
MIX = np.array(
    [
        [-SLANT, -SLANT, SLANT, SLANT, 0.0, 0.0],
        [SLANT, -SLANT, SLANT, -SLANT, 0.0, 0.0],
        [0.0, 0.0, 0.0, 0.0, 1.0, 1.0],
        [0.0, 0.0, 0.0, 0.0, SIDE_ARM, -SIDE_ARM],
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        [ARM, -ARM, -ARM, ARM, 0.0, 0.0],
    ]
)
MASS = np.array([11.5, 11.5, 11.5, 0.16, 0.16, 0.16])
ADDED_MASS = np.array([5.5, 12.7, 14.57, 0.12, 0.12, 0.12])
DAMPING = np.array([4.03, 6.22, 5.18, 0.07, 0.07, 0.07])
SQUARE_DAMPING = np.array([18.18, 21.66, 36.99, 1.55, 1.55, 1.55])
WEIGHT, BUOYANCY, METACENTRIC_HEIGHT, HEIGHT = 112.8, 114.8, 0.02, 0.25
"""[N], [N], [m], [m]"""
TOW_POINT = np.array([-0.2, 0.0, -0.1])
"""Where the tether is fastened, in body axes forward, starboard, down. [m]"""
TETHER = CableProperties(
    mass_per_length=0.044,
    cross_section_area=4.4e-5,
    diameter=0.0075,
    normal_drag_coefficient=1.2,
    compliance=2e-5,
)
"""A neutral tether of 7.5 mm, EA = 50 kN."""


@dataclass
class TetheredRov:
    """An ROV on its tether.

    Attributes:
        length: of the tether at the start. [m]
        depth: of the ROV at the start; the drum is above it, at the surface. [m]
        longest: all tether that there is: then a winch gives it at `tension`; None holds the length. [m]
        tension: of that winch. [N]
        current: velocity of the water north, east, down. [m/s]
    """

    length: float = 40.0
    depth: float = 5.0
    longest: float | None = None
    tension: float = 2.0
    current: tuple[float, float, float] = (0.0, 0.0, 0.0)
    time: float = field(init=False, default=0.0)

    def __post_init__(self) -> None:
        """Start."""
        self.reset()

    def reset(self) -> None:
        """Return to the start: at rest and level, heading north."""
        self.position, self.rotation = np.array([0.0, 0.0, self.depth]), np.eye(3)
        self.velocity, self.specific_force = np.zeros(6), np.array([0.0, 0.0, -GRAVITY])
        winch = Brake() if self.longest is None else ConstantTension(tension=self.tension)
        ends = [self.position + TOW_POINT, np.zeros(3)]
        self.tether = Tether(
            TETHER,
            length=self.length,
            ends=ends,
            winch=winch,
            longest=self.longest,
            current=self.current,
            segments=30,
        )
        self.time, self.pull = 0.0, self.tether.forces[0]

    def step(self, pulses: np.ndarray, dt: float) -> None:
        """Go on by dt [s] under the pulses of six thrusters (6,) [µs]."""
        R, nu = self.rotation, self.velocity
        relative = nu - np.concatenate([R.T @ self.current, np.zeros(3)])
        pull = R.T @ self.pull
        lift = BUOYANCY * np.clip(
            0.5 + self.position[2] / HEIGHT, 0.0, 1.0
        )  # less as it comes out of the water
        force = MIX @ (THRUST * np.clip((pulses - STOPPED_US) / RANGE_US, -1.0, 1.0))
        force -= (DAMPING + SQUARE_DAMPING * np.abs(relative)) * relative
        force[:3] += R.T @ [0.0, 0.0, WEIGHT - lift] + pull
        force[3:] += np.cross([0.0, 0.0, -METACENTRIC_HEIGHT], R.T @ [0.0, 0.0, -lift]) + np.cross(
            TOW_POINT, pull
        )
        force[:3] -= np.cross(nu[3:], (MASS[:3] + ADDED_MASS[:3]) * nu[:3])
        force[3:] -= np.cross(nu[3:], (MASS[3:] + ADDED_MASS[3:]) * nu[3:])
        rate = force / (MASS + ADDED_MASS)
        self.velocity = nu + dt * rate
        self.specific_force = rate[:3] + np.cross(nu[3:], nu[:3]) - R.T @ [0.0, 0.0, GRAVITY]
        self.position = self.position + dt * R @ self.velocity[:3]
        self.rotation = R @ turned_by(dt * self.velocity[3:])
        place = self.position + self.rotation @ TOW_POINT
        speed = self.rotation @ (self.velocity[:3] + np.cross(self.velocity[3:], TOW_POINT))
        self.pull = self.tether.step(dt, [(place, speed), (np.zeros(3), np.zeros(3))])[0]
        self.time += dt

    def answer(self) -> bytes:
        """Return the state as ArduPilot reads it: a line of JSON between two line feeds."""
        R = self.rotation
        attitude = (
            np.arctan2(R[2, 1], R[2, 2]),
            -np.arcsin(np.clip(R[2, 0], -1.0, 1.0)),
            np.arctan2(R[1, 0], R[0, 0]),
        )
        state = {
            "timestamp": self.time,
            "imu": {"gyro": self.velocity[3:].tolist(), "accel_body": self.specific_force.tolist()},
            "position": self.position.tolist(),
            "attitude": [float(angle) for angle in attitude],
            "velocity": (R @ self.velocity[:3]).tolist(),
        }
        return f"\n{json.dumps(state)}\n".encode("ascii")


def turned_by(angle: np.ndarray) -> np.ndarray:
    """Return the rotation by a vector (3,) [rad], by Rodrigues' formula."""
    size = float(np.linalg.norm(angle))
    x, y, z = angle
    K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    first, second = (np.sin(size) / size, (1.0 - np.cos(size)) / size**2) if size > 1e-9 else (1.0, 0.5)
    rotation: np.ndarray = np.eye(3) + first * K + second * K @ K
    return rotation


class Server:
    """Answers ArduPilot's frames, one by one.

    Attributes:
        rov: the vehicle.
        address: where it listens, (host, port).
    """

    def __init__(self, rov: TetheredRov, host: str = "127.0.0.1", port: int = PORT) -> None:
        """Open the port; 0 takes a free one.

        Raises:
            UserError: the port is in use.
        """
        self.rov, self._frame = rov, -1
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((host, port))
        except OSError as error:
            self._socket.close()
            raise UserError(
                f"UDP port {port} of {host} cannot be opened: {error.strerror}. Give another --port."
            ) from None
        self.address: tuple[str, int] = self._socket.getsockname()

    def reply(self, packet: bytes) -> bytes | None:
        """Return the answer to a packet; None to one that is not of ArduPilot."""
        magic = int.from_bytes(packet[:2], "little")
        layout = PACKETS.get(magic)
        if layout is None or len(packet) != layout.size:
            return None
        _, rate, frame, *pulses = layout.unpack(packet)
        if frame < self._frame:
            self.rov.reset()
        if frame != self._frame:
            self.rov.step(np.array(pulses[:6], dtype=float), min(1.0 / max(rate, 1), LONGEST_STEP))
        self._frame = frame
        return self.rov.answer()

    def serve(self, frames: int | None = None) -> None:
        """Answer packets, for ever or so many."""
        while frames is None or frames > 0:
            packet, sender = self._socket.recvfrom(256)
            answer = self.reply(packet)
            if answer is not None:
                self._socket.sendto(answer, sender)
                frames = None if frames is None else frames - 1

    def close(self) -> None:
        """Close the port."""
        self._socket.close()


def main() -> None:
    """Serve until Ctrl-C."""
    parser = argparse.ArgumentParser(prog="python -m subzero.ardupilot", description=__doc__.splitlines()[0])
    parser.add_argument("--port", type=int, default=PORT)
    parser.add_argument("--length", type=float, default=40.0, help="of the tether at the start [m]")
    parser.add_argument("--depth", type=float, default=5.0, help="of the ROV at the start [m]")
    parser.add_argument(
        "--longest", type=float, help="all tether: a winch gives it at a small, constant tension [m]"
    )
    given = parser.parse_args()
    server = Server(TetheredRov(given.length, given.depth, given.longest), port=given.port)
    print(f"Waiting for ArduPilot at UDP port {server.address[1]}. Ctrl-C ends it.")
    try:
        server.serve()
    except KeyboardInterrupt:
        server.close()


if __name__ == "__main__":
    main()
