"""Every public function says in words what is wrong with a call, before it does anything, and in Python's terms."""

from __future__ import annotations

import ast
import dataclasses
import importlib
import inspect
import pickle
import pkgutil
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from types import FunctionType, NoneType

import numpy as np
import pandas as pd
import pytest

import hdopt
import hdopt.allocation.cost
import hdopt.drive
import hdopt.tolerance.distributions
from hdopt.errors import WrongCall
from hdopt.files import HasTables
from hdopt.workflow.called import _kinds, as_called, hints_of, in_python
from hdopt.workflow.placed import numbers_named

CALLS = [name for name in hdopt.__all__ if isinstance(getattr(hdopt, name), FunctionType)]
ARGUMENTS = [(name, one) for name in CALLS for one in inspect.signature(getattr(hdopt, name)).parameters]


class Nothing:
    """Of no type that any call takes."""

    def __repr__(self) -> str:
        return "NOTHING"


class Tables:
    def tables(self):
        return {}


def something(kinds):
    """A value that one of these `kinds` takes."""
    values = {str: "x", float: 80.0, int: 1, NoneType: None, pd.DataFrame: pd.DataFrame(), HasTables: Tables()}
    for kind in kinds:
        if kind in values:
            return values[kind]
    return {} if getattr(kinds[0], "__origin__", None) is Mapping else []


def required(name, but=""):
    """Arguments that a call cannot do without, each of its type."""
    call = getattr(hdopt, name)
    parameters = inspect.signature(call).parameters.values()
    hints = hints_of(call.__wrapped__, hdopt._public)
    return {one.name: something([*_kinds(hints[one.name])]) for one in parameters
            if one.default is one.empty and one.name != but}  # fmt: skip


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_an_argument_of_a_wrong_type_is_named_with_what_it_takes(name, argument):
    """Would catch a parameter without a type, with one that nothing resolves, and a call that none of this guards."""
    given = {**required(name), argument: Nothing()}
    with pytest.raises(WrongCall, match=rf"^hdopt\.{name}: {argument} is 'NOTHING' \(Nothing\); give .") as error:
        getattr(hdopt, name)(**given)
    assert isinstance(error.value, TypeError) and isinstance(error.value, hdopt.HdoptError)
    assert not re.search(r"<class|typing|collections|Union|NoneType|float|\bint\b", str(error.value))


@pytest.mark.parametrize(("name", "argument"), ARGUMENTS)
def test_a_misspelt_argument_is_answered_with_the_nearest(name, argument):
    misspelt = argument[:1] + argument[2:] if len(argument) > 4 else f"{argument}s"
    if misspelt in inspect.signature(getattr(hdopt, name)).parameters:
        misspelt = f"{argument}_x"
    with pytest.raises(WrongCall, match=rf"^hdopt\.{name}: unknown argument '{misspelt}'.*\b{argument}\b"):
        getattr(hdopt, name)(**required(name), **{misspelt: 1})


@pytest.mark.parametrize(("name", "argument"), [(n, a) for n, a in ARGUMENTS if a in required(n)])
def test_a_missing_argument_is_named(name, argument):
    with pytest.raises(WrongCall, match=rf"^hdopt\.{name}: missing a required argument: '{argument}'; it takes"):
        getattr(hdopt, name)(**required(name, but=argument))


@pytest.mark.parametrize("name", CALLS)
def test_a_public_call_is_one_object_that_pickles_and_keeps_its_help(name):
    call = getattr(hdopt, name)
    assert pickle.loads(pickle.dumps(call)) is call is getattr(hdopt, name)
    assert call.__doc__ and call.__module__ == "hdopt"


