"""A verdict in words, tables, Markdown, JSON and TOML.

`words` has sentences in English, `tables` makes rows of them, `summary` answers the first questions of a reader,
`sections` puts them in order, and its `markdown` writes them as text; `json_file` is the same for programs.
"""

from subzero.diagnosis.report import json_file, tables, words
from subzero.diagnosis.report.sections import markdown, sections
from subzero.diagnosis.report.summary import summary

__all__ = ["json_file", "markdown", "sections", "summary", "tables", "words"]
