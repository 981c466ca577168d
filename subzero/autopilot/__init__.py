"""From the vehicle to its autopilot: trim, linear models, plants for python-control, sensors, controllers.

    >>> import subzero
    >>> from subzero import autopilot
    >>> model = subzero.Model.of(subzero.load_scenario("fig6"))
    >>> steady = autopilot.trim(model, speed=1.0, wet_length=20.0)
    >>> steady.propeller_rps, steady.command            # what holds 1 m/s on 20 m of cable
    >>> linear = autopilot.linearise(model, steady)     # a control.StateSpace with names
    >>> yaw = autopilot.subsystem(linear, "yaw_sway")
    >>> autopilot.modes(yaw, steady)                    # poles, damping, in the time scale L/U
    >>> along = autopilot.linearise_along("fig6")       # about a run, the cable growing: along.respond(deviations)

Everything is SI and radians, propeller speeds are in rev/s; names and signs are those of `subzero.channels`. Speeds
are through the water. Names come from their modules when they are first used: python-control loads only then.

    >>> hull = autopilot.plant(model)                     # a control.NonlinearIOSystem; tethered=True: with the cable
    >>> trial = subzero.load_scenario("fig6")
    >>> pilot = autopilot.make("lqr", trial, feed_forward="model")
    >>> run = autopilot.fly(trial, pilot, lambda t: autopilot.Wanted(speed=1.0, heading=0.5, depth=1.0))

symbol       name                                    unit        file
-----------  --------------------------------------  ----------  ---------------------
x, u         states and inputs of a plant            SI          hull_state_space
F_c          force of the cable in steady motion     N           steady_pull
x₀, u₀       trim: steady state and its command      SI          trim_point
A, B, C, D   linear model about it                   SI          linear, cable_modes
A_k, B_k     linear model along a run                SI          along
λ L/U, ζ     poles in the vehicle's time scale       1           linear
k, k_I       feedback and integral gains             SI          design
δ_ff         feed-forward, against hull and cable    SI          standard

`hull_state_space`, `trim_point` and `trim` stand in `subzero.steady_motion`: a run may start in trim.
"""

from importlib import import_module
from typing import Any

_NAMES = {
    "subzero.autopilot.along": "Along linearise_along",
    "subzero.autopilot.coupled_plant": "Discretisation plant",
    "subzero.autopilot.design": "Gains Schedule WEIGHTS Weights design_gains reduced with_weights",
    "subzero.autopilot.estimator": "EstimatorLoop estimates",
    "subzero.autopilot.feed_forward": "CableModel FormulaCable NoCable TwinCable",
    "subzero.autopilot.flight": "Autopilot AutopilotError AutopilotWarning fly",
    "subzero.autopilot.linear": "Mode SUBSYSTEMS linearise modes subsystem",
    "subzero.autopilot.loops": "Law Loop",
    "subzero.autopilot.manoeuvres": "MANOEUVRES manoeuvre",
    "subzero.autopilot.registry": "AUTOPILOTS FEED_FORWARD make",
    "subzero.autopilot.sensors": "ESTIMATED PERFECT Sensor Sensors",
    "subzero.autopilot.stability_margins": "Margins loop_margins margins",
    "subzero.autopilot.standard": "StandardAutopilot Wanted",
    "subzero.autopilot.steps": "Pilot STEPS step",
    "subzero.autopilot.tuning": "Tuning tune",
    "subzero.steady_motion.asked": "NoTrimError",
    "subzero.steady_motion.hull_state_space": "INPUTS STATES UNITS",
    "subzero.steady_motion.trim": "station_trim trim",
    "subzero.steady_motion.trim_point": "Trim",
}
"""Module → its public names; no module of this package may be called like one of them."""

_HOME = {name: module for module, names in _NAMES.items() for name in names.split()}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Fetch a public name from its module, once."""
    if name not in _HOME:
        raise AttributeError(
            f"module 'subzero.autopilot' has no attribute '{name}'; it has {', '.join(__all__)}"
        )
    value = getattr(import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
