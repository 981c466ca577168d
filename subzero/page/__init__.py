"""The page of a run, ``report.html``: one file with everything to see, and a replay in which the cable moves.

`subzero.page.report` makes the page, `subzero.page.replay` the data of its replay, `subzero.page.of_runs` both from the
runs of a trial; the player itself is JavaScript, in ``assets/player``.
"""

from subzero.page.of_runs import page_of_runs
from subzero.page.replay import Actor, actors_of, encode
from subzero.page.report import Line, Report, Table, render

__all__ = ["Actor", "Line", "Report", "Table", "actors_of", "encode", "page_of_runs", "render"]
