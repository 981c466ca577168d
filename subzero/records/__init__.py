"""Measured records: read (`record`), their metadata, time base, units and commands checked, compared with a run."""
