"""How easy the code is to carry on, in figures: sizes, import chains, circles, parameters, docstrings, tests.

    python -m benchmarks.house                   # figures and targets; what stands behind them with --list, --lone
    python -m benchmarks.house --json house.json

figure            what it counts
----------------  -----------------------------------------------------------------------------------------------------
lines             of source that are not blank
files/1000        files in a thousand of them
floors            modules on the longest chain of imports inside the package; imports inside functions count, those for
                  types only (``TYPE_CHECKING``) do not; a name that a face hands on counts as an import of the module
                  that defines it; a circle counts as one
circles           sets of modules that import one another, by any import
lone              modules with exactly one importer in the whole product (faces, ``__init__``, left out): fine if they
                  are a whole concept, which a file of fewer than 80 lines is not, unless it is a row of a table that is
                  meant to be added to: the catalogue of effects
> 7 parameters    functions outside compiled kernels, ``self`` left out
doc/source        lines of docstrings by lines
test/source       lines of tests by lines; those of a test file are shared out over the packages that it imports
engine faces      tests of a package whose file imports the faces of its rooms, and nothing below (of the diagnosis
                  ``subzero.diagnosis.inference``, ``subzero.diagnosis.assessment`` and ``subzero.diagnosis.report``)
below             tests of a package whose file imports more of it than its faces (a face: ``cable``, ``subzero``,
                  ``subzero.autopilot``, …, what a user imports)

"subzero, rest" is what stands in no package of its own row. The last row is the whole product. Below the table stands
what is asked for, with its target.
"""

from __future__ import annotations

import argparse
import ast
import json
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("subzero", "cable", "vehicle", "scenarios")
ROWS = (
    "cable",
    "vehicle",
    "scenarios",
    "subzero.autopilot",
    "subzero.calibration",
    "subzero.diagnosis",
    "subzero.page",
    "subzero.records",
    "subzero.sweeps",
    "subzero.synthetic",
    "subzero",
)
"""Packages with a row of their own; a module belongs to the first that holds it."""
ENGINE_FACES = ("subzero.diagnosis.inference", "subzero.diagnosis.assessment", "subzero.diagnosis.report")
"""Packages whose tests import what their ``__all__`` names."""
REST, ALL = "subzero, rest", "all"
COMPILERS = {"compiled", "inner", "inlined", "allocating", "intrinsic"}
MOST_PARAMETERS = 7
SHORT_LINES = 80
"""A file with one importer and fewer lines than this is no whole concept, but a part of its importer."""
TABLES = ("subzero.diagnosis.hypothesis.catalogue",)
"""Packages whose files are rows of a table, one file for each part of the vehicle."""

Graph = dict[str, set[str]]


@dataclass(frozen=True, kw_only=True)
class Figures:
    """The figures of one package; lists name what is counted."""

    files: int
    lines: int
    files_per_1000: float
    floors: int
    chain: list[str]
    circles: list[list[str]]
    lone: dict[str, int]
    many_parameters: list[str]
    doc_by_source: float
    test_by_source: float
    tests: int
    tests_at_engine_faces: int
    tests_below_faces: int

    @property
    def short_lone(self) -> list[str]:
        """The lone modules that are too short to be a whole concept by themselves, and no rows of a table."""
        short = [name for name, lines in self.lone.items() if lines < SHORT_LINES]
        return [name for name in short if name.rpartition(".")[0] not in TABLES]


class Module:
    """One file of source: its name, its tree, and its lines."""

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.name = path, name
        text = path.read_text(encoding="utf-8")
        self.tree = ast.parse(text)
        self.lines = sum(1 for line in text.splitlines() if line.strip())

    @property
    def docstring_lines(self) -> int:
        """Count lines of docstrings, those of constants (a text behind an assignment) too."""
        texts = [
            node.value
            for node in ast.walk(self.tree)
            if isinstance(node, ast.Expr)
            and isinstance(node.value, ast.Constant)
            and isinstance(node.value.value, str)
        ]
        return sum((text.end_lineno or text.lineno) - text.lineno + 1 for text in texts)

    def imports(self, names: Names, *, types: bool = False) -> set[str]:
        """Return the modules of the product that this one imports; with `types`, those for types only too."""
        found: set[str] = set()
        for node in _nodes(self.tree, types):
            if isinstance(node, ast.Import):
                found |= {alias.name for alias in node.names} & names.modules
            elif isinstance(node, ast.ImportFrom) and not node.level:
                named = {f"{node.module}.{alias.name}" for alias in node.names}
                plain = {name: name if name in names.modules else node.module for name in named}
                found |= {names.homes.get(name, plain[name]) for name in named} & names.modules
        return found - {self.name}

    def hands_on(self) -> dict[str, str]:
        """Return the names that a face hands on → the modules that it has them from."""
        if self.path.name != "__init__.py":
            return {}
        return {
            f"{self.name}.{alias.asname or alias.name}": node.module
            for node in self.tree.body
            if isinstance(node, ast.ImportFrom) and node.module not in (None, self.name)
            for alias in node.names
        }

    def long_signatures(self) -> Iterator[str]:
        """Give the functions with too many parameters that are no compiled kernels."""
        for node in ast.walk(self.tree):
            if isinstance(node, ast.FunctionDef) and not _is_compiled(node):
                count = len([*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs])
                count -= bool(node.args.args) and node.args.args[0].arg in ("self", "cls")
                if count > MOST_PARAMETERS:
                    yield f"{self.name}.{node.name} ({count})"


