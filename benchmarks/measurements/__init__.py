"""The cable against measurements: measured, computed, error.

python -m benchmarks.measurements          # all of it, 20 s; keeps the numbers, writes docs/measurements.md and README
python -m benchmarks.measurements --page   # writes both from the numbers of the last run
"""
