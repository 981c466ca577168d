"""Which terms explain what a model of yours gets wrong in measured records: any model, any record.

    record → fit of every explanation → evidence → is the model near? → locks → verdict

A model is a function ``simulate(parameters, inputs, times)`` with declared channels, parameters, causes and unknown
inputs. An explanation is a set of terms: causes, errors in the data, wider tolerances. Every explanation also has the
unknown inputs, so that a structure error of the model is not taken for a cause.

symbol    name                                                    unit         file
--------  ------------------------------------------------------  -----------  -----------
p, u, y   parameters, inputs, readings                            their own    model
τ, s      prior standard deviations: tolerance, size of a cause   as p         model
θ         all free numbers of an explanation                      their own    explanation
w         unknown inputs at their knots                           as the input model
e         residual: record, corrected, less the simulation        channel's    problem
Σ         covariance of the noise of a channel: white and slow    channel's²   noise
log p(y)  evidence of an explanation                              1            fit
R         residual of the best explanation over the sensor's level  1            nearness

Reading order: `model`, `record`, `explanation`, `problem`, `fit`, `search`, `nearness`, `locks`, `verdict`.
"""

from subzero.identification.api import diagnose
from subzero.identification.model import Cause, Model, ModelError, Number, Sensor, Start, Unknown
from subzero.identification.record import Record, read
from subzero.identification.verdict import Verdict

__all__ = [
    "Cause",
    "Model",
    "ModelError",
    "Number",
    "Record",
    "Sensor",
    "Start",
    "Unknown",
    "Verdict",
    "diagnose",
    "read",
]
