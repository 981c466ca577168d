"""What a tether costs that a host steps: ``python -m benchmarks.tether [--repeats 5]``.

    step         a step of 0.1 s at 30, 100 and 300 segments, both ends moving, called by Python; target 110 µs at 100
    state        save and restore, and what 100 000 of these cycles leave in memory; target: nothing
    threads      200 tethers stepped in turn, and on two threads; target: two cores do 1.6 times as much as one. A loop
                 that only counts, on the same threads, says what the machine has to give just then
    snap         the largest pull on a mass that comes to the end of its tether, against v√(M·EA/L)
    steps        how far the forces at host steps of 0.01, 0.1 and 0.5 s are from those of fine ones

Times are of the processor, medians; those of threads of the clock, so others who use the machine spoil them.
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import psutil

import cable
from subzero.jit import compiled

ELASTIC = cable.CableProperties(mass_per_length=0.006, compliance=1e-4)
STEPS, STEP_S = 400, 0.1
TARGET_US = 110.0
CYCLES, TETHERS, COUNTED = 100_000, 200, 50_000_000
CURRENT = (0.1, 0.1, 0.0)


def ends_at(time_s: float, rate: float = 0.785) -> np.ndarray:
    """Return the states of both ends: a vehicle that swings and a boat that heaves, from rest on."""
    phase, rate = (
        (0.25 * rate * time_s**2, 0.5 * rate * time_s) if time_s < 2.0 else (rate * (time_s - 1.0), rate)
    )
    s, c = np.sin(phase), np.cos(phase)
    vehicle = (25.0 + 0.5 * s, 0.5 * (1.0 - c), 10.0), (0.5 * rate * c, 0.5 * rate * s, 0.0)
    boat = (0.0, 0.0, 0.3 * s), (0.0, 0.0, 0.3 * rate * c)
    return np.array([vehicle, boat])


def tether_of(segments: int, rtol: float = 0.0) -> cable.Tether:
    return cable.Tether(
        ELASTIC, length=30.0, ends=ends_at(0.0), segments=segments, current=CURRENT, rtol=rtol
    )


def step_cost(segments: int, repeats: int, rtol: float) -> tuple[float, float]:
    """Return the time of a step [µs], and how many inner steps it took."""
    ends, times, tether = [ends_at(STEP_S * k) for k in range(1, STEPS + 1)], [], tether_of(segments, rtol)
    for _ in range(repeats):
        tether = tether_of(segments, rtol)
        tether.step(STEP_S, ends[0])
        start = time.process_time()
        for states in ends[1:]:
            tether.step(STEP_S, states)
        times.append(1e6 * (time.process_time() - start) / (STEPS - 1))
    return statistics.median(times), tether.inner_steps / STEPS


def show_steps(repeats: int) -> None:
    print("segments   step [µs]   inner steps   with the default rtol [µs]   inner steps")
    for segments in (30, 100, 300):
        (plain, inner), (checked, more) = (
            step_cost(segments, repeats, rtol) for rtol in (0.0, cable.tether.RTOL)
        )
        ratio = f"   {plain / TARGET_US:.2f} of the target" if segments == 100 else ""
        print(f"{segments:8d}{plain:12.1f}{inner:14.2f}{checked:29.1f}{more:14.2f}{ratio}")


def show_states() -> None:
    tether, process = tether_of(100), psutil.Process()
    for k in range(1, 20):
        tether.step(STEP_S, ends_at(STEP_S * k))
    for _ in range(1000):
        tether.restore(tether.save())
    before, start = process.memory_info().rss, time.process_time()
    for _ in range(CYCLES):
        tether.restore(tether.save())
    cost, grown = (time.process_time() - start) / CYCLES, process.memory_info().rss - before
    print(
        f"\n{CYCLES} cycles of save and restore, 100 segments: {1e6 * cost:.1f} µs each, {grown / 1024:.0f} kB more"
    )


def stepped(tether: cable.Tether, ends: list[np.ndarray]) -> np.ndarray:
    return np.array([tether.step(STEP_S, states) for states in ends])


@compiled
def count_up(n: int) -> float:
    """Return a sum of n terms: work that needs neither memory nor Python's lock."""
    total = 0.0
    for i in range(n):
        total += 1e-3 * (i % 7)
    return total


def counting_gain() -> float:
    """Return how much more two threads count than one, in the same time."""
    count_up(1)
    with ThreadPoolExecutor(2) as pool:
        start = time.perf_counter()
        list(map(count_up, [COUNTED] * 4))
        middle = time.perf_counter()
        list(pool.map(count_up, [COUNTED] * 4))
        return (middle - start) / (time.perf_counter() - middle)


