"""How easy the code is to carry on, in figures: sizes and their budgets, import chains, constants, comments, words.

    python -m benchmarks.house                   # figures of each package, and what is asked for with what is found
    python -m benchmarks.house --list            # the names behind the counts

lines        of source that are not blank; "/1000": files in a thousand of them
floors       modules on the longest chain of imports inside a package; imports inside functions count, those for types
             (``TYPE_CHECKING``) do not; a name that a face hands on counts as its module's; a circle counts as one
circles      sets of modules that import one another, by any import
lone         modules with one importer and fewer than 80 lines: parts of it. Faces and rows of tables are left out
> 7 par.     functions with more parameters, outside compiled kernels
tests        of a package; "below": those whose file imports more of it than its faces, what a user imports
constants    numbers as `benchmarks.constants` counts them; modules that are tables of settings are left out
comments     lines with a comment that is not for a linter; private words: see `benchmarks.words`
"""

from __future__ import annotations

import argparse
import ast
import io
import re
import tokenize
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from math import inf
from pathlib import Path

from benchmarks import constants, words

ROOT = Path(__file__).resolve().parents[1]
PRODUCT = ("subzero", "cable", "vehicle", "scenarios")
INSIDE = ("autopilot", "calibration", "diagnosis", "page", "records", "sweeps", "synthetic")
ROWS = ("cable", "vehicle", "scenarios", *(f"subzero.{name}" for name in INSIDE), "subzero")
"""Packages with a row of their own; a module belongs to the first that holds it."""
REST, ALL = "subzero, rest", "all"
FACES = {
    *ROWS,
    "subzero.jit",
    "subzero.errors",
    "subzero.diagnosis.inference",
    "subzero.diagnosis.assessment",
    "subzero.diagnosis.verdict",
}
FACES |= {"subzero.diagnosis.report"}
"""Modules that tests of a package may import."""
COMPILERS = {"compiled", "inner", "inlined", "expanded", "allocating", "intrinsic"}
MOST_PARAMETERS = 7
SHORT_LINES = 80
TABLES = ("subzero.diagnosis.hypothesis.catalogue",)
"""Packages whose files are rows of a table, one file for each part of the vehicle."""

BUDGETS = {
    "jit": (r"subzero\.jit\b", 350),
    "files, interrupts, checkpoint": (
        r"subzero\.files\b|.*\.(checkpoint|atomic_output|interrupts|unbroken|user_file|overview)$", 600),
    "sweeps": (r"subzero\.sweeps\b", 1700),
    "trust": (r"subzero\.validity\b|.*\.(convergence|refinement)$", 550),
    "cable": (r"cable\b", 7200),
    "vehicle": (r"vehicle\b", 1800),
    "scenarios": (r"scenarios\b", 2100),
    "command line and what it writes": (r"subzero\.(cli|write_|voice$|progress$|__main__$)", 1900),
    "explore": (r"subzero\.explore|.*\.local_access$", 600),
    "figures": (r"subzero\.figures\b|.*\.accessor$", 1300),
    "diagnosis": (r"subzero\.(diagnosis|identification)\b", 12000),
    "calibration": (r"subzero\.calibration\b", 1100),
    "autopilot": (r"subzero\.autopilot\b|.*\.gym_environment$", 2800),
    "import of logs": (r"subzero\.logs\b", 1200),
    "the rest": (r".*", 6600),
}  # fmt: skip
"""Part of the product → its modules, those of no part before it, and how many lines they may have."""
COMMENTED = (
    r"subzero\.(jit|validity)\b|subzero\.diagnosis\..*noise|.*\.(block_solver|convergence|refinement)$"
)
"""Modules that are subtle."""
SETTINGS_LIKE = r".*\.(settings|quantities|channels|catalogue\..*)$"
"""Modules that are tables of numbers with their meaning."""
FOR_LINTERS = re.compile(r"#\s*(noqa|fmt:|type:|pragma)")

Graph = dict[str, set[str]]


