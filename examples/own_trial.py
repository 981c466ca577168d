"""Run a trial of your own, written down in own_trial.toml, and draw how the vehicle moves."""

from pathlib import Path

import subzero

trial = subzero.load_scenario(Path(__file__).with_name("own_trial.toml"))
run = subzero.simulate(trial)

print(run.attrs["outcome_message"])
print(f"depth at the end: {float(run['depth'][-1]):.2f} m")
print(f"cable in the water at the end: {float(run['cable_length'][-1]):.1f} m")
for warning in subzero.warnings_of(run):
    print("warning:", warning.message)

figure = run.subzero.plot.motion()
figure.savefig("own_trial.png")