def _nodes(tree: ast.AST, types: bool) -> Iterator[ast.AST]:
    """Give all nodes of a tree, without what is for types only unless `types`."""
    for node in ast.iter_child_nodes(tree):
        is_for_types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if types or not is_for_types:
            yield node
            yield from _nodes(node, types)


@dataclass(frozen=True)
class Names:
    """All modules of the product, and the names that faces hand on → the modules that they have them from."""

    modules: frozenset[str]
    homes: dict[str, str]

    @classmethod
    def of(cls, product: dict[str, Module]) -> Names:
        """Return the names of a product."""
        homes = {name: home for one in product.values() for name, home in one.hands_on().items()}
        return cls(frozenset(product), {name: home for name, home in homes.items() if home in product})


def _is_compiled(node: ast.FunctionDef) -> bool:
    return any(isinstance(each, ast.Name) and each.id in COMPILERS for each in node.decorator_list)


def modules(folder: Path, root: Path = ROOT) -> dict[str, Module]:
    """Return the modules in a folder by their dotted names."""
    found = {}
    for path in sorted(folder.rglob("*.py")):
        parts = path.relative_to(root).with_suffix("").parts
        name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
        found[name] = Module(path, name)
    return found


def circles(graph: Graph) -> list[list[str]]:
    """Return the sets of modules that import one another (strongly connected), each sorted."""
    ahead = {name: _reached(graph, name) for name in graph}
    found = {tuple(sorted(other for other in ahead[name] if name in ahead[other])) for name in graph}
    return [list(one) for one in sorted(found) if len(one) > 1]


def _reached(graph: Graph, start: str) -> set[str]:
    seen, todo = {start}, [start]
    while todo:
        for name in graph[todo.pop()] & graph.keys() - seen:
            seen.add(name)
            todo.append(name)
    return seen


def longest_chain(graph: Graph) -> list[str]:
    """Return the longest chain of imports, from the top floor to the ground."""
    as_one = {name: circle[0] for circle in circles(graph) for name in circle}
    floors: dict[str, list[str]] = {}

    def below(name: str) -> list[str]:
        if name not in floors:
            members = [each for each in graph if as_one.get(each, each) == name]
            under = {as_one.get(other, other) for each in members for other in graph[each] & graph.keys()}
            floors[name] = [name, *max((below(one) for one in under - {name}), key=len, default=[])]
        return floors[name]

    return max((below(as_one.get(name, name)) for name in graph), key=len, default=[])


def row_of(name: str) -> str:
    """Return the row that a module belongs to."""
    row = next((row for row in ROWS if name == row or name.startswith(f"{row}.")), "")
    return REST if row == "subzero" else row


PUBLIC, ENGINE, BELOW = 0, 1, 2
"""How deep a test reaches into a package: no farther than its face, to the faces of its engine, or below."""


def depth_of(name: str) -> int:
    """Say how deep in its package a module is."""
    if name in (*ROWS, "subzero.jit", "subzero.errors"):
        return PUBLIC
    return ENGINE if name in ENGINE_FACES else BELOW


@dataclass(frozen=True)
class TestFile:
    """A file of tests: how many, how many lines, and how deep it reaches into each row."""

    tests: int
    lines: int
    depths: dict[str, int]

    def reaches(self, row: str) -> int:
        """Return how deep it reaches into a row; into any, for all."""
        return max(self.depths.values(), default=PUBLIC) if row == ALL else self.depths[row]


