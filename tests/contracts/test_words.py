"""Pages, names, docstrings and messages use the words that an engineer of the field would search for.

Verifies: the private words of `benchmarks.words` do not occur on pages; elsewhere no more often than is allowed below.
Configuration: the sources as they are. Tolerance: none; an allowance may only shrink. ``pytest -s`` prints the names,
docstrings and messages that a seed draws, to be read aloud.
"""

import ast
from pathlib import Path

import pytest

from benchmarks import words

ALLOWED = {"names": 27, "docstrings": 5, "messages": 39}
"""How many private words there may be: names, each counted once a file; words in docstrings, comments and messages."""
SEED = 20261128


@pytest.fixture(scope="module")
def found():
    """How many private words there are."""
    return words.counts()


def test_pages_have_no_private_words():
    assert {name: found for name, text in words.pages().items() if (found := words.private_words(text))} == {}


@pytest.mark.long
@pytest.mark.parametrize("kind", ALLOWED)
def test_no_more_private_words_than_are_allowed(found, kind):
    assert found[kind] <= ALLOWED[kind]


@pytest.mark.long
def test_the_drawn_names_docstrings_and_messages_are_printed():
    for kind, drawn in words.drawn(SEED).items():
        print(f"\n{kind}:", *(" ".join(text.split()) for text in drawn), sep="\n  ")
        assert len(set(drawn)) == 20


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("It is told beside what is known.", ["told", "beside", "what is"]),
        ("What is wrong? What is shown.", []),
        ("Causes that bend the model, outside the catalogue.", ["bend the model", "outside the catalogue"]),
        ("A minimum bend radius; it cannot tell them apart; bedroom.", []),
    ],
)
def test_private_words_are_found_in_a_text(text, expected):
    assert words.private_words(text) == expected


def test_private_words_are_found_in_names_docstrings_and_messages(tmp_path):
    path = tmp_path / "room_left.py"
    path.write_text(
        'def told(count, one=1):\n    """It stays."""\n    raise ValueError("nobody is told")\n',
        encoding="utf-8",
    )
    tree = ast.parse(path.read_text(encoding="utf-8"))
    assert {name for name in words.names(path, tree) if words.is_private(name)} == {
        "room_left",
        "told",
        "one",
    }
    assert words.docstrings(path, tree) == ["It stays."]
    assert words.messages(path, tree) == ["nobody is told"]
    assert not words.is_private("minimum_bend_radius")
    assert not words.is_private(Path("bedroom").stem)
