"""The cable against measurements: measured, computed, error.

python -m benchmarks.measurements            # everything, half a minute; writes docs/measurements.md
python -m benchmarks.measurements --print    # writes nothing
"""