class Module:
    """One file of source: its name, its tree, and its lines."""

    def __init__(self, path: Path, name: str) -> None:
        self.path, self.name = path, name
        self.text = path.read_text(encoding="utf-8")
        self.tree = ast.parse(self.text)
        self.lines = sum(1 for line in self.text.splitlines() if line.strip())

    @cached_property
    def comments(self) -> int:
        """Lines with a comment that is not for a linter."""
        tokens = tokenize.generate_tokens(io.StringIO(self.text).readline)
        return sum(token.type == tokenize.COMMENT and not FOR_LINTERS.match(token.string) for token in tokens)

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
    """Give all nodes of a tree, without those for types only unless `types`."""
    for node in ast.iter_child_nodes(tree):
        is_for_types = isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        if types or not is_for_types:
            yield node
            yield from _nodes(node, types)


def _is_compiled(node: ast.FunctionDef) -> bool:
    return any(isinstance(each, ast.Name) and each.id in COMPILERS for each in node.decorator_list)


@dataclass(frozen=True)
class Names:
    """All modules of the product, and the names that faces hand on → the modules that they have them from."""

    modules: frozenset[str]
    homes: dict[str, str]

    @classmethod
    def of(cls, product: dict[str, Module]) -> Names:
        """Return the names of a product."""
        homes = {name: home for module in product.values() for name, home in module.hands_on().items()}
        return cls(frozenset(product), {name: home for name, home in homes.items() if home in product})


@cache
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
    return [list(circle) for circle in sorted(found) if len(circle) > 1]


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
            floors[name] = [name, *max((below(other) for other in under - {name}), key=len, default=[])]
        return floors[name]

    return max((below(as_one.get(name, name)) for name in graph), key=len, default=[])


def row_of(name: str) -> str:
    """Return the row that a module belongs to."""
    row = next((row for row in ROWS if name == row or name.startswith(f"{row}.")), "")
    return REST if row == "subzero" else row


@dataclass(frozen=True, kw_only=True)
class Figures:
    """The figures of one package; lists name what is counted."""

    files: int
    lines: int
    chain: list[str]
    circles: list[list[str]]
    short_lone: list[str]
    many_parameters: list[str]
    tests: int
    tests_below_faces: int

    @property
    def floors(self) -> int:
        """Modules on the longest chain of imports."""
        return len(self.chain)

    @property
    def files_per_1000(self) -> float:
        """Files in a thousand lines."""
        return 1000.0 * self.files / self.lines


@cache
def product() -> dict[str, Module]:
    """Return the modules of the four packages."""
    return {name: module for package in PRODUCT for name, module in modules(ROOT / package).items()}


def figures() -> dict[str, Figures]:
    """Return the figures of every row, and of the whole product."""
    every = product()
    names = Names.of(every)
    graph = {name: module.imports(names) for name, module in every.items()}
    importers: Graph = defaultdict(set)
    for name, module in every.items():
        for other in module.imports(names, types=True):
            importers[other].add(name)
    tests, found = _tests(names), {}
    for row in [*dict.fromkeys(row_of(name) for name in every), ALL]:
        inside = [name for name in every if row in (ALL, row_of(name))]
        own = {name: graph[name] for name in inside}
        found[row] = Figures(
            files=len(inside),
            lines=sum(every[name].lines for name in inside),
            chain=longest_chain(own),
            circles=circles(own),
            short_lone=[name for name in inside if len(importers[name]) == 1 and _is_short(every[name])],
            many_parameters=[each for name in inside for each in every[name].long_signatures()],
            tests=sum(count for count, rows, _ in tests if row in rows or row == ALL),
            tests_below_faces=sum(
                count for count, _, below in tests if row in below or (row == ALL and below)
            ),
        )
    return found


def _is_short(module: Module) -> bool:
    is_own = module.path.name not in ("__init__.py", "__main__.py")
    return is_own and module.lines < SHORT_LINES and module.name.rpartition(".")[0] not in TABLES


