"""How well a diagnosis finds hidden effects: ``python -m benchmarks.diagnosis`` writes docs/diagnosis_benchmark.md."""
