"""Imports run one way, and heavy libraries stay inside functions."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

LAYERS = [
    {"errors", "files"},
    {"drive", "deviations", "profiles"},
    {"contact", "bending", "kinematics"},
    {"spectrum"},
    {"engine", "tolerance", "sensitivity", "recording", "recording_checks", "recording_sync", "diagnosis", "extended"},
    {"study"},
    {"included"},
    {"analysis", "extended_look", "tolerancing", "allocation", "trade", "diagnosis.write_back"},
    {"geometry", "report"},
    {"steps", "studies"},
    {"run"},
    {"cli"},
]
"""Lowest first: a module may import from its own layer and from those below."""

HEAVY = {"cadquery", "plotly", "cvxpy", "SALib", "openturns", "distributed", "dask", "nlopt", "pymoo", "vtk", "OCP"}

FOLDERS = {"hdopt": ROOT / "hdopt", "hdopt.geometry": ROOT / "geometry", "hdopt.studies": ROOT / "studies"}


def sources():
    for package, folder in FOLDERS.items():
        for file in sorted(folder.rglob("*.py")):
            parts = file.relative_to(folder).with_suffix("").parts
            yield ".".join((package, *(part for part in parts if part != "__init__"))), file


SOURCES = dict(sources())


def layer_of(module: str) -> int | None:
    """The layer of 'hdopt.X...', None for the package itself."""
    parts = module.split(".")
    if len(parts) < 2:
        return None
    for name in (".".join(parts[1:3]), parts[1]):
        for number, names in enumerate(LAYERS):
            if name in names:
                return number
    raise AssertionError(f"{module} is in no layer; add it to LAYERS where it belongs")


def imports(tree: ast.Module, *, at_import: bool) -> set[str]:
    """Modules imported anywhere, or only those imported when the module is (type-checking blocks are neither)."""
    found: set[str] = set()

    def visit(node: ast.AST) -> None:
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            return
        if at_import and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            return
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, "relative imports hide which layer is meant"
            found.add(node.module)
            if node.module == "hdopt":
                found.update(f"hdopt.{alias.name}" for alias in node.names)
        for child in ast.iter_child_nodes(node):
            visit(child)

    visit(tree)
    return found


@pytest.mark.parametrize("module", SOURCES)
def test_imports_run_one_way(module):
    own = layer_of(module)
    if own is None:
        return
    for target in imports(ast.parse(SOURCES[module].read_text()), at_import=False):
        if target.startswith("hdopt.") and (below := layer_of(target)) is not None:
            assert below <= own, f"{module} imports {target}, which lies above it"


@pytest.mark.parametrize("module", SOURCES)
def test_heavy_libraries_are_imported_where_they_are_used(module):
    roots = {target.split(".")[0] for target in imports(ast.parse(SOURCES[module].read_text()), at_import=True)}
    assert not roots & HEAVY
