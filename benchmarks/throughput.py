"""How many steps a second: the vehicle alone, and with a cable of 25 to 200 segments, on one core and on all.

    python -m benchmarks.throughput                  # all tables: some minutes
    python -m benchmarks.throughput --repeats 3
    python -m benchmarks.throughput --learning       # only the last one, of the Gymnasium environment

A step is an exchange of vehicle and cable, 0.1 s with five steps of the hull in it, results of all steps kept; a run is
thirty seconds of fig6, with cable in the water at the start. Many runs at once are `subzero.simulate_many`: threads of
one process, for compiled code lets go of Python's lock. What is done on one core is told in the time of the processor,
what is done on all in the time of the clock: others who use the machine spoil the second only. Medians; ratios are of
one run of this command. Everything is compiled beforehand.
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import statistics
import time
from functools import partial

import numpy as np

import subzero
from benchmarks.peers import numpy_hull
from benchmarks.tether import counting_gain
from subzero.simulation.stepper import SteppingGroup

SEGMENTS = (0, 25, 50, 100, 200)
PAID_OUT = 28
"""Segments that fig6 pays out, in the mean over its run. [-]"""
RUNS = 8
"""At a time: so many for each thread that none waits long for another. [-]"""
LONG_S, SLOW_S, FINEST_S = 600.0, 2.0, 0.005
HULL_STEPS_S = (0.02, 0.05, 0.1)
BATCH = 16
ENVIRONMENTS, ENVIRONMENT_STEPS = 16, {0.1: 100, 1.0: 10, 5.0: 2}
"""How many; sample time of a step [s] → steps of each."""


def median(run, repeats, clock=time.process_time):
    """Return the median of the time that a call takes, behind one that is not counted. [s]"""
    run()
    times = []
    for _ in range(repeats):
        started = clock()
        run()
        times.append(clock() - started)
    return statistics.median(times)


def table(title, head, rows):
    """Print a Markdown table as its rows come."""
    print(f"\n### {title}\n\n| " + " | ".join(head) + " |\n" + "|---" * len(head) + "|")
    for row in rows:
        print("| " + " | ".join(row) + " |", flush=True)


def short_trial(segments):
    """Return fig6 with so many segments of cable in the water in the mean, about, and no coarser runs beside it."""
    fig6 = subzero.load_scenario("fig6")
    wet = max(segments - PAID_OUT, 0) * fig6.segment_length
    return dataclasses.replace(
        fig6, start=dataclasses.replace(fig6.start, wet_length=wet), far_grading=0.0, rtol=0.0
    )


def steps(repeats):
    """Yield rows: steps a second."""
    cores = os.cpu_count()
    for segments in SEGMENTS:
        trial, tethered = short_trial(segments), segments > 0
        mean = (
            float(subzero.simulate(trial, tethered=tethered)["node_count"].mean()) - 1.0 if tethered else 0.0
        )
        count = RUNS * round(trial.duration / trial.cable_step)
        many = partial(subzero.simulate_many, [trial] * RUNS, tethered=tethered)
        one = median(partial(many, workers=1), repeats)
        alone, both = (median(partial(many, workers=n), repeats, time.perf_counter) for n in (1, cores))
        yield (
            f"{mean:.0f}" if tethered else "vehicle alone", f"{count / one:,.0f}", f"{1e6 * one / count:.0f}",
            f"{count / both:,.0f}", f"{alone / both:.2f}",
        )  # fmt: skip


def long_trial(hull_step):
    """Return ten minutes of fig6's vehicle."""
    fig6 = subzero.load_scenario("fig6")
    return dataclasses.replace(fig6, duration=LONG_S, hull_step=hull_step)


def error_of(run, exact):
    """Return the largest error of track, speeds and heading, each as a share of its own largest value."""
    names = ("north", "east", "depth", "surge_speed", "sway_speed", "heading")
    return max(float(np.abs(run[name] - exact[name]).max() / np.abs(exact[name]).max()) for name in names)


def hull(repeats):
    """Yield rows: the vehicle alone through the public call."""
    exact = subzero.simulate(long_trial(FINEST_S), tethered=False)
    for step in HULL_STEPS_S:
        trial = long_trial(step)
        error = error_of(subzero.simulate(trial, tethered=False), exact)
        alone = median(partial(subzero.simulate, trial, tethered=False), repeats)
        batch = median(partial(subzero.simulate_many, [trial] * BATCH, tethered=False), repeats)
        yield (
            f"{step:g}",
            f"{error:.1e}",
            f"{1e3 * alone / LONG_S:.3f}",
            f"{1e3 * batch / BATCH / LONG_S:.3f}",
        )


