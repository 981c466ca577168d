"""Gain, phase and delay margins of a loop as flown: sampled, with servo lag, unmeasured states and cable.

They are read off the frequency response of

    L(z) = −C(z) P(z),   P the hull on its cable (`linearise`), sampled; C the controller, opened at the plant's input

The design neglects the servo lag, sway (in the PID), sampling and the cable. Here all are included; the gains are those
of the bare hull at the same speed.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from subzero.autopilot.design import WEIGHTS
from subzero.autopilot.estimator import MEASURED, STATES, Estimates
from subzero.autopilot.linear import linearise, subsystem
from subzero.autopilot.tuning import Tuning
from subzero.errors import UserError, chosen
from subzero.files.text_repr import Overview
from subzero.model import Model
from subzero.steady_motion.trim import trim

if TYPE_CHECKING:
    import control


@dataclass(frozen=True, kw_only=True)
class Margins:
    """Stability margins of a loop, opened at the plant's input.

    Attributes:
        gain: factor that the gain may grow by; infinite where none is too much.
        gain_down: factor that it may shrink to; 0 where none is too little.
        phase: lag that may be added. [rad]
        delay: delay that may be added. [s]
        crossover: frequency of gain 1. [rad/s]
    """

    gain: float
    gain_down: float
    phase: float
    delay: float
    crossover: float

    def __repr__(self) -> str:
        """Return the margins with their units."""
        rows = [
            ("gain", f"times {self.gain:.4g}, or times {self.gain_down:.4g}"),
            ("phase", f"{np.degrees(self.phase):.4g} degree at {self.crossover:.4g} rad/s"),
            ("delay", f"{self.delay:.4g} s"),
        ]
        return Overview("Stability margins", rows).text()


def margins(loop: control.StateSpace, *, delay: float = 0.0) -> Margins:
    """Return gain and phase margin of a loop, from its frequency response at 4000 frequencies.

    Args:
        loop: L, from the command to minus the command, such as `Gains.loop`; continuous or sampled.
        delay: an additional delay, of computing and sensors. [s]
    """
    sampled = loop.dt not in (None, 0)
    w = np.geomspace(1e-3, np.pi / loop.dt if sampled else 1e3, 4000)
    L = np.squeeze(np.asarray(loop(np.exp(1j * w * loop.dt) if sampled else 1j * w))) * np.exp(
        -1j * w * delay
    )
    size, phase = np.abs(L), np.unwrap(np.angle(L))
    crossing = np.flatnonzero((size[:-1] >= 1.0) & (size[1:] < 1.0))
    real = np.flatnonzero((np.imag(L[:-1]) * np.imag(L[1:]) <= 0.0) & (np.real(L[:-1]) < 0.0))
    factors = 1.0 / size[real]
    up, down = factors[factors > 1.0], factors[factors < 1.0]
    last = int(crossing[-1]) if crossing.size else 0
    left = float((phase[last] + np.pi) % (2.0 * np.pi)) if crossing.size else np.inf
    return Margins(
        gain=float(up.min()) if up.size else np.inf,
        gain_down=float(down.max()) if down.size else 0.0,
        phase=left,
        delay=left / float(w[last]),
        crossover=float(w[last]) if crossing.size else 0.0,
    )


MARGINAL = 1e-6
"""A motion that grows by less than this per sample counts as constant, as the depth in the pitch loop does."""


def loop_margins(tuning: Tuning, loop: str, *, late: float = 0.0, **options: Any) -> Margins:
    """Return gain and phase margin of a loop at the plant's input.

    Args:
        tuning: the gains.
        loop: "speed", "heading", "pitch" or "roll".
        late: further delay, of sensors and computing. [s]
        options: speed, wet_length and so on, as for `sampled_loop`.
    """
    return margins(sampled_loop(tuning, loop, **options), delay=late)


def sampled_loop(
    tuning: Tuning,
    loop: str,
    *,
    speed: float,
    wet_length: float = 0.0,
    sample_time: float = 0.1,
    model: Model | None = None,
    estimates: Estimates | None = None,
) -> control.StateSpace:
    """Return L(z) of a loop, opened at the plant's input: from the command to minus the command.

    Args:
        tuning: the gains.
        loop: "speed", "heading", "pitch" or "roll".
        speed: of the vehicle. [m/s]
        wet_length: of the cable that it pulls. [m]
        sample_time: of the controller; the hold of half a sample is in it. [s]
        model: the vehicle; the tuning's by default.
        estimates: a heading by full state feedback instead of the PID.

    Raises:
        NoTrimError: the vehicle cannot pull that cable at that speed.
        UserError: there is no such loop.
    """
    chosen(WEIGHTS, loop, "loop")
    model = model or tuning.model
    linear = linearise(model, trim(model, speed=speed, wet_length=wet_length))
    return _opened(tuning, loop, linear, speed, sample_time, estimates)


def check_stable(tuning: Tuning, sample_time: float, estimates: Estimates | None = None) -> None:
    """Raise an error for gains with which the sampled bare hull is unstable.

    Args:
        tuning: the gains.
        sample_time: of the controller. [s]
        estimates: a heading by full state feedback instead of the PID.

    Raises:
        UserError: a loop is unstable at one of the speeds: which, and the remedy.
    """
    for loop in WEIGHTS:
        for speed, linear in zip(tuning.speeds, tuning.linear, strict=True):
            opened = _opened(tuning, loop, linear, speed, sample_time, estimates)
            closed = np.asarray(opened.A) - np.asarray(opened.B) @ np.asarray(opened.C)
            largest = float(np.max(np.abs(np.linalg.eigvals(closed))))
            if largest > 1.0 + MARGINAL:
                raise UserError(
                    f"The {loop} loop is unstable at {speed:g} m/s with a sample time of {sample_time:g} s: a motion"
                    f" grows by a factor of {largest:.3g} a sample. Allowed: a shorter sample time, weights that ask"
                    " for less (a smaller largest_command), or a tuning for slower motion."
                )


def _opened(
    tuning: Tuning,
    loop: str,
    linear: control.StateSpace,
    speed: float,
    sample_time: float,
    estimates: Estimates | None,
) -> control.StateSpace:
    """Return L(z) of a loop on a linear model of the hull."""
    import control

    part = subsystem(linear, WEIGHTS[loop].part)
    sampled = control.c2d(part, sample_time)
    if estimates is not None and loop == "heading":
        controller = _estimator(estimates, speed, sample_time)
        rows = [STATES.index(name) for name in STATES[1:3]]
    else:
        controller = _pid(tuning.gains[loop].at(speed), sample_time)
        rows = [part.state_labels.index(name) for name in WEIGHTS[loop].measured]
    measured = control.ss(
        sampled.A, sampled.B, np.asarray(sampled.C)[rows], np.zeros((len(rows), 1)), sample_time
    )
    return -1.0 * (controller * measured)


def _pid(gains: np.ndarray, T: float) -> control.StateSpace:
    """Return u = −k·y + I, I ← I − T k_I y_tracked, the new error already in it."""
    import control

    *k, k_integral, _ = gains.tolist()
    fast = np.zeros(len(k))
    fast[-1] = T * k_integral
    return control.ss([[1.0]], -fast[None], [[1.0]], -(np.array(k) + fast)[None], T)


def _estimator(estimates: Estimates, speed: float, T: float) -> control.StateSpace:
    """Return the full-state loop from (r, ψ) to the rudder: its states are the estimate and the integral."""
    import control

    *k, k_integral, _ = estimates.feedback.at(speed).tolist()
    model, L = estimates.model.at(speed), estimates.filter.at(speed)
    fast = np.array([0.0, 0.0, T * k_integral, 0.0])
    out = np.append(-(np.array(k) + fast), 1.0)
    A = np.zeros((5, 5))
    A[:4, :4] = model[:, :4] - L @ MEASURED
    A[:4] += np.outer(model[:, 4], out)
    A[4] = np.append(-fast, 1.0)
    return control.ss(A, np.vstack([L, np.zeros((1, 2))]), out[None], np.zeros((1, 2)), T)
