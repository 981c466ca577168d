"""Run one trial with several lengths of cable and currents, and draw what they do to its peak speed."""

import matplotlib.pyplot as plt

import subzero


def main():
    """Sweep six members: in a function, because worker processes import this file."""
    values = {"start.wet_length_m": [0.0, 20.0, 40.0], "water.current_east_m_s": [0.0, 0.1]}
    runs = subzero.sweep("fig6", values, changes={"run.duration_s": 20.0}, workers=1)
    print(runs)

    grid = runs.set_index(member=list(values)).unstack()
    figure, axes = plt.subplots(layout="constrained")
    for current in grid["water.current_east_m_s"].values:
        peaks = grid["peak_speed_m_s"].sel({"water.current_east_m_s": current})
        axes.plot(peaks["start.wet_length_m"], peaks, "o-", label=f"{current:g} m/s")
    axes.set(xlabel="cable in the water at the start [m]", ylabel="peak speed [m/s]")
    axes.legend(title="current to the east")
    axes.grid(alpha=0.3)
    figure.savefig("sweep.png", dpi=150)


if __name__ == "__main__":
    main()
