"""Numbers in source code: names that are bound to them, defaults of arguments, and bare ones in bodies of functions."""

from __future__ import annotations

import ast

TRIVIAL = (0, 1, 2, -1, 0.5)
"""Numbers that need no name."""


def named(tree: ast.Module) -> list[str]:
    """Return the names of a module that are bound to numbers, and those of its classes, but for trivial numbers."""
    found = []
    for parent in (tree, *(node for node in ast.walk(tree) if isinstance(node, ast.ClassDef))):
        for node in parent.body:
            value = node.value if isinstance(node, ast.Assign | ast.AnnAssign) else None
            if value is not None and is_number(value) and not (parent is not tree and is_trivial(value)):
                targets = node.targets if isinstance(node, ast.Assign) else [node.target]
                found += [
                    name.id for each in targets for name in ast.walk(each) if isinstance(name, ast.Name)
                ]
    return found


def defaults(tree: ast.Module) -> int:
    """Return how many defaults of arguments are numbers, but for trivial ones."""
    functions = [node.args for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    values = [
        value for args in functions for value in (*args.defaults, *args.kw_defaults) if value is not None
    ]
    return sum(is_number(value) and not is_trivial(value) for value in values)


def bare(tree: ast.Module) -> int:
    """Return how many numbers there are in bodies of functions, but for trivial ones."""
    bodies = [part for node in ast.walk(tree) if isinstance(node, ast.FunctionDef) for part in node.body]
    inside = {id(node): node for part in bodies for node in ast.walk(part)}
    return sum(_is_literal(node) and not is_trivial(node) for node in inside.values())


def is_number(node: ast.AST) -> bool:
    """Say whether an expression is made of numbers alone: one, several, or arithmetic on them."""
    operators = ast.operator | ast.unaryop | ast.expr_context
    parts = [part for part in ast.walk(node) if not isinstance(part, operators)]
    literals = [part for part in parts if isinstance(part, ast.Constant)]
    made_of = ast.Constant | ast.Tuple | ast.List | ast.UnaryOp | ast.BinOp
    return (
        bool(literals)
        and all(isinstance(part, made_of) for part in parts)
        and all(map(_is_literal, literals))
    )


def is_trivial(node: ast.AST) -> bool:
    """Say whether an expression is a number that needs no name."""
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        return _is_literal(node.operand) and -node.operand.value in TRIVIAL
    return _is_literal(node) and node.value in TRIVIAL


def _is_literal(node: ast.AST) -> bool:
    return isinstance(node, ast.Constant) and type(node.value) in (int, float)
