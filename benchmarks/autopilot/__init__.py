"""Autopilots on the tethered vehicle, in numbers.

    python -m benchmarks.autopilot             measures everything, writes docs/autopilot_measured.md (some minutes)
    python -m benchmarks.autopilot --quick     prints it, with a tenth of the random runs; writes nothing

`trials` says what is flown and what of a run counts, `sections` measures, `__main__` writes the page.
"""
