"""The cable against what is known: closed forms, ordinary differential equations, invariances, other codes.

    python -m benchmarks.validation                 measures everything, writes docs/validation.md and its figures
    python -m benchmarks.validation --only turns    measures one section; the page keeps the others
    python -m benchmarks.validation --quick         prints, with coarser refinements; writes nothing

`cases` holds the table of cases, `row` what a line of the page is, `page` writes, and every other file is a family of
cases: a docstring that the page prints, `rows(quick)`, and `draw(figure)` where there is something to look at. The same
table drives `tests/validation`: every gate is a test.
"""