def test_arguments_go_where_they_belong():
    """What inspect, stack and their like do not take says who does."""
    with pytest.raises(WrongCall, match=r"recorded_drive\(drive, columns=\.\.\.\)"):
        hdopt.inspect("run.csv", "csf-25-80", columns="input=a:deg")
    with pytest.raises(WrongCall, match=r"give study\.with_\(width_mm=\.\.\.\)"):
        hdopt.stack("csf-25-80", width_mm=8)
    with pytest.raises(WrongCall, match=r"recording_from_table makes a Recording"):
        hdopt.inspect(pd.DataFrame({"a": [1.0]}), "csf-25-80")
    with pytest.raises(WrongCall, match="too many positional arguments; it takes study, n; by name tail="):
        hdopt.stack("csf-25-80", 4096, 1.2)
    with pytest.raises(WrongCall, match=r"recordings\[1\] is '3' \(int\); give a Recording, text or a path"):
        hdopt.inspect_many(["a.csv", 3], "csf-25-80")
    with pytest.raises(WrongCall, match="unknown fit 'best'; known: least_squares, minimum_zone"):
        hdopt.compare("csf-25-80", "cam.csv", fit="best")


def test_what_is_meant_by_a_near_type_is_taken():
    """1e4 for a whole number, NumPy's scalars and arrays; the answer is the same to the bit and goes into JSON."""
    import json

    plain = hdopt.stack("csf-25-80", 4096, quantiles=[0.5], seed=2).to_dict()
    near = hdopt.stack("csf-25-80", 4096.0, quantiles=np.array([0.5]), seed=np.int64(2)).to_dict()
    assert json.dumps(near) == json.dumps(plain)
    with pytest.raises(WrongCall, match=r"n is '4096.5' \(float\); give a whole number"):
        hdopt.stack("csf-25-80", 4096.5)
    with pytest.raises(WrongCall, match=r"worst_case is '1' \(int\); give True or False"):
        hdopt.stack("csf-25-80", worst_case=1)
    with pytest.raises(WrongCall, match=r"seed is 'True' \(bool\); give a whole number"):
        hdopt.stack("csf-25-80", seed=True)


def strings_with_options():
    """Parts of messages in the package that hold an option of the command line."""
    root = Path(hdopt.__file__).parent
    files = [file for file in root.rglob("*.py") if not {"cli", "bench"} & set(file.relative_to(root).parts)]
    for file in [*files, *(root.parent / "geometry").rglob("*.py")]:
        text = file.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)) if re.search(r"--[a-z]", text) else ():
            if isinstance(node, ast.Raise):
                for part in ast.walk(node):
                    if (
                        isinstance(part, ast.Constant)
                        and isinstance(part.value, str)
                        and re.search("--[a-z]", part.value)
                    ):
                        yield part.value


def test_no_message_of_a_call_speaks_of_the_command_lines_options():
    """Over every message that an exception in the package is made of, for every public call."""
    said = sorted(set(strings_with_options()))
    assert len(said) > 20
    for name in CALLS:
        arguments = tuple(inspect.signature(getattr(hdopt, name)).parameters)
        for message in said:
            ours = in_python(message, name, arguments)
            assert "--" not in re.sub(r"hdopt [a-z]+ --[a-z-]+", "", ours), ours


def test_messages_from_python_say_what_to_write_in_python(tmp_path):
    file = tmp_path / "run.csv"
    file.write_text("a,b,c\n1,2,3\n2,3,4\n")
    asked: Mapping[str, Callable[[], object]] = {
        'with columns="input=NAME:UNIT': lambda: hdopt.diagnose(file, "csf-25-80"),
        'with drive=hdopt.recorded_drive(..., columns="input=NAME:UNIT': lambda: hdopt.inspect(file, "csf-25-80"),
        'give drive="NAME", or drive=hdopt.recorded_drive("none", ratio=X)': lambda: hdopt.compensate(file),
        "turns goes with sampling_deg": lambda: hdopt.kinematic_error(turns=3),
        "override wave_generator.width_mm: is -3": lambda: hdopt.load_study(None, ["width_mm=-3"]),
    }
    for words, call in asked.items():
        with pytest.raises(hdopt.HdoptError) as error:
            call()
        assert words in str(error.value)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"width_mm": -3}, r"^study\.with_ wave_generator\.width_mm: is -3"),
        ({"widht_mm": 3}, r"^study\.with_ unknown key 'widht_mm'; did you mean 'width_mm'"),
        ({"tolerances": 3}, r"^study\.with_ tolerances: is a section; give a table"),
        ({3: 3}, r"^study\.with_: '\{3: 3\}' holds no keys; give KEY=VALUE"),
        ([3], r"^study\.with_: '\[3\]' holds no keys"),
        ({"profile": Nothing()}, r"^study\.with_ wave_generator\.profile: is NOTHING; it must be 'ellipse'"),
    ],
)
def test_with_speaks_of_itself_and_not_of_set(changes, said):
    with pytest.raises(hdopt.HdoptError, match=said):
        hdopt.load_study("csf-25-80").with_(changes)


