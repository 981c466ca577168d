"""Export a tether as a functional mock-up unit, and let FMPy swing its first end."""

import matplotlib.pyplot as plt
import numpy as np
from fmpy import simulate_fmu  # pip install "subzero-auv[fmu]" fmpy

import cable
from subzero.fmu import export_fmu

line = cable.CableProperties(mass_per_length=0.02, compliance=1e-4)
path = export_fmu("tether.fmu", length=30.0, cable=line)

times = np.linspace(0.0, 30.0, 301)
rate = 2.0 * np.pi / 6.0
names = ["time", "first_north", "first_down", "first_velocity_north", "pay_out_rate"]
inputs = np.zeros(times.size, dtype=[(name, float) for name in names])
inputs["time"], inputs["first_down"] = times, 8.0
inputs["first_north"] = 27.0 + 1.0 - np.cos(rate * times)
inputs["first_velocity_north"] = rate * np.sin(rate * times)
inputs["pay_out_rate"] = np.where(times > 15.0, 0.1, 0.0)

start = {"first_north": 27.0, "first_down": 8.0}
outputs = ["first_tension", "second_tension", "length"]
run = simulate_fmu(
    path, stop_time=30.0, output_interval=0.1, start_values=start, input=inputs, output=outputs
)

figure, (above, below) = plt.subplots(2, layout="constrained", sharex=True)
above.plot(run["time"], run["first_tension"], label="first end")
above.plot(run["time"], run["second_tension"], "--", label="second end, a winch from 15 s on")
above.set(ylabel="tension [N]")
above.legend(loc="upper right")
below.plot(run["time"], run["length"])
below.set(xlabel="time [s]", ylabel="length [m]")
figure.savefig("tether_fmu.png", dpi=150)
