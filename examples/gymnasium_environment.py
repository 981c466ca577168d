"""Step the Gymnasium environment: hold a new heading, by a simple policy and by chance."""

import gymnasium
import matplotlib.pyplot as plt
import numpy as np

environment = gymnasium.make(
    "subzero.gym_environment:subzero/TetheredHeading-v0"
)  # pip install "subzero-auv[gym]"
rng = np.random.default_rng(1)


def steer(observation):
    """Return the rudder as a share of its limit; the first three numbers are sin e, cos e and the yaw rate."""
    error = np.arctan2(observation[0], observation[1])
    return np.clip([3.0 * error - 2.0 * observation[2]], -1.0, 1.0)


policies = {"proportional": steer, "random": lambda observation: rng.uniform(-1.0, 1.0, 1)}
figure, axes = plt.subplots(layout="constrained")
for name, policy in policies.items():
    observation, info = environment.reset(seed=3)
    times, errors, total, over = [], [], 0.0, False
    while not over:
        observation, reward, terminated, truncated, info = environment.step(
            policy(observation).astype(np.float32)
        )
        times.append(info["time"])
        errors.append(np.degrees(info["wanted_heading"] - info["heading"]))
        total, over = total + reward, terminated or truncated
    axes.plot(times, errors, label=f"{name}: return {total:.2f}")

axes.axhline(0.0, color="black", linewidth=0.8)
axes.set(xlabel="time [s]", ylabel="heading error [°]", title=environment.spec.id)
axes.legend()
figure.savefig("gymnasium_environment.png", dpi=150)
