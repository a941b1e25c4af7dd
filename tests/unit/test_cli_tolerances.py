"""`hdopt stack`, `sobol` and `allocate` as commands: JSON keys, exit status, one message for unusable input."""

import json

import pytest

from hdopt.cli import main


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main(arguments)
    out, err = capsys.readouterr()
    return ended.value.code, out, err


def test_stack_prints_json_alone(capsys):
    status, out, _ = run(capsys, "stack", "csf-25-80", "-n", "8192", "--seed", "0", "--json", "-", "--tail", "2.5")
    found = json.loads(out)
    assert status == 0
    assert {"n", "mean_arcmin", "std_arcmin", "quantiles", "yield", "ppm", "ppk", "rss_arcmin", "contributions"} <= set(
        found
    )
    assert set(found["quantiles"]["0.9973"]) == {"value", "low", "high"}
    assert found["n"] == 8192
    assert {"probability", "low", "high", "method", "evaluations"} <= set(found["tail"])
    assert found["tail"]["probability"] == 0


def test_stack_worst_case(capsys):
    _, out, _ = run(capsys, "stack", "chase-shaft-housing", "-n", "4096", "--worst-case", "--json", "-")
    worst = json.loads(out)["worst_case_in"]
    # 0.008 + 0.002 + 0.006 + 0.002 + 0.0015 + 0.0025 + 0.0025
    assert worst["value"] == pytest.approx(0.0245, rel=1e-6)
    assert worst["bound"] == pytest.approx(0.0245)
    assert worst["certificate"] == "proven bound"


def test_sobol(capsys):
    status, out, _ = run(capsys, "sobol", "-n", "512", "--no-second-order", "--shapley", "groups", "--json", "-")
    found = json.loads(out)
    assert status == 0
    assert set(found["inputs"]["axis_tilt_y_deg"]["S1"]) == {"value", "low", "high"}
    assert set(found["groups"]) == set(found["shapley"]) == {"E1", "E2", "CS teeth", "FS teeth"}
    assert "16 independent scramblings" in found["interval"]


def test_allocate_says_no_with_status_1(capsys):
    status, out, err = run(
        capsys, "allocate", "chase-shaft-housing", "--set", "linear_stack.gap_tolerance=0.006", "--json", "-"
    )
    assert status == 1
    assert json.loads(out)["status"] == "infeasible"
    assert json.loads(out)["best_reachable"] == pytest.approx(0.0065)
    assert "fixed part alone is 0.0065" in err


def test_tables_for_people(capsys):
    assert "yield (required 0.9973)" in run(capsys, "stack", "-n", "4096")[1]
    assert "total cost" in run(capsys, "allocate", "chase-shaft-housing", "--no-compare")[1]
    assert "E2" in run(capsys, "sobol", "-n", "256", "--no-second-order")[1]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("stack", "-n", "1000"), "the smallest n is 1365"),
        (("stack", "-n", "4096", "--quantile", "0.9999"), "the smallest n is 36887"),
        (("stack", "--engine", "dask://nowhere"), "write dask://HOST:PORT"),
        (("stack", "--set", "tolerances.axis_tilt_y_deg.lower=0.5"), "inconsistent"),
        (("stack", "--sampling", "halton"), "unknown sampling 'halton'"),
        (("sobol", "-n", "100"), "the smallest n is 256"),
        (("allocate", "csf-25-80"), "allocate needs costs"),
    ],
)
def test_unusable_input(capsys, arguments, message):
    status, _, err = run(capsys, *arguments)
    assert status == 2
    assert message in err
    assert "Traceback" not in err
