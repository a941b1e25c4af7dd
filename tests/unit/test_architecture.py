"""Imports run one way, layer by layer and without a circle, and heavy libraries stay inside functions."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

LAYERS = [
    {"arrays", "interruption", "toml_lines", "words"},
    {"bench", "errors", "figures", "files", "keywords", "late", "moment", "parallel"},
    {"drive"},
    {"effects", "recordings", "kinematics", "mechanics"},
    {"tolerance", "simulation"},
    {"optimize", "allocation", "diagnosis", "geometry", "compensation"},
    {"report", "study"},
    {"workflow"},
    {"cli", "studies"},
    {"__main__"},
]
"""Lowest first: a room may import from the layers below its own, and from no other room of its own layer."""

BESIDE = {
    ("parallel", "errors"): "the errors are the ground that every room stands on",
    ("figures", "errors"): "the errors are the ground that every room stands on",
    ("keywords", "errors"): "the errors are the ground that every room stands on",
    ("moment", "errors"): "the errors are the ground that every room stands on",
    ("files", "errors"): "the errors are the ground that every room stands on",
    ("parallel", "files"): "finished parts are kept on disk, whole or not at all",
    ("geometry", "allocation"): "fits are made of the IT grades of ISO 286, which stand once",
    ("tolerance", "simulation"): "a stack may respond with the extended model",
    ("kinematics", "mechanics"): "measured teeth share the load over the contact angle",
    ("recordings", "effects"): "rows are the conditions that effects see, with the error beside them",
}
"""Imports between rooms of one layer, with the reason."""

TOP = {
    "__init__.py",
    "__main__.py",
    "arrays.py",
    "errors.py",
    "figures.py",
    "files.py",
    "interruption.py",
    "keywords.py",
    "late.py",
    "moment.py",
    "toml_lines.py",
    "words.py",
}

HEAVY = {"cadquery", "plotly", "cvxpy", "SALib", "openturns", "distributed", "dask", "nlopt", "pymoo", "vtk", "OCP"}

FOLDERS = {"hdopt": ROOT / "hdopt", "hdopt.geometry": ROOT / "geometry", "hdopt.studies": ROOT / "studies"}


def sources():
    for package, folder in FOLDERS.items():
        for file in sorted(folder.rglob("*.py")):
            parts = file.relative_to(folder).with_suffix("").parts
            yield ".".join((package, *(part for part in parts if part != "__init__"))), file


SOURCES = dict(sources())


def tree_of(module: str) -> ast.Module:
    return ast.parse(SOURCES[module].read_text(encoding="utf-8"))


def room_of(module: str) -> str | None:
    """'allocation' of 'hdopt.allocation.rules', None for the package itself."""
    parts = module.split(".")
    return parts[1] if len(parts) > 1 else None


def layer_of(room: str) -> int:
    for number, rooms in enumerate(LAYERS):
        if room in rooms:
            return number
    raise AssertionError(f"{room} is in no layer; add it to LAYERS where it belongs")


def imports(tree: ast.Module, *, at_import: bool) -> set[str]:
    """Modules imported anywhere, in functions and for type checking too, or only those imported with the module."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if at_import and isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if at_import and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide which layer is meant"
            submodules = {f"{node.module}.{alias.name}" for alias in node.names} & SOURCES.keys()
            found.update(submodules)
            if len(submodules) < len(node.names):
                found.add(node.module)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(tree)
    return found


@pytest.fixture(scope="module")
def graph() -> dict[str, set[str]]:
    """Module -> what it imports: read where it is asked for, not by all who collect tests."""
    return {module: imports(tree_of(module), at_import=False) for module in SOURCES}


def room_edges(graph: dict[str, set[str]]) -> dict[tuple[str, str], list[str]]:
    """(importing room, imported room) -> the modules that do it."""
    edges: dict[tuple[str, str], list[str]] = {}
    for module, targets in graph.items():
        own = room_of(module)
        for target in targets:
            other = room_of(target) if target.startswith("hdopt.") else None
            if own and other and own != other:
                edges.setdefault((own, other), []).append(f"{module} imports {target}")
    return edges


def forbidden(edges: dict[tuple[str, str], list[str]]) -> set[tuple[str, str]]:
    """Edges that do not lead from a layer to one below it, but for those listed with a reason."""
    return {(own, other) for own, other in edges if layer_of(other) >= layer_of(own) and (own, other) not in BESIDE}


def circles(graph: dict[str, set[str]]) -> set[frozenset[str]]:
    """The groups of modules that reach each other (Tarjan's strongly connected components)."""
    index: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: set[frozenset[str]] = set()

    def visit(module: str) -> None:
        index[module] = low[module] = len(index)
        stack.append(module)
        for other in graph[module] & graph.keys() - {module}:
            if other not in index:
                visit(other)
                low[module] = min(low[module], low[other])
            elif other in stack:
                low[module] = min(low[module], index[other])
        if low[module] == index[module]:
            group = stack[stack.index(module) :]
            del stack[stack.index(module) :]
            if len(group) > 1:
                found.add(frozenset(group))

    for module in graph:
        if module not in index:
            visit(module)
    return found


def test_imports_run_one_way(graph):
    edges = room_edges(graph)
    wrong = forbidden(edges)
    assert not wrong, [line for edge in wrong for line in edges[edge]]


def test_no_modules_import_each_other_in_a_circle(graph):
    found = [sorted(group) for group in circles(graph)]
    assert not found, found


def test_the_reasons_of_neighbours_are_still_needed(graph):
    assert BESIDE.keys() <= room_edges(graph).keys()


CHANGE_AS_THEY_WORK = {"FilesOfWork", "AllocationWatch", "DiagnosisWatch", "Doing"}
"""Dataclasses that look on while something is done; all others are values."""


def test_values_are_frozen():
    """Would catch a dataclass that is changed by the one it was handed to."""
    found = set()
    for path in (ROOT / "hdopt").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            for mark in node.decorator_list if isinstance(node, ast.ClassDef) else ():
                plain = ast.unparse(mark)
                if plain.startswith("dataclass") and "frozen=True" not in plain:
                    found.add(node.name)
    assert found == CHANGE_AS_THEY_WORK


def test_the_rules_of_this_page_bite():
    graph = {"hdopt.drive.a": {"hdopt.drive.b"}, "hdopt.drive.b": {"hdopt.drive.a"}, "hdopt.drive.c": {"hdopt.drive.a"}}
    assert circles(graph) == {frozenset({"hdopt.drive.a", "hdopt.drive.b"})}
    assert forbidden(room_edges({"hdopt.report.x": {"hdopt.study.y"}})) == {("report", "study")}
    assert forbidden(room_edges({"hdopt.drive.x": {"hdopt.kinematics.y"}})) == {("drive", "kinematics")}
    assert not forbidden(room_edges({"hdopt.workflow.x": {"hdopt.report.y", "hdopt.workflow.z"}}))
    lazy = ast.parse(
        "from typing import TYPE_CHECKING\nif TYPE_CHECKING:\n    import hdopt.cli\ndef f():\n    import x"
    )
    assert imports(lazy, at_import=False) == {"typing", "hdopt.cli", "x"}
    assert imports(lazy, at_import=True) == {"typing"}


def test_the_top_of_the_package_computes_nothing():
    assert {file.name for file in (ROOT / "hdopt").glob("*.py")} == TOP


@pytest.mark.parametrize("module", SOURCES)
def test_heavy_libraries_are_imported_where_they_are_used(module):
    roots = {target.split(".")[0] for target in imports(tree_of(module), at_import=True)}
    assert not roots & HEAVY