def test_a_changed_study_is_placed_where_it_was_changed():
    """Numbers that lead to no result are said to be of `with_`, not of a command line."""

    @numbers_named
    def work(study):
        raise ZeroDivisionError("division by zero")

    with pytest.raises(hdopt.HdoptError, match=r"^study\.with_ errors\.axis_tilt_x_deg \(1e-09, the value farthest"):
        work(hdopt.load_study("csf-25-80").with_(axis_tilt_x_deg=1e-9))


def _records():
    """Every public record, and every one that a drive, a tolerance or a cost is made of."""
    modules = [hdopt.tolerance.distributions, hdopt.allocation.cost]
    modules += [importlib.import_module(f"hdopt.drive.{one.name}") for one in pkgutil.iter_modules(hdopt.drive.__path__)
                if one.name != "data"]  # fmt: skip
    parts = [kind for module in modules for kind in vars(module).values() if inspect.isclass(kind)]
    public = [getattr(hdopt, name) for name in hdopt.__all__ if inspect.isclass(getattr(hdopt, name))]
    ours = [one for one in (*public, *parts) if one.__module__.startswith("hdopt") and dataclasses.is_dataclass(one)]
    return sorted(set(ours), key=lambda one: one.__name__)


def _calls_of(record):
    """The ways to call the class `record`: to make one, and its public methods, of one without any values."""
    yield "", record
    empty = object.__new__(record)
    for name in dir(record):
        found = inspect.getattr_static(record, name)
        if not name.startswith("_") and isinstance(found, FunctionType | classmethod):
            yield f".{name}", getattr(empty, name)


@pytest.mark.parametrize("record", _records())
def test_a_misspelt_argument_of_a_record_or_of_its_methods_leads_to_the_nearest(record):
    """Would catch a record, or a method, that answers in Python's words: "got an unexpected keyword argument"."""
    for way, call in _calls_of(record):
        parameters = inspect.signature(call).parameters.values()
        if any(one.kind is one.VAR_KEYWORD for one in parameters):
            continue
        for one in parameters:
            with pytest.raises(
                WrongCall, match=rf"^{record.__name__}{way}: unknown argument '{one.name}x'; did you mean"
            ):
                call(**{f"{one.name}x": None})
        with pytest.raises(
            WrongCall, match=rf"^{record.__name__}{way}: unknown argument 'qqqq'; (known: |it takes none)"
        ):
            call(qqqq=None)


def test_a_unit_in_the_name_of_an_argument_is_answered_with_the_one_it_has():
    """Would catch a hint that leads to the right name with the number in the wrong unit."""
    with pytest.raises(WrongCall, match=r"'axis_tilt_y_deg'; did you mean 'axis_tilt_y', in rad\?"):
        hdopt.DriveErrors(axis_tilt_y_deg=0.2)
    with pytest.raises(WrongCall, match=r"'axis_eccentricity_mm'; did you mean 'axis_eccentricity', in mm\?"):
        hdopt.DriveErrors(axis_eccentricity_mm=0.01)


def test_the_result_of_a_call_is_watched_whatever_room_it_comes_from():
    class Fresh:
        __module__ = "hdopt.somewhere"

        def plot(self, backend: str = "plotly") -> str:
            return [][backend]  # a fault of its own, which is no wrong call

    def work() -> Fresh:
        return Fresh()

    result = as_called(work, hdopt._public)()
    with pytest.raises(WrongCall, match=r"^Fresh\.plot: unknown argument 'bakend'; did you mean 'backend'\?"):
        result.plot(bakend="x")
    with pytest.raises(WrongCall, match=r"^Fresh\.plot: too many positional arguments; it takes backend$"):
        result.plot("x", "y")
    with pytest.raises(TypeError, match="list indices") as raised:
        result.plot()
    assert not isinstance(raised.value, WrongCall)