def test_files(names: Names) -> list[TestFile]:
    """Return all files of tests; helpers without tests count by their lines. What a test has from a face is the face's,
    wherever that has it from.
    """
    found, as_written = [], Names(names.modules, {name: name.rpartition(".")[0] for name in names.homes})
    for module in modules(ROOT / "tests").values():
        tests = sum(
            isinstance(node, ast.FunctionDef) and node.name.startswith("test_")
            for node in ast.walk(module.tree)
        )
        depths: dict[str, int] = defaultdict(int)
        for name in module.imports(as_written, types=True):
            depths[row_of(name)] = max(depths[row_of(name)], depth_of(name))
        found.append(TestFile(tests, module.lines, dict(depths)))
    return found


def figures() -> dict[str, Figures]:
    """Return the figures of every row, and of the whole product."""
    product = {name: one for package in PRODUCT for name, one in modules(ROOT / package).items()}
    names = Names.of(product)
    graph = {name: one.imports(names) for name, one in product.items()}
    any_import = {name: one.imports(names, types=True) for name, one in product.items()}
    importers: Graph = defaultdict(set)
    for name, found in any_import.items():
        for other in found:
            importers[other].add(name)
    tests = test_files(names)
    rows = [*dict.fromkeys(row_of(name) for name in product), ALL]
    return {row: _figures(row, product, graph, importers, tests) for row in rows}


def _figures(
    row: str, product: dict[str, Module], graph: Graph, importers: Graph, tests: list[TestFile]
) -> Figures:
    """Return the figures of one row."""
    inside = [name for name in product if row in (ALL, row_of(name))]
    own = {name: graph[name] for name in inside}
    lines = sum(product[name].lines for name in inside)
    chain = longest_chain(own)
    if row == ALL:
        here, shared = tests, sum(one.lines for one in tests)
    else:
        here = [one for one in tests if row in one.depths]
        shared = sum(one.lines / len(one.depths) for one in here)
    return Figures(
        files=len(inside),
        lines=lines,
        files_per_1000=1000.0 * len(inside) / lines,
        floors=len(chain),
        chain=chain,
        circles=circles(own),
        lone={
            name: product[name].lines
            for name in inside
            if len(importers[name]) == 1 and product[name].path.name not in ("__init__.py", "__main__.py")
        },
        many_parameters=[each for name in inside for each in product[name].long_signatures()],
        doc_by_source=sum(product[name].docstring_lines for name in inside) / lines,
        test_by_source=shared / lines,
        tests=sum(one.tests for one in here),
        tests_at_engine_faces=sum(one.tests for one in here if one.reaches(row) == ENGINE),
        tests_below_faces=sum(one.tests for one in here if one.reaches(row) == BELOW),
    )


def table(found: dict[str, Figures]) -> str:
    """Return the figures as lines of a table."""
    head = (
        f"{'package':<18}{'files':>6}{'lines':>7}{'/1000':>6}{'floors':>7}{'circles':>8}{'lone':>5}"
        f"{'>7 par.':>8}{'doc':>6}{'test':>6}{'tests':>7}{'engine faces':>14}{'below':>7}"
    )
    rows = [
        f"{row:<18}{one.files:>6}{one.lines:>7}{one.files_per_1000:>6.1f}{one.floors:>7}{len(one.circles):>8}"
        f"{len(one.lone):>5}{len(one.many_parameters):>8}{one.doc_by_source:>6.2f}{one.test_by_source:>6.2f}"
        f"{one.tests:>7}{one.tests_at_engine_faces:>14}{one.tests_below_faces:>7}"
        for row, one in found.items()
    ]
    return "\n".join([head, *rows])


@dataclass(frozen=True, kw_only=True)
class Goal:
    """What is asked of a figure: its name, what was found, and the most that it may be; `places` has what is over."""

    name: str
    found: float
    most: float
    places: tuple[str, ...] = ()

    def line(self) -> str:
        """Return a line of the table of targets."""
        met = "met" if self.found <= self.most else "NOT"
        places = f"  {', '.join(self.places)}" if self.places and met == "NOT" else ""
        return f"{self.name:<58}{self.found:>7.3g}{self.most:>7.3g}  {met}{places}"


MOST_FILES_PER_1000 = 7.5
SMALL_FILES = ("vehicle",)
"""Packages of many small parts that are alike, a file for each: a force, an actuator."""
FEW_FILES = 5
"""A package of no more files than a reader follows to understand one thing is not scattered, however short they are."""


