"""Rules of the house that the linter does not know: length of functions, docstrings that name every argument."""

import ast
import io
import re
import tokenize
import tomllib
from collections import Counter
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]

LONGEST = 60


def functions(tree: ast.Module):
    """Every function of a module, those of classes and of functions too."""
    for node in ast.walk(tree):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
            yield node


def length(node: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Lines from `def` to the last statement; decorators do not count."""
    return node.end_lineno - node.lineno + 1


def public_functions(tree: ast.Module):
    """Functions at the top of a module whose names others may use."""
    for node in tree.body:
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not node.name.startswith("_"):
            yield node


def unnamed_arguments(node: ast.FunctionDef | ast.AsyncFunctionDef) -> list[str]:
    """Arguments that the function's docstring does not mention by name."""
    words = set(re.findall(r"\w+", ast.get_docstring(node) or ""))
    given = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return [argument.arg for argument in given if argument.arg not in words]


@pytest.fixture(scope="module")
def trees():
    """Path -> syntax tree of every file of the package: read where they are asked for, not by all who collect tests."""
    files = (path for top in ("hdopt", "geometry", "studies") for path in sorted((ROOT / top).rglob("*.py")))
    return {path.relative_to(ROOT): ast.parse(path.read_text(encoding="utf-8")) for path in files}


def test_no_function_is_longer_than_sixty_lines(trees):
    long = {f"{path} {node.name}" for path, tree in trees.items() for node in functions(tree) if length(node) > LONGEST}
    assert long == set()


def test_every_folder_of_python_is_a_package_that_is_installed(trees):
    """Would catch a new folder that only a checkout has: what was installed stops at its import."""
    installed = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    dotted = {str(path.parent).replace("/", ".") for path in trees}
    assert set(installed) == {f"hdopt.{name}" if name in ("geometry", "studies") else name for name in dotted}


def test_test_files_have_names_of_their_own():
    """Would catch two files of one name in folders that are no packages: one of them is then not collected."""
    tests = Path(__file__).resolve().parents[1]
    loose = [file.name for file in tests.rglob("test_*.py") if not (file.parent / "__init__.py").exists()]
    assert [name for name, n in Counter(loose).items() if n > 1] == []


def test_docstrings_name_every_argument(trees):
    """Commands do not count: their arguments are described by their options."""
    unnamed = {
        f"{path} {node.name}: {argument}"
        for path, tree in trees.items()
        if path.parts[:2] != ("hdopt", "cli")
        for node in public_functions(tree)
        for argument in unnamed_arguments(node)
    }
    assert unnamed == set()


def array_aliases(tree: ast.Module) -> set[str]:
    """The array types of `hdopt.arrays` that a module spells out itself."""
    return {
        ast.unparse(node)
        for node in ast.walk(tree)
        if isinstance(node, ast.Subscript)
        and ast.unparse(node) in {"NDArray[np.float64]", "NDArray[np.int64]", "NDArray[np.bool_]"}
    }


def test_array_types_are_named_once(trees):
    """The bench shares no code with the rest and names its own."""
    spelled = {path: array_aliases(tree) for path, tree in trees.items() if path.parts[1] != "bench"}
    assert {path for path, found in spelled.items() if found} == {Path("hdopt/arrays.py")}


def without_reason(source: str) -> list[str]:
    """Lines with `Any` or `type: ignore` that say no reason, there or, for `Any`, where it is imported."""
    lines = source.splitlines()
    imported = any(re.search(r"import .*\bAny\b.*# Any: \w", line) for line in lines)
    code = {token.start[0] for token in tokens(source) if token.type == tokenize.NAME and token.string == "Any"}
    bare = [lines[n - 1] for n in sorted(code) if " import " not in lines[n - 1] and "#" not in lines[n - 1]]
    return ([] if imported else bare) + [line for line in lines if re.search(r"type: ignore\S*\s*$", line)]


def tokens(source: str):
    return tokenize.generate_tokens(io.StringIO(source).readline)


def test_what_types_leave_open_has_its_reason(trees):
    sources = {path: (ROOT / path).read_text(encoding="utf-8") for path in trees}
    assert {str(path): found for path, source in sources.items() if (found := without_reason(source))} == {}


def test_the_rules_of_this_page_bite():
    tree = ast.parse('def f(first, *, second):\n    """Say `first`."""\n' + "    pass\n" * 60)
    (node,) = functions(tree)
    assert length(node) == 62
    assert unnamed_arguments(node) == ["second"]
    assert array_aliases(ast.parse("Numbers = NDArray[np.float64]")) == {"NDArray[np.float64]"}
    assert without_reason("from typing import Any\nx: Any = 1\ny: Any = 2  # JSON") == ["x: Any = 1"]
    assert without_reason("from typing import Any  # Any: JSON\nx: Any = 1") == []
    assert without_reason("x = f()  # type: ignore[arg-type]") == ["x = f()  # type: ignore[arg-type]"]
