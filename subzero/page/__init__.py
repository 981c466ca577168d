"""The page of a command, ``report.html``: one file with everything to see, and a replay in which the cable moves.

`subzero.page.report` makes the page, `subzero.page.replay` the data of its replay, `subzero.page.of_runs` both from the
runs of a trial; pages of a sweep and of a diagnosis are made where these are delivered. The player itself is
JavaScript, in ``assets/player``.
"""

from subzero.page.of_runs import page_of_runs
from subzero.page.replay import Actor, actors_of, encode
from subzero.page.report import Answer, Line, Report, Section, Table, render

__all__ = [
    "Actor",
    "Answer",
    "Line",
    "Report",
    "Section",
    "Table",
    "actors_of",
    "encode",
    "page_of_runs",
    "render",
]