def _tests(names: Names) -> list[tuple[int, set[str], set[str]]]:
    """Return, of each file of tests, how many there are, the rows that it imports, and those below their faces."""
    as_written = Names(names.modules, {name: name.rpartition(".")[0] for name in names.homes})
    found = []
    for module in modules(ROOT / "tests").values():
        functions = [node for node in ast.walk(module.tree) if isinstance(node, ast.FunctionDef)]
        used = module.imports(as_written, types=True)
        rows, below = {row_of(name) for name in used}, {row_of(name) for name in used if name not in FACES}
        found.append((sum(node.name.startswith("test_") for node in functions), rows, below))
    return found


def table(found: dict[str, Figures]) -> str:
    """Return the figures as lines of a table."""
    head = "package             files  lines /1000 floors circles lone >7 par.  tests below"
    rows = [
        f"{row:<20}{one.files:>5}{one.lines:>7}{one.files_per_1000:>6.1f}{one.floors:>7}{len(one.circles):>8}"
        f"{len(one.short_lone):>5}{len(one.many_parameters):>8}{one.tests:>7}{one.tests_below_faces:>6}"
        for row, one in found.items()
    ]
    return "\n".join([head, *rows])


MOST_PLACES = 6
"""Names that are printed behind a figure without --list."""


@dataclass(frozen=True, kw_only=True)
class Goal:
    """What is asked of a figure: its name, the value found, and its limits; `places` has the names behind it."""

    name: str
    found: float
    most: float = inf
    least: float = -inf
    places: tuple[str, ...] = ()

    @property
    def is_met(self) -> bool:
        """Whether the figure is within its limits."""
        return self.least <= self.found <= self.most

    def line(self, everything: bool = False) -> str:
        """Return a line of the table of targets, with the names behind it if it is not met, or with `everything`."""
        limit = f"≤ {self.most:g}" if self.most < inf else f"≥ {self.least:g}" if self.least > -inf else "-"
        met = "" if limit == "-" else "met" if self.is_met else "NOT"
        places = self.places if everything else self.places[:MOST_PLACES] if met == "NOT" else ()
        more = ", …" if len(places) < len(self.places) and places else ""
        shown = f"  {', '.join(places)}{more}" if places else ""
        return f"{self.name:<52}{self.found:>9.5g}  {limit:<8}{met:<4}{shown}".rstrip()


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


def budgets(every: dict[str, Module]) -> list[Goal]:
    """Return the lines of each part of the product, of the whole and of the benchmarks, with their budgets."""
    parts: dict[str, list[Module]] = {name: [] for name in BUDGETS}
    for name, module in every.items():
        part = next(part for part, (pattern, _) in BUDGETS.items() if re.match(pattern, name))
        parts[part].append(module)
    found = [
        Goal(name="lines: the product", found=sum(module.lines for module in every.values()), most=41000)
    ]
    for part, (_, most) in BUDGETS.items():
        found.append(
            Goal(name=f"lines: {part}", found=sum(module.lines for module in parts[part]), most=most)
        )
    lines = sum(module.lines for module in modules(ROOT / "benchmarks").values())
    return [*found, Goal(name="lines: benchmarks", found=lines, most=7000)]


def style_goals(every: dict[str, Module]) -> list[Goal]:
    """Return what is asked of constants, comments, words and the first level of `subzero`."""
    own = [module for name, module in every.items() if not re.match(SETTINGS_LIKE, name)]
    named = {module.name: constants.named(module.tree) for module in own}
    trees = [module.tree for module in every.values()]
    most = sorted(named, key=lambda name: -len(named[name]))[:5]
    subtle = [module for name, module in every.items() if re.match(COMMENTED, name)]
    direct = [name for name, module in every.items() if module.path.parent == ROOT / "subzero"]
    skips = [name for name, module in every.items() if "fmt: skip" in module.text]
    count, lines = words.counts(), sum(module.lines for module in every.values())
    return [
        Goal(name="constants: names bound to numbers, without settings", found=sum(map(len, named.values())), most=250,
             places=tuple(f"{name} {len(named[name])}" for name in most)),
        Goal(name="constants: defaults of arguments", found=sum(map(constants.defaults, trees))),
        Goal(name="constants: in bodies of functions", found=sum(map(constants.bare, trees))),
        Goal(name="% of lines with a comment", found=_commented(list(every.values())), least=2),
        Goal(name="% … jit, block solver, noise, trust", found=_commented(subtle), least=3,
             places=tuple(f"{module.name} {_commented([module]):.1f}" for module in subtle)),
        Goal(name="private words on pages", found=count["pages"], most=0),
        Goal(name="private words in names", found=count["names"], most=0),
        Goal(name="private words in docstrings, per 1000 lines", found=1000.0 * count["docstrings"] / lines, most=3),
        Goal(name="private words in messages, per 1000 lines", found=1000.0 * count["messages"] / lines, most=3),
        Goal(name="modules directly in subzero/", found=len(direct), most=8, places=tuple(direct)),
        Goal(name="files with fmt: skip", found=len(skips), most=0, places=tuple(skips)),
    ]  # fmt: skip


