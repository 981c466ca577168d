"""Other codes on what they share with ours, and one table of all of them: `python -m benchmarks.peers`."""
