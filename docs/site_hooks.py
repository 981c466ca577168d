"""What mkdocs does besides: pages link to the scripts in ``examples/``, which are copied to the site."""

import re
from pathlib import Path

from mkdocs.structure.files import File

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"


def on_files(files, config):
    """Add the examples to the files of the site."""
    for path in sorted(EXAMPLES.glob("*.*")):
        files.append(File.generated(config, f"examples/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Point links to the examples, which are right in the repository, to their copies on the site."""
    return re.sub(r"\]\(\.\./examples/", "](examples/", markdown)
