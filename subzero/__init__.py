"""Simulate, compare and understand a tethered underwater vehicle."""
