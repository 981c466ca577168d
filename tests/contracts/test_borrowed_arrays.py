"""Compiled functions borrow their arrays: only those that say `allocating` may make some, give some back, or call one
that gives some back. Nobody counts references for the others: an array that they were given to keep would never be
freed, and one that they gave back might be freed too early. Numba refuses those that make arrays; this is the rest.
"""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BORROWING = {"compiled", "inner", "inlined", "expanded"}


def functions(text: str) -> Iterator[tuple[ast.FunctionDef, set[str]]]:
    """Return the functions of a source with the names of their plain decorators."""
    for one in ast.walk(ast.parse(text)):
        if isinstance(one, ast.FunctionDef):
            yield one, {each.id for each in one.decorator_list if isinstance(each, ast.Name)}


def gives_arrays(one: ast.FunctionDef) -> bool:
    """Say whether a function is annotated to return an array, or something with arrays in it."""
    return one.returns is not None and any(
        word in ast.unparse(one.returns) for word in ("ndarray", "Line", "Any")
    )


def called(one: ast.FunctionDef) -> set[str]:
    """Return the names of what a function calls."""
    calls = [each.func for each in ast.walk(one) if isinstance(each, ast.Call)]
    return {each.id if isinstance(each, ast.Name) else getattr(each, "attr", "") for each in calls}


def faults(text: str, giving: set[str]) -> list[str]:
    """Return the names of borrowing functions that give arrays, or call what gives some."""
    return [
        one.name
        for one, how in functions(text)
        if how & BORROWING and (gives_arrays(one) or called(one) & giving)
    ]


@pytest.mark.long
def test_only_allocating_functions_give_arrays_or_are_given_some():
    paths = [path for part in ("cable", "vehicle", "subzero") for path in (ROOT / part).rglob("*.py")]
    texts = {str(path): path.read_text() for path in paths}
    giving = {one.name for text in texts.values() for one, how in functions(text)
              if "allocating" in how and gives_arrays(one)}  # fmt: skip
    assert {"quaternion_from_euler", "make_handle"} <= giving
    assert {path: found for path, text in texts.items() if (found := faults(text, giving))} == {}


def test_a_fault_is_found():
    text = "@compiled\ndef f(x) -> np.ndarray:\n    return x\n@inner\ndef g(x):\n    return a.hold(x)\n"
    assert faults(text, {"hold"}) == ["f", "g"]
    assert faults(text.replace("@compiled", "@allocating").replace("@inner", "@allocating"), {"hold"}) == []
