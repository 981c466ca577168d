"""A verdict in words, tables, Markdown, JSON and TOML.

`words` says things in English, `tables` makes rows of them, `summary` answers what one asks first, `sections` puts all
of it in order, `markdown` writes that as text; `json_file` is the same for programs.
"""

from subzero.diagnosis.report import json_file, tables, words
from subzero.diagnosis.report.sections import markdown, sections
from subzero.diagnosis.report.summary import summary

__all__ = ["json_file", "markdown", "sections", "summary", "tables", "words"]
