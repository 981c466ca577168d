"""Private words, where the field has a noun that a reader would search for: a table of them, and where they occur.

Looked at are the user's pages, and in the four packages names (functions, classes, modules, parameters, variables),
docstrings with comments, and messages (texts with a space in them). Code on a page, between backticks or in a block, is
no text.
"""

from __future__ import annotations

import ast
import io
import random
import re
import tokenize
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("subzero", "cable", "vehicle", "scenarios")
PLAIN_WORDS = {
    r"told": "reported, stated, commanded",
    r"tells?(?! (?:\w+ ){0,4}apart)": "reports, states, shows",
    r"beside": "with, added to, compared with, next to",
    r"heed(?:s|ed)?": "handle a signal",
    r"befall(?:s|en)?": "happen to",
    r"nobody": "no user, no other process",
    r"stays?": "remains, is constant",
    r"begun": "with a change point",
    r"yardstick": "saturated model",
    r"firm": "excluded by physics",
    r"room": "memory estimate, space",
    r"promise[sd]?": "predicted gain; stated, guaranteed",
    r"hopes?": "predicted gain",
    r"astray": "in a local minimum",
    r"outside (?:the|its|any) catalogue": "out of the catalogue, not in the catalogue",
    r"b[ee]n[dt]s? (?:a |the |its )?(?:model|parameter|number|prior|fit|cause)s?": "deviate from the prior",
}
"""Regular expression of a private word → plain words."""
A_NOUN = r"(?-i:\bwhat is\b)(?![^.]*\?)"
"""The phrase used as a noun, not as a question."""
PROSE = re.compile("|".join([rf"\b(?:{word})\b" for word in PLAIN_WORDS] + [A_NOUN]), re.IGNORECASE)
IN_NAMES = re.compile(
    "told|(?<![a-z])tells?(?![a-z])|beside|heed|befalls?|nobody|stays|begun|yardstick|firm|room|promised?|hopes?|astray|outside|unbroken"
)
"""Parts of a name that are private words."""


def pages() -> dict[str, str]:
    """Return the text of the user's pages by their paths, without code."""
    paths = [
        *sorted((ROOT / "docs").glob("*.md")),
        *(ROOT / f"{n}.md" for n in ("README", "VISION", "CONTRIBUTING")),
    ]
    texts = {str(path.relative_to(ROOT)): path.read_text(encoding="utf-8") for path in paths}
    texts["docs/architecture.md"] = texts["docs/architecture.md"].partition("| says | means |")[0]
    texts["CHANGELOG.md, the top"] = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").split("\n## ")[2]
    return {name: _prose(text) for name, text in texts.items()}


def _prose(text: str) -> str:
    blocks = re.sub(r"```.*?```|~~~.*?~~~", "", text, flags=re.DOTALL)
    return re.sub(r"`[^`\n]*`|^ {4}.*$", "", blocks, flags=re.MULTILINE)


def private_words(text: str) -> list[str]:
    """Return the private words of a text."""
    return [found[0].lower() for found in PROSE.finditer(text)]


@cache
def sources() -> tuple[tuple[Path, ast.Module], ...]:
    """Return the files of the product with their trees."""
    paths = sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py"))
    return tuple((path, ast.parse(path.read_text(encoding="utf-8"))) for path in paths)


def names(path: Path, tree: ast.Module) -> set[str]:
    """Return the names that a file defines, its own included."""
    found = {path.stem}
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(node.name)
        elif isinstance(node, ast.arg):
            found.add(node.arg)
        elif isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.add(node.id)
    return found


def is_private(name: str) -> bool:
    """Say whether a name is `one`, or has a private word in it."""
    parts = re.findall(r"[A-Z]?[a-z]+|[A-Z]+(?![a-z])", name)
    return name == "one" or any(IN_NAMES.fullmatch(part.lower()) for part in parts)


def docstrings(path: Path, tree: ast.Module) -> list[str]:
    """Return the docstrings of a file, those of constants too, and its comments."""
    found = [node.value.value for node in ast.walk(tree) if _is_docstring(node)]
    tokens = tokenize.generate_tokens(io.StringIO(path.read_text(encoding="utf-8")).readline)
    return found + [token.string for token in tokens if token.type == tokenize.COMMENT]


def messages(path: Path, tree: ast.Module) -> list[str]:
    """Return the texts of a file that are no docstrings and have a space in them."""
    documented = {id(node.value) for node in ast.walk(tree) if _is_docstring(node)}
    texts = [
        node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)
    ]
    return [text.value for text in texts if id(text) not in documented and " " in text.value.strip()]


def _is_docstring(node: ast.AST) -> bool:
    is_text = isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
    return is_text and isinstance(node.value.value, str)


@cache
def counts() -> dict[str, int]:
    """Return how many private words there are: in pages, in names (each once a file), in docstrings, in messages."""
    found = {"pages": sum(len(private_words(text)) for text in pages().values()), "names": 0}
    found |= {"docstrings": 0, "messages": 0}
    for path, tree in sources():
        found["names"] += sum(map(is_private, names(path, tree)))
        found["docstrings"] += sum(len(private_words(text)) for text in docstrings(path, tree))
        found["messages"] += sum(len(private_words(text)) for text in messages(path, tree))
    return found


def drawn(seed: int, count: int = 20) -> dict[str, list[str]]:
    """Return names, docstrings and messages drawn by a seed."""
    rng, found = random.Random(seed), {}
    for kind in (names, docstrings, messages):
        every = sorted({one for path, tree in sources() for one in kind(path, tree)})
        found[kind.__name__] = rng.sample(every, count)
    return found
