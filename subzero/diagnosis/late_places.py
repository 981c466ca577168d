"""Where causes that begin in mid-trial are looked for.

Around the best hypothesis, and along the runs of the best forces, if they are close to it or it does not explain; and
as large as the best hypotheses have them throughout.
"""

from __future__ import annotations

from collections.abc import Sequence

from subzero.diagnosis.candidate import Candidate
from subzero.diagnosis.closer import Close
from subzero.diagnosis.search import Search
from subzero.diagnosis.sudden import Along, Place

LOOKED = 2
"""Along the runs of at most so many forces."""
ALIKE = 10.0
"""Forces and hypotheses whose log posteriors differ by less."""
LARGE = 2
"""As large as in at most so many hypotheses."""


def places_of(search: Search, close: Sequence[Close], prior: float) -> list[Place]:
    """Return where to look.

    Args:
        search: with its fits.
        close: forces and drifts around fits of their own, most probable first.
        prior: log prior of a force, which `close` is without.
    """
    best = search.best()
    here = Place(fit=best.fit, along=Along(search.problem, best.fit.z))
    known = [] if search.is_lost() else [best.log_posterior - prior]
    least = max([*(one.log_posterior for one in close), *known], default=0.0) - ALIKE
    alike = [one.place for one in close[:LOOKED] if one.log_posterior > least]
    return [here, *alike]


def largest(search: Search) -> list[Candidate]:
    """Return the hypotheses whose causes may be what begins in mid-trial: the best that have any."""
    least = search.best().log_posterior - ALIKE
    ranked = sorted(search.candidates.values(), key=lambda one: -one.log_posterior)
    return [one for one in ranked if one.log_posterior > least and one.ids][:LARGE]