def _commented(some: list[Module]) -> float:
    """Return the share of lines with a comment. [%]"""
    lines = sum(module.lines for module in some)
    return 100.0 * sum(module.comments for module in some) / max(lines, 1)


ENGINE = r"subzero\.diagnosis\b(?!\.hypothesis\.catalogue|\.report)"
"""Modules of the diagnosis without those that are words or tables."""


def engine_goals(every: dict[str, Module]) -> list[Goal]:
    """Return what is asked of the engine of a diagnosis: files, and floors of classes."""
    inside = {name: module for name, module in every.items() if re.match(ENGINE, name)}
    classes = [node for m in inside.values() for node in ast.walk(m.tree) if isinstance(node, ast.ClassDef)]
    depth = longest_chain({node.name: {ast.unparse(base) for base in node.bases} for node in classes})
    return [
        Goal(name="diagnosis: files of its engine", found=len(inside), most=45),
        Goal(name="diagnosis: classes below one another", found=len(depth) - 1, most=1, places=tuple(depth)),
    ]


def structure_goals(found: dict[str, Figures]) -> list[Goal]:
    """Return what is asked of files and imports."""
    whole, diagnosis = found[ALL], found["subzero.diagnosis"]
    packages = {
        row: one for row, one in found.items() if row not in (ALL, *SMALL_FILES) and one.files > FEW_FILES
    }
    return [
        Goal(name="floors of the whole product", found=whole.floors, most=16, places=tuple(whole.chain)),
        Goal(name="circles", found=len(whole.circles), most=0, places=tuple(map(str, whole.circles))),
        Goal(name="files per 1000 lines, most in a package but vehicle", most=MOST_FILES_PER_1000,
             found=max(one.files_per_1000 for one in packages.values()), places=tuple(scattered(packages))),
        Goal(name=f"lone modules of fewer than {SHORT_LINES} lines", found=len(whole.short_lone), most=0,
             places=tuple(whole.short_lone)),
        Goal(name=f"functions with more than {MOST_PARAMETERS} parameters", found=len(whole.many_parameters), most=0,
             places=tuple(whole.many_parameters)),
        Goal(name="diagnosis: files", found=diagnosis.files, most=60),
        Goal(name="diagnosis: floors", found=diagnosis.floors, most=12, places=tuple(diagnosis.chain)),
        Goal(name="diagnosis: % of tests below its faces", most=10,
             found=100.0 * diagnosis.tests_below_faces / max(diagnosis.tests, 1)),
    ]  # fmt: skip


def goals(found: dict[str, Figures]) -> list[Goal]:
    """Return all that is asked for, with the values found."""
    every = product()
    return [*budgets(every), *style_goals(every), *structure_goals(found), *engine_goals(every)]


def targets(asked: list[Goal], everything: bool = False) -> str:
    """Return the targets as lines of a table."""
    return "\n".join([f"{'asked for':<52}{'found':>9}  target", *(goal.line(everything) for goal in asked)])


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--list", action="store_true", help="print the names behind all counts too")
    asked = parser.parse_args()
    found = figures()
    print(table(found), targets(goals(found), asked.list), sep="\n\n")


if __name__ == "__main__":
    main()
