"""Steady motion of a vehicle on its cable: what holds a speed, a depth rate and a turn, and what the cable pulls then.

`trim_point` solves the seven equations of equilibrium, with a formula for the cable's force, in the states and inputs
of `hull_state_space`. A run may start there (``at_trim``), so this stands below the simulation. `trim` also knows the
cable itself; `subzero.autopilot` makes linear models about it.
"""