def scattered(found: dict[str, Figures]) -> dict[str, Figures]:
    """Return the packages that have more files for their lines than is asked for."""
    return {
        row: one
        for row, one in found.items()
        if one.files > FEW_FILES and one.files_per_1000 > MOST_FILES_PER_1000
    }


DIAGNOSIS = "subzero.diagnosis"
NO_ENGINE = ("subzero.diagnosis.hypothesis.catalogue", "subzero.diagnosis.report")
SETTINGS = "subzero.diagnosis.inference.settings"
"""The diagnosis, what of it is no engine, and where all settings of its search stand."""


def engine_goals() -> list[Goal]:
    """Return what is asked of the engine of a diagnosis: files, settings of the search, and floors of classes."""
    inside = {name: one for name, one in modules(ROOT.joinpath(*DIAGNOSIS.split("."))).items()
              if not name.startswith(NO_ENGINE)}  # fmt: skip
    settings = [target.id for node in ast.walk(inside[SETTINGS].tree) if isinstance(node, ast.Assign)
                for target in ast.walk(node) if isinstance(target, ast.Name)]  # fmt: skip
    bases = {node.name: [ast.unparse(base) for base in node.bases]
             for one in inside.values() for node in ast.walk(one.tree) if isinstance(node, ast.ClassDef)}  # fmt: skip
    depth = longest_chain({name: set(own) for name, own in bases.items()})
    return [
        Goal(name="files of its engine (without catalogue and report)", found=len(inside), most=45),
        Goal(name="settings of its search", found=len(settings), most=30),
        Goal(name="classes below one another in it", found=len(depth) - 1, most=1, places=tuple(depth)),
    ]


def goals(found: dict[str, Figures]) -> list[Goal]:
    """Return what is asked for, with the figures that stand."""
    whole, diagnosis = found[ALL], found["subzero.diagnosis"]
    counted = {
        row: one for row, one in found.items() if row not in (ALL, *SMALL_FILES) and one.files > FEW_FILES
    }
    over = scattered(counted)
    densest = max(one.files_per_1000 for one in counted.values())
    return [
        Goal(name="files of the diagnosis", found=diagnosis.files, most=60),
        *engine_goals(),
        Goal(name="floors of the diagnosis", found=diagnosis.floors, most=12),
        Goal(name="floors of the whole product", found=whole.floors, most=22),
        Goal(
            name="files per 1000 lines, most in a package (vehicle left out)",
            found=densest,
            most=MOST_FILES_PER_1000,
            places=tuple(over),
        ),
        Goal(name="circles", found=len(whole.circles), most=0),
        Goal(
            name=f"lone modules of fewer than {SHORT_LINES} lines",
            found=len(whole.short_lone),
            most=0,
            places=tuple(whole.short_lone),
        ),
        Goal(
            name=f"functions with more than {MOST_PARAMETERS} parameters",
            found=len(whole.many_parameters),
            most=0,
            places=tuple(row for row, one in found.items() if row != ALL and one.many_parameters),
        ),
        Goal(
            name="% of diagnosis tests below its faces",
            found=100.0 * diagnosis.tests_below_faces / max(diagnosis.tests, 1),
            most=10,
        ),
    ]


def targets(found: dict[str, Figures]) -> str:
    """Return the targets as lines of a table."""
    head = f"{'asked for':<58}{'is':>7}{'target':>7}"
    return "\n".join([head, *(goal.line() for goal in goals(found))])


def main() -> None:
    """Print the tables, and write the figures as JSON if asked for."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--json", type=Path, help="file for all figures, with the names behind the counts")
    parser.add_argument("--list", action="store_true", help="print the names behind the counts too")
    parser.add_argument(
        "--lone", action="store_true", help="print the lone modules of each row, with their lines"
    )
    asked = parser.parse_args()
    found = figures()
    print(table(found), targets(found), sep="\n\n")
    if asked.lone:
        for row, one in found.items():
            if row != ALL:
                print(f"\n{row}:", *(f"  {lines:>4} {name}" for name, lines in one.lone.items()), sep="\n")
    if asked.list:
        for name in ("chain", "circles", "lone", "many_parameters"):
            print(f"\n{name}:", *(f"  {each}" for each in getattr(found[ALL], name)), sep="\n")
    if asked.json:
        asked.json.write_text(json.dumps({row: asdict(one) for row, one in found.items()}, indent=1))


if __name__ == "__main__":
    main()
