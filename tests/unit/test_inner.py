"""Functions that compiled ones call and Python does not."""

import pytest
from numba import njit

from hdopt.kinematics.inner import Inner, inner
from hdopt.kinematics.lanes.single import tangent


@inner(error_model="numpy", fastmath=False)
def inverse(x):
    """One over `x`."""
    return 1.0 / x


@njit(error_model="python", fastmath=False)
def caller(x):
    return inverse(x) + 1.0


def test_compiled_functions_call_it_with_its_own_options():
    """Fault caught: the options not handed on, with which a division by zero raises as in Python."""
    assert caller(4.0) == 1.25
    assert caller(0.0) == float("inf")


def test_python_is_refused_and_told_what_to_call():
    """Fault caught: no refusal. Numba itself then calls the address 0, and the process dies."""
    with pytest.raises(TypeError, match=r"^inverse is compiled for other compiled .* inverse\.py_func$"):
        inverse(4.0)
    assert inverse.py_func(4.0) == 0.25
    assert (inverse.__name__, inverse.__doc__) == ("inverse", "One over `x`.")


def test_there_is_no_way_in_from_outside():
    """Fault caught: either way in left on, which doubles the time in which a kernel is compiled."""
    caller(4.0)
    (made,) = inverse.compiled.overloads.values()
    assert not [name for name in made.library.get_llvm_str().splitlines() if "define" in name and "cpython" in name]
    assert not [name for name in made.library.get_llvm_str().splitlines() if "define" in name and "cfunc" in name]
    assert isinstance(tangent, Inner)
