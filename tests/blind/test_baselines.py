"""The baselines on the bench's own cases: valid answers, nothing on nothing, and what each of them can see."""

import json

import numpy as np
import pytest

from hdopt.bench.baselines import METHODS
from hdopt.bench.baselines.__main__ import main
from hdopt.bench.baselines.order_spectrum import cause
from hdopt.bench.baselines.rows import base_columns, fitted, held_out_rms, rows_of, waves
from hdopt.bench.cases import Spec, simulate
from hdopt.bench.generate import write
from hdopt.bench.geometry import RATIO
from hdopt.bench.marking import check_answer


def tables(effect="", severity=0.0, seed=5):
    return simulate(Spec("single", seed, (effect,) if effect else (), severity, size="brief")).tables


SEEN = {"order spectrum": ("bearing_pass", 4)}
"""What each can see, with a seed: a loop has no line of its own."""


@pytest.mark.parametrize("name", METHODS)
def test_nothing_is_found_in_nothing_and_something_large_is(name):
    """Catches a baseline that is a straw man: one that always or never finds something."""
    effect, seed = SEEN.get(name, ("hysteresis", 3))
    empty = METHODS[name](tables(), RATIO)
    assert check_answer(empty) == "" and empty["verdict"] == "adequate"
    found = METHODS[name](tables(effect, 2.0, seed), RATIO)
    assert check_answer(found) == "" and found["verdict"] in ("named", "unknown")
    fit = found["fit"]
    assert fit["heldout_rms_extended_arcmin"] < 0.9 * fit["heldout_rms_base_arcmin"]


def test_sparse_regression_names_what_its_library_holds():
    answer = METHODS["sparse regression"](tables("encoder_output_eccentricity", 3.0, seed=7), RATIO)
    assert answer["verdict"] == "named"


def test_the_table_of_orders():
    assert cause(8.0, RATIO, 0.01) == "circular_spline_lobing"
    assert cause(8 * (1 + 1 / RATIO), RATIO, 0.01) == "fs_tooth_harmonics"
    assert cause(0.45, RATIO, 0.01) == cause(9.37, RATIO, 0.01) == "bearing_pass"
    assert cause(2.5, RATIO, 0.01) == ""


def test_held_out_turns_are_not_in_the_fit():
    """Catches held-out rows left in the fit: a column for every row would then predict them all."""
    rows = rows_of(tables(), RATIO)
    base = base_columns(rows)
    overfitted = np.column_stack([base, waves(rows.theta, np.linspace(0.01, 30, 400))])
    seen = np.std(rows.error - overfitted @ fitted(overfitted, rows.error))
    assert held_out_rms(rows, overfitted) > 1.2 * seen
    assert held_out_rms(rows, base) < 0.5 * np.std(rows.error)


def test_the_command_answers_what_was_begun(tmp_path):
    write(tmp_path, 4, ("nothing",), cases=13)
    (tmp_path / "answers.json").write_text(json.dumps({"begun": 1}))
    main(["--dir", str(tmp_path)])
    found = sorted(path.relative_to(tmp_path / "baselines") for path in (tmp_path / "baselines").rglob("*.json"))
    assert [str(path.parent) for path in found] == sorted(METHODS) and {p.name for p in found} == {"case-0001.json"}
