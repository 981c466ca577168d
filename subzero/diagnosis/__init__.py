"""Diagnosis: which physical cause explains where a simulation differs from measured records, and how sure that is.

    records + trials → model → explanations and their probabilities (`subzero.identification`) → verdict on the trial

Bayesian model selection on a simulator. An explanation is a set of terms: causes of the catalogue, errors in the data,
drifts, unknown forces. Numbers of a cause have the wide prior N(0, s²), all others the narrow one N(0, τ²).

symbol       name                                                     unit          module
-----------  -------------------------------------------------------  ------------  --------------------------
z            deviations of all parameters from the nominal model      their own     hypothesis.effect
τ, s         prior standard deviations: tolerance, size of an effect  as z          hypothesis.effect
h(z)         readings of the sensors in a simulation                  channel's     inference.simulator
W            whitening by the noise: level, colour, gaps              1             hypothesis.noise
r, J         whitened residual W (y − h(z)), and ∂(W h)/∂z            1             inference.problem
D            squared Mahalanobis distance to the closest rival        1             assessment.identifiability

Reading order: `api`, the entry point; `results`, the values that are returned; `vehicle_model`, the trial as a model;
then hypothesis, inference, assessment, verdict, report. The public names are listed here, and imported from their files
when they are first used: compiled code imports the configuration, and an edit of a report must not compile it again.
The parts have interfaces of their own, `subzero.diagnosis.inference` and `subzero.diagnosis.assessment`.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "CALIBRATED": ("results", "CALIBRATED"),
    "CAUSE_NAMED": ("results", "CAUSE_NAMED"),
    "Cause": ("subzero.identification", "Cause"),
    "ChannelGain": ("results", "ChannelGain"),
    "Curves": ("results", "Curves"),
    "DATA_ERROR": ("results", "DATA_ERROR"),
    "Detectability": ("results", "Detectability"),
    "Effect": ("hypothesis.effect", "Effect"),
    "Estimate": ("results", "Estimate"),
    "Extended": ("results", "Extended"),
    "FoundError": ("results", "FoundError"),
    "Gain": ("results", "Gain"),
    "Logged": ("hypothesis.logged", "Logged"),
    "Misfit": ("results", "Misfit"),
    "Model": ("subzero.identification", "Model"),
    "ModelError": ("subzero.identification", "ModelError"),
    "NOISE": ("hypothesis.catalogue", "NOISE"),
    "NOTHING_NEAR": ("results", "NOTHING_NEAR"),
    "NOTHING_WRONG": ("results", "NOTHING_WRONG"),
    "NamedCause": ("results", "Cause"),
    "NextTrial": ("results", "NextTrial"),
    "Number": ("subzero.identification", "Number"),
    "ONSETS": ("hypothesis.catalogue", "ONSETS"),
    "OUT_OF_CATALOGUE": ("results", "OUT_OF_CATALOGUE"),
    "Parameter": ("hypothesis.effect", "Parameter"),
    "Record": ("subzero.identification", "Record"),
    "Rival": ("results", "Rival"),
    "SAMPLED": ("hypothesis.catalogue", "SAMPLED"),
    "SPECS": ("hypothesis.catalogue", "SPECS"),
    "START": ("hypothesis.catalogue", "START"),
    "Sensing": ("hypothesis.configuration", "Sensing"),
    "Sensor": ("subzero.identification", "Sensor"),
    "Setting": ("hypothesis.configuration", "Setting"),
    "Start": ("subzero.identification", "Start"),
    "UNDECIDED": ("results", "UNDECIDED"),
    "Unknown": ("subzero.identification", "Unknown"),
    "UnknownForce": ("results", "Unknown"),
    "Verdict": ("results", "Verdict"),
    "all_effects": ("hypothesis.catalogue", "all_effects"),
    "apply_extended": ("hypothesis.hypotheses", "apply_extended"),
    "catalogue": ("hypothesis.catalogue", "catalogue"),
    "diagnose": ("api", "diagnose"),
    "diagnose_trials": ("api", "diagnose_trials"),
    "extended_toml": ("report.toml_file", "text_of"),
    "load_effects": ("hypothesis.catalogue", "load"),
    "read": ("subzero.identification", "read"),
    "read_extended": ("report.toml_file", "read_extended"),
    "unseen": ("hypothesis.hypotheses", "unseen"),
    "with_free_onset": ("hypothesis.effect", "with_free_onset"),
    "with_onset": ("hypothesis.effect", "with_onset"),
}
"""Public name → (file here, or package, and the name there)."""

__all__ = sorted(_HOME)


def __getattr__(name: str) -> Any:
    """Import a public name from its file, once."""
    if name not in _HOME:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'; it has {', '.join(__all__)}")
    file, inner = _HOME[name]
    home = file if file.startswith("subzero.") else f"{__name__}.{file}"
    value = getattr(import_module(home), inner)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return __all__
