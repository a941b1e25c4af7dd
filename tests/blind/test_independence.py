"""The bench and the scorer must share no code with what they judge."""

import ast
import sys
from pathlib import Path

import pytest

BENCH = Path(__file__).resolve().parents[2] / "hdopt" / "bench"
BENCH_MAY_USE = {"numpy", "scipy", "pandas", "numba", "pyarrow"}
SCORER_MAY_USE = {"numpy", "scipy", "pandas"}
SOURCES = sorted(BENCH.rglob("*.py"))


def imported(path):
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path.name}: relative import"
            yield node.module


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.name)
def test_only_libraries_and_its_own_files_are_imported(path):
    allowed = SCORER_MAY_USE if path.name in ("marking.py", "score.py", "scores.py", "thresholds.py") else BENCH_MAY_USE
    for name in imported(path):
        top = name.split(".")[0]
        own = name == "hdopt.bench" or name.startswith("hdopt.bench.")
        assert own or top in sys.stdlib_module_names or top in allowed, f"{path.name} imports {name}"


def test_nothing_is_imported_under_a_name_that_the_source_does_not_show():
    for path in SOURCES:
        called = {
            n.func.id
            for n in ast.walk(ast.parse(path.read_text()))
            if isinstance(n, ast.Call) and isinstance(n.func, ast.Name)
        }
        assert not called & {"__import__", "exec", "eval"}, path.name
        assert "importlib" not in path.read_text(), path.name
