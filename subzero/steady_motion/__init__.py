"""Steady motion of a vehicle on its cable: what holds a speed, a depth rate and a turn, and what the cable pulls then.

`trim_point` finds it from the seven equations of `equilibrium`, in the states and inputs of `hull_state_space`, with
`actuators` that command and follow, and a cable that pulls as `steady_cable_force` says. A run may start there
(``at_trim``), so this stands below the simulation; `subzero.autopilot` makes linear models about it.
"""