def plain(repeats):
    """Yield rows: the same right-hand side in NumPy, as many steps of the same scheme."""
    from vehicle import free_run, initial_state

    numbers = subzero.Model.of(subzero.load_scenario("fig6")).vehicle.numbers()
    state, command, h = initial_state(velocity=(0.5, 0, 0, 0, 0, 0)), np.array([25.0, 0.05, 0.0, 0.0]), 0.02
    count = round(SLOW_S / h)
    slow = median(lambda: numpy_hull.rk4(state, command, numbers, count, h), repeats) / SLOW_S
    quick = median(lambda: free_run(numbers, state, command, LONG_S, h), repeats) / LONG_S
    end = numpy_hull.rk4(state, command, numbers, count, h)[-1]
    apart = np.abs(free_run(numbers, state, command, SLOW_S, h).states[-1] - end).max()
    yield "`vehicle.free_run`, with works", f"{1e3 * quick:.3f}", f"{slow / quick:.0f}", f"{apart:.0e}"
    call = median(lambda: subzero.simulate(long_trial(h), tethered=False), repeats) / LONG_S
    yield "`subzero.simulate`, all channels", f"{1e3 * call:.3f}", f"{slow / call:.0f}", ""
    yield "NumPy", f"{1e3 * slow:.1f}", "1", ""


def median_rate(begin, go, steps, repeats):
    """Return the median of steps a second, by the clock, of calls behind one that is not counted."""
    rates = []
    for _ in range(repeats + 1):
        begin()
        started = time.perf_counter()
        go()
        rates.append(steps / (time.perf_counter() - started))
    return statistics.median(rates[1:])


def environments(sample_time, count, repeats, mode=None, **how):
    """Return steps a second of environments that Gymnasium makes."""
    import gymnasium

    import subzero.gym_environment as ours

    made = gymnasium.make_vec(
        ours.ENVIRONMENT, num_envs=ENVIRONMENTS, vectorization_mode=mode, sample_time=sample_time, **how
    )
    actions = np.zeros((ENVIRONMENTS, 1), dtype=np.float32)

    def go():
        for _ in range(count):
            made.step(actions)

    rate = median_rate(lambda: made.reset(seed=1), go, ENVIRONMENTS * count, repeats)
    made.close()
    return rate


def batch_loop(sample_time, count, repeats, threads):
    """Return steps a second of the same simulators in one compiled call of each thread: no Python between steps."""
    simulators = [subzero.Simulator("fig6", sample_time=count * sample_time) for _ in range(ENVIRONMENTS)]
    group, orders = SteppingGroup(simulators, threads), np.tile([25.0, 0.0, 0.0, 0.0], (ENVIRONMENTS, 1))

    def begin():
        for each in simulators:
            each.reset()

    rate = median_rate(begin, lambda: group.hold(orders), ENVIRONMENTS * count, repeats)
    group.close()
    return rate


def learning(repeats):
    """Yield rows: steps a second of the Gymnasium environment."""
    threads = os.cpu_count()
    for sample_time, count in ENVIRONMENT_STEPS.items():
        sync = environments(sample_time, count, repeats, "sync")
        for name, rate in (
            ("`sync`, Gymnasium's own", sync),
            ("`workers=1`", environments(sample_time, count, repeats, workers=1)),
            (f"`workers={threads}`", environments(sample_time, count, repeats, workers=threads)),
            (f"no environment, {threads} threads", batch_loop(sample_time, count, repeats, threads)),
        ):
            yield f"{sample_time:g}", name, f"{rate:,.0f}", f"{rate / sync:.2f}"


def main():
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--learning", action="store_true")
    asked, cores = parser.parse_args(), os.cpu_count()
    print(f"{cores} cores, load {os.getloadavg()[0]:.1f} before this began, medians of {asked.repeats}")
    if not asked.learning:
        of_runs(asked.repeats, cores)
    head = ("sample time [s]", "`gymnasium.make_vec`", "steps a second", "ratio")
    table(f"{ENVIRONMENTS} environments that learn", head, learning(asked.repeats))
    print(f"\nload {os.getloadavg()[0]:.1f} when it ended; two threads count {counting_gain():.2f} times one")


def of_runs(repeats, cores):
    """Print the tables of runs."""
    head = (
        "segments",
        "steps a second, one core",
        "µs a step",
        f"steps a second, {cores} cores",
        "times one",
    )
    table("Tethered steps a second", head, steps(repeats))
    head = ("hull_step_s", "error", "`simulate`, ms per simulated second", "in a batch, per core")
    table(f"The vehicle alone for {LONG_S:g} s", head, hull(repeats))
    head = (
        "the same right-hand side, steps of 0.02 s",
        "ms per simulated second",
        "times NumPy",
        "end states apart",
    )
    table("Beside NumPy", head, plain(repeats))


if __name__ == "__main__":
    main()
