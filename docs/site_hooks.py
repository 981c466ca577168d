"""Steps of mkdocs for this site: examples are copied, the reference lists all public names, equations become MathML."""

import html
import importlib
import inspect
import re
import sys
from pathlib import Path

from mkdocs.structure.files import File

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
PACKAGES = {"__version__", "autopilot", "sweeps"}
"""Public names of `subzero` that are listed otherwise."""


def on_files(files, config):
    """Add the examples to the files of the site."""
    for path in sorted(EXAMPLES.glob("*.*")):
        files.append(File.generated(config, f"examples/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Point links to the copied examples, and list the public names in the place of "<!-- names of PACKAGE -->"."""
    markdown = re.sub(r"\]\(\.\./examples/", "](examples/", markdown)
    return re.sub(r"<!-- names of (\S+) -->", lambda found: public_names(found[1]), markdown)


def public_names(package: str) -> str:
    """Return a heading and the documentation of every name in the ``__all__`` of a package."""
    module, parts = importlib.import_module(package), []
    for name in sorted(set(module.__all__) - PACKAGES):
        value = getattr(module, name)
        at = home(value, name, package)
        heading = f"{package}.{name}"
        options = f'    options: {{heading: "{heading}", toc_label: "{heading}", heading_level: 3}}'
        parts.append(f"::: {at}\n{options}\n" if at else f"### {heading}\n\n`{value!r}`\n")
    return "\n".join(parts)


def home(value: object, name: str, package: str) -> str:
    """Return where a value is defined, "" if that is a package or not found."""
    value = getattr(value, "py_func", value)
    if inspect.isfunction(value) or inspect.isclass(value):
        return f"{value.__module__}.{value.__qualname__}"
    assigned = rf"^(?:def {name}\(|{name}(?:: [^=\n]*)? = )"
    for module in [m for n, m in sys.modules.items() if n.split(".")[0] == package.split(".")[0]]:
        path = getattr(module, "__file__", None)
        if path and re.search(assigned, Path(path).read_text(encoding="utf-8"), re.MULTILINE):
            return f"{module.__name__}.{name}"
    return ""


def on_page_content(content, page, config, files):
    """Write equations, which arithmatex has marked, as MathML: no script, no request to another site."""
    return re.sub(
        r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', as_mathml, content, flags=re.DOTALL
    )


def as_mathml(found: re.Match) -> str:
    """Return an equation as MathML."""
    from latex2mathml.converter import convert

    return convert(html.unescape(found[3]), display="block" if found[2] == "[" else "inline")
