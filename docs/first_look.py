# A notebook: pip install "subzero-auv[notebook]", then "marimo edit first_look.py" (or "marimo run", or plain "python").
# It is a Python file, so that its history can be read; tests/cli/test_notebook.py carries out every cell.

import marimo

app = marimo.App(width="medium", app_title="subzero: a first look")


@app.cell
def _():
    import marimo as mo
    import numpy as np

    import subzero

    mo.md(
        """
        # A first look

        Subzero II pulls a thin cable off a drum on the shore. This notebook simulates the trial of Fig. 6 of Feng and
        Allen (2004), changes it, looks along the cable, and asks what is wrong with a vehicle from its log. Change a
        number, and all that depends on it is computed again.
        """
    )
    return mo, np, subzero


@app.cell
def _(mo):
    mo.md("""## With the cable and without""")
    return


@app.cell
def _(subzero):
    comparison = subzero.compare("fig6")
    comparison
    return (comparison,)


@app.cell
def _(comparison, subzero):
    subzero.draw(comparison.runs)["fig6"]
    return


@app.cell
def _(mo):
    mo.md(
        """
        ## A changed trial

        20 m of cable lie in the water from the start: the vehicle is slower from the beginning. `with_changes` checks a
        value as the file reader does; any number of the trial, its vehicle and its cable can be changed
        (`subzero show fig6` lists them).
        """
    )
    return


@app.cell
def _():
    wet_length = 20.0  # [m]
    return (wet_length,)


@app.cell
def _(comparison, subzero, wet_length):
    changed = subzero.simulate(subzero.load_scenario("fig6").with_changes({"start.wet_length_m": wet_length}))
    peaks = {
        "without wet cable": float(comparison.tethered["surge_speed"].max()),
        f"with {wet_length:g} m": float(changed["surge_speed"].max()),
    }
    peaks  # [m/s]
    return changed, peaks


@app.cell
def _(mo):
    mo.md(
        """
        ## Along the cable

        A run is an `xarray.Dataset`: `changed["cable_node_tension"]` has `arc_length` as its coordinate. The accessor
        draws what one wants to see first.
        """
    )
    return


@app.cell
def _(changed):
    changed.subzero.plot.tension()
    return


@app.cell
def _(mo):
    mo.md(
        """
        ## What is wrong with this vehicle?

        A log: the same trial with a propeller that gives 28 % more thrust, as noisy sensors would show it. The diagnosis
        does not know the change. (`budget="verdict"` takes some ten seconds; without it there are a gain on data
        that were not fitted and a next trial, too, as `subzero diagnose` has them.)
        """
    )
    return


@app.cell
def _(np, subzero):
    trial = subzero.load_scenario("fig6")
    true = subzero.simulate(trial.with_changes({"vehicle.propeller.thrust_constant": 0.47}))  # the model has 0.366
    noise = {"surge_speed": 0.015, "heading": 0.4, "yaw_rate": 0.3, "pitch": 0.2, "roll_angle": 0.3, "depth": 0.015}
    time, rng = np.arange(0.0, 30.0, 0.1), np.random.default_rng(1)
    log = subzero.Record(
        source="a log",
        time=time,
        values={name: np.interp(time, true["time"], true[name]) + sd * rng.normal(size=time.size)
                for name, sd in noise.items()},
    )
    return (log,)


@app.cell
def _(log, subzero):
    verdict = subzero.diagnose(log, "fig6", budget="verdict")
    verdict
    return (verdict,)


if __name__ == "__main__":
    app.run()
