"""The trials of the benchmark, and what is measured in them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

import subzero
from subzero.diagnosis.assessment import rich
from subzero.diagnosis.hypothesis.catalogue import START, catalogue
from subzero.diagnosis.hypothesis.configuration import Setting
from subzero.diagnosis.hypothesis.effect import Effect
from subzero.model import Model

CHANNELS = ("surge_speed", "heading", "yaw_rate", "pitch", "roll_angle", "depth")
"""The six basic ones."""
BRAKE = 0.1
"""Friction of the drum on `rich`, at its rim, so that it does not run ahead where the vehicle slows. [N]"""
RATE = 10.0
"""Samples of a record a second. [Hz]"""
AFTER = 4.0
"""A trial goes on behind its record, for sensors whose clock runs ahead. [s]"""


@cache
def nominal(name: str) -> Setting:
    """Return the nominal setting of a manoeuvre."""
    trial = subzero.load_scenario("fig6")
    setting = Setting(trial=trial, model=Model.of(trial))
    return braked_rich(setting) if name == "rich" else setting


def braked_rich(setting: Setting) -> Setting:
    """Return the rich trial of the library with a drum that rubs."""
    return rich(setting.with_drum(friction_torque=BRAKE * setting.model.drum.radius))


def times(setting: Setting) -> np.ndarray:
    """Return when the sensors are read. [s]"""
    return np.arange(round(setting.trial.duration * RATE) + 1) / RATE


@cache
def effects() -> Mapping[str, Effect]:
    """Return all that may differ from the nominal model, by id: the catalogue of the basic channels, and the start."""
    return {**catalogue(CHANNELS), **{effect.id: effect for effect in START}}


@cache
def ids() -> tuple[str, ...]:
    """Return all causes that can be named."""
    return tuple(catalogue(CHANNELS))
