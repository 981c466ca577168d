"""Did a change make it slower? Four costs, with pytest-benchmark (extra ``[bench]``); no part of the default tests.

    pytest benchmarks/regression.py --benchmark-save=before
    pytest benchmarks/regression.py --benchmark-compare --benchmark-compare-fail=median:10%

Runs in this process are told in the time of the processor, the sweep, which has processes of its own, by the clock: so
that row says something on an idle machine only. Everything is loaded or compiled beforehand.
"""

import time

import pytest

import subzero
from benchmarks.sweep import plan
from benchmarks.throughput import long_trial, short_trial
from subzero.simulation.run import run_trial

pytest.importorskip("pytest_benchmark")
in_processor_time = pytest.mark.benchmark(timer=time.process_time)
ROUNDS = 11
SWEEP_OF, SWEEPS = 20, 3


def take(benchmark, trial, *, tethered=True):
    """Measure the compiled run of a trial with steps and segments as they are, and demand that it reached its end."""
    model = subzero.Model.of(trial)
    run = benchmark.pedantic(
        run_trial, (trial, model), {"tethered": tethered}, rounds=ROUNDS, warmup_rounds=1
    )
    assert run.completed


@in_processor_time
def test_fig6_with_cable(benchmark):
    """Thirty seconds, 300 exchanges, 28 segments in the mean."""
    take(benchmark, subzero.load_scenario("fig6"))


@in_processor_time
def test_the_hull_alone(benchmark):
    """Ten minutes in the shipped steps of 0.02 s."""
    take(benchmark, long_trial(0.02), tethered=False)


@in_processor_time
def test_exchanges_with_200_nodes(benchmark):
    """300 exchanges with about so many nodes."""
    take(benchmark, short_trial(200))


def test_a_sweep_of_20(benchmark):
    """From the call to the dataset, processes included."""
    members = plan(SWEEP_OF)
    runs = benchmark.pedantic(subzero.sweep, (members,), rounds=SWEEPS, warmup_rounds=1)
    assert not runs["failed"].any()
