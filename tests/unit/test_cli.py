"""The command line as a process: JSON, exit statuses, one message and no traceback."""

import json
import subprocess
import sys

import pytest


def hdopt(*arguments, cwd=None):
    return subprocess.run(
        [sys.executable, "-c", "from hdopt.cli import main; main()", *arguments],
        capture_output=True,
        text=True,
        cwd=cwd,
        timeout=120,
    )


def test_ke_gives_every_key_of_its_contract():
    run = hdopt("ke", "csf-25-80", "--sampling-deg", "10", "--turns", "80", "--json", "-")
    assert (run.returncode, run.stderr) == (0, "")
    result = json.loads(run.stdout)
    assert result["peak_to_peak_arcmin"] == pytest.approx(1.3694, abs=1e-4)
    assert result["sampled_peak_to_peak_arcmin"] == pytest.approx(1.3301, abs=1e-4)
    assert result["nonuniform_arcmin"] == pytest.approx(
        result["peak_to_peak_arcmin"] * result["homogenization_coefficient"]
    )
    assert result["contact_angle_deg"] == pytest.approx(58.47, abs=0.01)
    assert {order["order"] for order in result["orders"]} >= {1 / 80, 1, 2, 2 * (1 + 1 / 80), 2 * (1 + 1 / 160)}
    assert all(order["amplitude_arcmin"] >= 0 for order in result["orders"])
    assert result["lag_arcmin"].keys() >= {"mean", "min", "max", "parts"}


def test_profile_gives_every_key_of_its_contract(tmp_path):
    run = hdopt("profile", "--profile", "resal", "--json", str(tmp_path / "out.json"))
    assert run.returncode == 0
    assert "contact angle" in run.stdout
    result = json.loads((tmp_path / "out.json").read_text())
    assert result["contact_angle_deg"] == pytest.approx(54.99, abs=0.03)
    assert result.keys() >= {"max_curvature_change_per_mm", "max_bending_stress_mpa", "perimeter_error_mm"}


def test_missing_numbers_are_null_and_noted(tmp_path):
    (tmp_path / "mine.toml").write_text(
        "[drive]\nflexspline_teeth = 100\ncircular_spline_teeth = 102\nmodule_mm = 0.5\npressure_angle_deg = 20\n"
        "flexspline_inner_radius_mm = 24\n[wave_generator]\nwidth_mm = 8\n[errors]\naxis_tilt_x_deg = 0.1\n"
    )
    run = hdopt("ke", "mine.toml", "--json", "-", cwd=tmp_path)
    result = json.loads(run.stdout)
    assert run.returncode == 0
    assert result["lag_arcmin"] is None and result["nonuniform_arcmin"] is None
    assert "the lag needs clearances.backlash_mm" in " ".join(result["notes"])


def test_studies_are_listed():
    run = hdopt("studies")
    assert run.returncode == 0
    assert {"csf-25-80", "paper-reproduction"} <= {line.split()[0] for line in run.stdout.splitlines()}


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["ke", "--set", "width_mm=-1"], "it must be greater than or equal to 0.1"),
        (["ke", "none.toml"], "cannot read none.toml"),
        (["ke", "--sampling-deg", "0"], "--sampling-deg is 0.0; it must lie above 0"),
        (["ke", "--turns", "5"], "--turns goes with --sampling-deg"),
        (["ke", "--structure", "automatc"], "it must be 'integral', 'automatic'"),
        (["ke", "--seed", "x"], "--seed"),
        (["ke", "--bogus"], "No such option"),
        (["kee"], "unknown command 'kee'; did you mean 'ke'?"),
        (["profile", "--json", "none/out.json"], "cannot write none/out.json"),
        (["run", "csf-25-81"], "unknown study 'csf-25-81'; did you mean 'csf-25-80'?"),
    ],
)
def test_unusable_input_ends_with_2_one_message_and_no_traceback(arguments, message, tmp_path):
    run = hdopt(*arguments, cwd=tmp_path)
    assert run.returncode == 2
    assert run.stderr.startswith("hdopt: ")
    assert message in run.stderr
    assert "Traceback" not in run.stderr


@pytest.mark.parametrize("argument", ["--help", "studies"])
def test_help_and_studies_import_no_heavy_library(argument):
    heavy = {"numpy", "scipy", "pandas", "numba", "plotly", "cadquery", "cvxpy", "pydantic", "SALib", "openturns"}
    code = (
        "import sys; from hdopt.cli import main\n"
        f"try: main([{argument!r}])\nexcept SystemExit: pass\n"
        "print(*sys.modules, file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert set(run.stderr.split()) & heavy == set()