def show_threads(repeats: int) -> None:
    gain = statistics.median(counting_gain() for _ in range(repeats))
    print(
        f"\n{TETHERS} tethers, 20 steps each, {os.cpu_count()} cores; a loop that counts: {gain:.2f} times one thread"
    )
    for segments in (50, 100, 300):
        ratios, busy, ends = [], [], [ends_at(STEP_S * k) for k in range(1, 21)]
        first = [tether_of(segments) for _ in range(TETHERS)]
        states = [tether.save() for tether in first]
        with ThreadPoolExecutor(2) as pool:
            for _ in range(repeats):
                start = time.perf_counter()
                in_turn = [stepped(tether, ends) for tether in first]
                middle = time.perf_counter()
                for tether, state in zip(first, states, strict=True):
                    tether.restore(state)
                again, spent = time.perf_counter(), time.process_time()
                at_once = list(pool.map(stepped, first, [ends] * TETHERS))
                clock = time.perf_counter() - again
                ratios.append((middle - start) / clock)
                busy.append((time.process_time() - spent) / clock)
                for tether, state in zip(first, states, strict=True):
                    tether.restore(state)
        same = all(np.array_equal(one, other) for one, other in zip(in_turn, at_once, strict=True))
        print(
            f"{segments:8d} segments: {statistics.median(ratios):.2f} times one thread, {max(ratios):.2f} at best, "
            f"{statistics.median(busy):.2f} cores busy; same bits: {same}"
        )


def snap(EA: float, mass: float, speed: float, length: float, dt: float) -> tuple[float, float]:
    """Return the largest pull [N] on a drifting mass, by the velocity Verlet method, and the processor time [s]."""
    elastic, rest = cable.CableProperties(compliance=1.0 / EA), np.zeros(3)
    tether = cable.Tether(elastic, length=length, ends=[(length - 2.0, 0.0, 0.0), rest])
    x, v, pull, largest, start = length - 2.0, speed, 0.0, 0.0, time.process_time()
    while v > 0.0:
        a = -pull / mass
        x += dt * v + 0.5 * dt * dt * a
        pull = -tether.step(dt, [((x, 0.0, 0.0), (v + dt * a, 0.0, 0.0)), (rest, rest)])[0, 0]
        v += 0.5 * dt * (a - pull / mass)
        largest = max(largest, pull)
    return largest, time.process_time() - start


def show_snaps() -> None:
    print(
        "\nEA [N]   mass [kg]   speed [m/s]   length [m]   host step [s]   peak [N]   v√(M·EA/L) [N]   ratio   CPU [s]"
    )
    for EA, mass, speed, length in (
        (1e3, 40.0, 0.85, 12.0), (1e4, 40.0, 0.85, 12.0), (1e5, 40.0, 0.85, 12.0), (1e6, 40.0, 0.85, 12.0),
        (1e4, 40.0, 0.5, 30.0), (1e5, 12.0, 1.5, 20.0), (1e6, 200.0, 0.5, 40.0),
    ):  # fmt: skip
        exact, period = speed * np.sqrt(mass * EA / length), 2.0 * np.pi * np.sqrt(mass * length / EA)
        for share in (40.0, 200.0):
            dt = float(period / share)
            peak, cost = snap(EA, mass, speed, length, dt)
            print(
                f"{EA:6.0e}{mass:12.0f}{speed:14.2f}{length:13.0f}{dt:16.4f}{peak:11.1f}{exact:17.1f}"
                f"{peak / exact:8.3f}{cost:10.2f}"
            )


def show_step_sizes() -> None:
    def driven(dt: float, rtol: float) -> np.ndarray:
        tether = tether_of(50, rtol)
        return np.array([tether.step(dt, ends_at(k * dt)) for k in range(1, round(10.0 / dt) + 1)])

    fine = driven(0.01, 1e-4)
    largest = np.linalg.norm(fine, axis=2).max()
    print(
        f"\nhost step [s]   largest and median difference of a force, as shares of the largest ({largest:.2f} N)"
    )
    for dt in (0.01, 0.1, 0.5):
        every = round(dt / 0.01)
        gaps = np.linalg.norm(driven(dt, cable.tether.RTOL) - fine[every - 1 :: every], axis=2) / largest
        print(f"{dt:13.2f}{gaps.max():12.4f}{np.median(gaps):12.5f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--repeats", type=int, default=5)
    repeats = parser.parse_args().repeats
    show_steps(repeats)
    show_states()
    show_threads(repeats)
    show_snaps()
    show_step_sizes()


if __name__ == "__main__":
    main()
