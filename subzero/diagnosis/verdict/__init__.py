"""From findings to a verdict: decision rule, estimates with intervals, the extended model."""
