"""The engine of a run: vehicle and cable in one compiled loop.

In reading order: `initial_conditions` puts together the constants and the state of a run, from a trial and a model
(`environment`: water, drum and winch; `prescribed_motion`: a motion as a table), also where another model takes over
in mid-run. `time_loop` goes from one recorded time to the next; in each, `coupling` lets hull and cable agree on the
tow force, `vehicle_step` takes the hull through it, and `energy` books where the work went. `recording` keeps the rows.

The values that all of them share stand below: `subzero.model`, `subzero.engine.run_state`, `subzero.external_force`.
"""
