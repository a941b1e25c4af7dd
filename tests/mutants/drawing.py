"""cosmic-ray's mutants of a room in the order in which a seed draws them, and the test files that should notice one."""

from __future__ import annotations

import ast
import random
import re
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from itertools import islice
from pathlib import Path

import cosmic_ray.plugins
from cosmic_ray.ast import ast_nodes, get_ast
from cosmic_ray.mutating import mutate_code

from tests.mutants.hand_made import ROOT, Fault, faults_of, rooms

SEED = 2026
ON_BITS = ("BitOr", "BitAnd", "BitXor", "LShift", "RShift", "Invert")
"""Left out: on floats these raise, so that whatever runs the line notices; nine in ten mutants would be of them."""
OVER_EVERY = {
    "effects": (
        "unit/test_effects.py",
        "unit/test_effect_numbers.py",
        "unit/test_effect_edges.py",
        "unit/test_effect_findings.py",
        "unit/test_toy_effect.py",
    ),
    "formats": ("unit/test_recording_formats.py", "unit/test_recording_numbers.py"),
    "settings": ("unit/test_threshold_sensitivity.py",),
}
"""By folder or module: properties over all that is registered there, which do not name each of its files."""
OVER_ALL = ("unit/test_architecture.py",)
"""Properties of all sources, which are asked last: that values are frozen, that imports run one way."""
MOST_TEST_FILES = 7
"""A mutant that survives costs the quick tests of so many files."""


def drawn(room: str, seed: int = SEED) -> Iterator[Fault]:
    """Mutants of `room`: a file, the longer the likelier, then one of its mutants that was not drawn before.

    Left out are files of machine code, which every mutant would have to be compiled for, and mutants that change no
    more than annotations.
    """
    chance = random.Random(seed)
    files = [path for path in sorted((ROOT / "hdopt" / room).rglob("*.py")) if not _is_compiled(path)]
    weights = [len(path.read_text("utf-8")) for path in files]
    left: dict[Path, list[tuple[str, int]]] = {}
    while any(weights):
        (path,) = chance.choices(files, weights)
        if path not in left:
            left[path] = _mutants(path.read_text("utf-8"))
            chance.shuffle(left[path])
        if not left[path]:
            weights[files.index(path)] = 0
            continue
        if (fault := _fault(room, path, *left[path].pop())) is not None:
            yield fault


def _is_compiled(path: Path) -> bool:
    """Whether machine code is made of the functions of `path`."""
    text = path.read_text("utf-8")
    return "closed_form" in path.name or re.search(r"njit|^@(late|compiled|inlined|entry)\b", text, re.M) is not None


def _mutants(text: str) -> list[tuple[str, int]]:
    """Operator and occurrence of all mutants of a module's `text`."""
    nodes = list(ast_nodes(get_ast(text)))
    found = []
    for name in sorted(cosmic_ray.plugins.operator_names()):
        kind = cosmic_ray.plugins.get_operator(name)
        if kind.arguments() or any(word in name for word in ON_BITS):
            continue
        places = sum(1 for node in nodes for _ in kind().mutation_positions(node))
        found += [(name, occurrence) for occurrence in range(places)]
    return found


def _fault(room: str, path: Path, operator: str, occurrence: int) -> Fault | None:
    """One mutant of `path`, with the line it is in; None where it is no Python, or no other program."""
    before = path.read_text("utf-8")
    after = mutate_code(before, cosmic_ray.plugins.get_operator(operator)(), occurrence)
    try:
        if after is None or _program(after) == _program(before):
            return None
    except SyntaxError:
        return None
    lines = zip(before.splitlines(), after.splitlines(), strict=False)
    line = next((at for at, (one, other) in enumerate(lines, start=1) if one != other), 0)
    file = str(path.relative_to(ROOT))
    return Fault(room, f"{file}:{line}:{operator}:{occurrence}", file, before, after, tests_of(file))


def _program(text: str) -> str:
    """The syntax tree of a `text` without annotations."""
    tree = ast.parse(text)
    for node in ast.walk(tree):
        for name in ("annotation", "returns"):
            if getattr(node, name, None) is not None:
                setattr(node, name, ast.Constant(None))
    return ast.dump(tree)


@cache
def tests_of(file: str) -> tuple[str, ...]:
    """Test files (below `tests`) that should notice what is wrong in `file`, `MOST_TEST_FILES` at most.

    First come the file of its name and those over all that its folder registers, then those that the faults made by
    hand in it name, most often named first, then unit and validation tests that import it; where there are none of
    these, those that import what imports it. Last come those over all sources, where any other is asked.
    """
    named = Counter(
        test.split("::")[0] for room in rooms() for one in faults_of(room) if one.file == file for test in one.tests
    )
    tests = [*ROOT.glob("tests/unit/test_*.py"), *ROOT.glob("tests/validation/test_*.py")]
    own = [name for name in (f"unit/test_{Path(file).stem}.py",) if (ROOT / "tests" / name).exists()]
    over_every = [
        *own,
        *(test for name in (Path(file).parent.name, Path(file).stem) for test in OVER_EVERY.get(name, ())),
    ]
    found = [*over_every, *(test for test, _ in named.most_common()), *_tests_importing(file, tests)]
    for other in [] if len(found) > len(over_every) else _importing(file, ROOT.glob("hdopt/*/**/*.py")):
        found += _tests_importing(str(other.relative_to(ROOT)), tests)
    chosen = tuple(islice(dict.fromkeys(found), MOST_TEST_FILES))
    return (*chosen, *OVER_ALL) if chosen else ()


def _tests_importing(file: str, tests: Iterable[Path]) -> list[str]:
    return [str(path.relative_to(ROOT / "tests")) for path in _importing(file, tests)]


def _importing(file: str, among: Iterable[Path]) -> list[Path]:
    """Those files `among` that import the module `file` or name it, in the order of their names."""
    module = file.removesuffix(".py").replace("/", ".").removesuffix(".__init__")
    package, _, name = module.rpartition(".")
    imports = rf"from {re.escape(module)} import|from {re.escape(package)} import .*\b{name}\b"
    takes = re.compile(rf"^\s*({imports})|\b{re.escape(module)}\b", re.M)
    return [path for path in sorted(among) if takes.search(path.read_text("utf-8"))]
