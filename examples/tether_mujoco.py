"""Let a drone of MuJoCo climb and drift on a tether from a winch on the ground, in a breeze."""

import matplotlib.pyplot as plt
import mujoco  # pip install mujoco
import numpy as np

import cable

MASS, GRAVITY, DT = 2.0, 9.81, 0.01  # kg, m/s², s
DRONE = f"""<mujoco><option timestep="{DT}" gravity="0 0 -{GRAVITY}"/><worldbody><body name="drone" pos="0.5 0 1">
<freejoint/><geom type="box" size="0.2 0.2 0.05" mass="{MASS}"/></body></worldbody></mujoco>"""
FLIP = np.array([1.0, -1.0, -1.0])  # of MuJoCo z is up, of a cable it is down
stretch = {"compliance": 1e-3, "internal_damping": 2.0}  # of a light line that a light host pulls [1/N, N s]
line = cable.CableProperties(water_density=1.2, mass_per_length=0.02, diameter=0.003, **stretch)
model = mujoco.MjModel.from_xml_string(DRONE)
data = mujoco.MjData(model)
tether = cable.Tether(
    line,
    segment_length=0.5,
    ends=[data.qpos[:3] * FLIP, (0.0, 0.0, 0.0)],
    current=(2.0, 0.0, 0.0),
    winch=cable.ConstantTension(tension=1.0),
)

history = []
while tether.time < 20.0:
    away = np.array([5.0, 0.0, min(1.0 + tether.time, 10.0)]) - data.qpos[:3]
    thrust = MASS * (2.0 * away - 3.0 * data.qvel[:3] + (0.0, 0.0, GRAVITY))
    data.xfrc_applied[1, :3] = thrust + tether.forces[0] * FLIP
    mujoco.mj_step(model, data)
    tether.step(DT, [(data.qpos[:3] * FLIP, data.qvel[:3] * FLIP), np.zeros((2, 3))])
    history.append((tether.time, *np.linalg.norm(tether.forces, axis=1)))

figure, (above, below) = plt.subplots(2, layout="constrained", figsize=(6.4, 7.0))
above.plot(np.array(history)[:, 0], np.array(history)[:, 1:], label=["at the drone", "at the winch"])
above.set(xlabel="time [s]", ylabel="force of the tether [N]")
above.legend()
below.plot(*(tether.shape * FLIP)[:, [0, 2]].T)
below.set(xlabel="downwind of the winch [m]", ylabel="height [m]", title="shape at the end")
figure.savefig("tether_mujoco.png", dpi=150)
