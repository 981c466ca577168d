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
-----------  --------------------------------------  ----------  ----------
x, u         states and inputs of a plant            SI          states
F_c          pull of the cable in steady motion      N           pull
x₀, u₀       trim: steady state and its command      SI          steady
A, B, C, D   linear model about it                   SI          linear, cable_modes
A_k, B_k     linear model along a run                SI          along
λ L/U, ζ     poles in the vehicle's time scale       1           poles
k, k_I       feedback and integral gains             SI          design, weighting
δ_ff         feed-forward, against hull and cable    SI          standard
"""

from importlib import import_module
from typing import Any

_HOME = {
    "AUTOPILOTS": "table",
    "Along": "along",
    "Autopilot": "flight",
    "AutopilotError": "flight",
    "AutopilotWarning": "flight",
    "CableModel": "feed_forward",
    "ESTIMATED": "sensors",
    "EstimatorLoop": "estimator",
    "FEED_FORWARD": "table",
    "FormulaCable": "feed_forward",
    "Gains": "design",
    "INPUTS": "states",
    "Law": "loops",
    "Loop": "loops",
    "MANOEUVRES": "manoeuvres",
    "Margins": "frequency",
    "Mode": "poles",
    "NoCable": "feed_forward",
    "NoTrimError": "limits",
    "PERFECT": "sensors",
    "STATES": "states",
    "STEPS": "steps",
    "SUBSYSTEMS": "linear",
    "Schedule": "schedule",
    "Sensor": "sensors",
    "Sensors": "sensors",
    "StandardAutopilot": "standard",
    "Trim": "steady",
    "Tuning": "tuning",
    "TwinCable": "feed_forward",
    "UNITS": "states",
    "WEIGHTS": "weighting",
    "Wanted": "standard",
    "Weights": "weighting",
    "design_gains": "design",
    "estimates": "estimator",
    "fly": "flight",
    "linearise": "linear",
    "linearise_along": "along",
    "loop_margins": "robustness",
    "make": "table",
    "manoeuvre": "manoeuvres",
    "margins": "frequency",
    "modes": "poles",
    "plant": "plants",
    "reduced": "design",
    "step": "steps",
    "subsystem": "linear",
    "trim": "steady",
    "tune": "tuning",
    "with_weights": "weighting",
}
"""Public name → module of this package; no module may be called like a public name."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Fetch a public name from its module, once."""
    if name not in _HOME:
        raise AttributeError(
            f"module 'subzero.autopilot' has no attribute '{name}'; it has {', '.join(__all__)}"
        )
    value = getattr(import_module(f"{__name__}.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
