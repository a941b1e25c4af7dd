"""A fault put into functions that are in memory already: a new process would read all files again."""

from __future__ import annotations

import ast
import functools
import gc
import os
import sys
from collections.abc import Iterator, Set
from pathlib import Path
from types import CodeType, FunctionType

CO_OPTIMIZED = 0x1
"""Flag of a function's code, which the body of a module or class does not have."""


class NotInMemory(Exception):
    """The fault changes more than functions: a new process must read the file."""


def put_in_memory(path: Path, old: str, new: str) -> None:
    """Give every function of the file `path`, whose text was `old`, the code that it has in the text `new`.

    Nothing is done where the file was never imported. Raises `NotInMemory` where more than functions differ, or where
    machine code was made of one of them.
    """
    changed = _changed(compile(old, str(path), "exec"), compile(new, str(path), "exec"))
    live = [one for one in _objects() if isinstance(one, FunctionType) and _is_from(one, path)]
    if not live:
        return
    if missing := set(changed) - {one.__code__.co_qualname for one in live}:
        raise NotInMemory(f"not found: {', '.join(missing)}")
    if compiled := _compiled_functions(path) & set(changed):
        raise NotInMemory(f"machine code: {', '.join(compiled)}")
    for function in live:
        code = changed.get(function.__code__.co_qualname)
        if code is not None:
            if code.co_freevars != function.__code__.co_freevars:
                raise NotInMemory(f"other closure: {code.co_qualname}")
            function.__code__ = code


def changed_functions(path: Path, old: str, new: str) -> frozenset[str]:
    """Qualified names of the functions whose code differs; none where more than functions do."""
    try:
        found = frozenset(_changed(compile(old, str(path), "exec"), compile(new, str(path), "exec")))
    except NotInMemory:
        return frozenset()
    return found


def mark_calls(path: Path, text: str, names: Set[str], number: int) -> None:
    """Have the functions `names` of the file `path`, where they are in memory and not machine code, tell
    `sys._fault_called` their `number` whenever they begin."""
    tree = ast.parse(text)
    _insert(tree, "", names, ast.parse(f'__import__("sys")._fault_called({number})').body[0])
    marked = dict(_functions(compile(ast.fix_missing_locations(tree), str(path), "exec")))
    plain = names - _compiled_functions(path)
    for function in [one for one in _objects() if isinstance(one, FunctionType) and _is_from(one, path)]:
        code = marked.get(function.__code__.co_qualname)
        if code is not None and function.__code__.co_qualname in plain:
            if code.co_freevars == function.__code__.co_freevars:
                function.__code__ = code


def _insert(node: ast.AST, prefix: str, names: Set[str], call: ast.stmt) -> None:
    for child in ast.iter_child_nodes(node):
        inner = prefix
        if isinstance(child, ast.ClassDef):
            inner = f"{prefix}{child.name}."
        elif isinstance(child, ast.FunctionDef):
            inner = f"{prefix}{child.name}.<locals>."
            if f"{prefix}{child.name}" in names:
                child.body.insert(0, call)
        _insert(child, inner, names, call)


def _objects() -> list[object]:
    """Everything in memory, what was frozen (`tests/conftest.py`) too, which the collector would not list."""
    gc.unfreeze()
    return gc.get_objects()


def _functions(code: CodeType) -> Iterator[tuple[str, CodeType]]:
    for one in _codes(code):
        if one.co_flags & CO_OPTIMIZED:
            yield one.co_qualname, one
        yield from _functions(one)


def forget_results() -> None:
    """Without what functions were told to remember, threads among it that a new process does not have."""
    for one in _objects():
        if isinstance(one, functools._lru_cache_wrapper):
            one.cache_clear()


def forget_modules(folder: Path) -> None:
    """Without the modules below `folder`: they are read again. What was started stays: a worker asks for its name."""
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name != "__main__" and file is not None and Path(file).is_relative_to(folder):
            del sys.modules[name]


def _is_from(function: FunctionType, path: Path) -> bool:
    name = function.__code__.co_filename
    return name.endswith(path.name) and os.path.realpath(name) == str(path)


def _compiled_functions(path: Path) -> set[str]:
    from numba.core.dispatcher import Dispatcher

    from hdopt.late import Late

    made = (one.py_func for one in _objects() if isinstance(one, Dispatcher | Late))
    return {one.__code__.co_qualname for one in made if _is_from(one, path)}


def _changed(old: CodeType, new: CodeType) -> dict[str, CodeType]:
    """Functions by qualified name whose code differs between two bodies of a module or class."""
    if old.co_code != new.co_code or old.co_names != new.co_names or _plain(old) != _plain(new):
        raise NotInMemory("more than functions")
    changed: dict[str, CodeType] = {}
    for one, other in zip(_codes(old), _codes(new), strict=True):
        if not one.co_flags & CO_OPTIMIZED:
            changed |= _changed(one, other)
        elif one != other:
            if one.co_name.startswith("<"):
                raise NotInMemory("a nameless function")
            changed[one.co_qualname] = other
    return changed


def _codes(code: CodeType) -> list[CodeType]:
    return [one for one in code.co_consts if isinstance(one, CodeType)]


def _plain(code: CodeType) -> list[str]:
    return [one.co_name if isinstance(one, CodeType) else repr(one) for one in code.co_consts]
