"""Tables for a spreadsheet: every command that has one writes CSV and XLSX, whole, harmless, numbers as numbers."""

from __future__ import annotations

import csv
import io
import math
from importlib import import_module
from types import SimpleNamespace

import openpyxl
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hdopt
from hdopt.cli import main
from hdopt.cli.app import COMMANDS
from hdopt.errors import HdoptError
from hdopt.files import SPREADSHEET_FORMULA, to_csv, to_xlsx
from hdopt.tolerance.results import SobolResult

WILD = ["=SUM(A1:A9)", "+1+cmd|' /C calc'!A0", "-2+3", "@SUM(1)", '=HYPERLINK("x")']
"""Names that a spreadsheet would run, which a study or a file may give."""
WITHOUT = {
    "new": "writes a study",
    "studies": "names and titles",
}
"""Commands without table options, and why."""


def ends(capsys, *arguments):
    with pytest.raises(SystemExit) as end:
        main([str(argument) for argument in arguments])
    out = capsys.readouterr()
    return end.value.code, out.out, out.err


def is_number(text):
    try:
        float(text)
    except ValueError:
        return False
    return True


def cells_of(path):
    """Every cell of a table's file, by sheet; '' for the one sheet of a CSV."""
    if path.suffix == ".csv":
        return {"": [list(row) for row in csv.reader(io.StringIO(path.read_text()))]}
    book = openpyxl.load_workbook(path)
    assert all(cell.data_type != "f" for sheet in book for row in sheet.iter_rows() for cell in row)
    return {sheet.title: [list(row) for row in sheet.iter_rows(values_only=True)] for sheet in book}


def assert_fit_for_a_spreadsheet(capsys, folder, *arguments, status=0):
    """Run a command with both options: same main table in both files, no formula, numbers as numbers."""
    files = folder / "out.csv", folder / "out.xlsx"
    code, _, error = ends(capsys, *arguments, "--csv", files[0], "--xlsx", files[1])
    assert code == status, error
    of_csv, of_xlsx = (cells_of(file) for file in files)
    (plain,) = of_csv.values()
    first = next(iter(of_xlsx.values()))
    assert len(plain) == len(first) > 1
    for sheet in (*of_csv.values(), *of_xlsx.values()):
        for row in sheet:
            for cell in row:
                assert not (isinstance(cell, str) and cell.startswith(SPREADSHEET_FORMULA) and not is_number(cell))
    for text_row, row in zip(plain, first, strict=True):
        for text, cell in zip(text_row, row, strict=True):
            if isinstance(cell, bool) or cell is None:
                continue
            if isinstance(cell, int | float):
                # a workbook keeps 15 digits
                assert math.isclose(float(text), cell, rel_tol=1e-14), "another number in the other file"
            else:
                assert not is_number(text) or cell == text, "a number that is a text in the workbook"
    return of_xlsx


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_with_a_table_offers_both_files(command):
    params = {param.name for param in import_module(f"hdopt.cli.{command}").command.params}
    assert ({"csv", "xlsx"} <= params) == (command not in WITHOUT)


@pytest.fixture
def stack_study(tmp_path):
    """A linear stack whose dimensions have wild names."""
    rows = "".join(
        f"[linear_stack.dimensions.'{name}']\ntolerance = 0.0{i}\ncost = {{ model = 'reciprocal', b = 0.1 }}\n"
        if "'" not in name
        else f'[linear_stack.dimensions."{name}"]\ntolerance = 0.0{i}\ncost = {{ model = "reciprocal", b = 0.1 }}\n'
        for i, name in enumerate(WILD, 1)
    )
    file = tmp_path / "stack.toml"
    file.write_text("[linear_stack]\ngap_tolerance = 0.12\n" + rows)
    return file


OF_STRUCTURES = 'drive = "csf-25-80"\n[study]\nsteps = ["structures"]\n'
COMMAND_LINES = {
    "ke": ("ke", "csf-25-80"),
    "profile": ("profile", "csf-25-80"),
    "check": ("check", "csf-25-80"),
    "export": ("export", "csf-25-80"),
    "stack": ("stack", "csf-25-80", "-n", "2048"),
    "sobol": ("sobol", "csf-25-80", "-n", "256"),
    "explore": ("explore", "csf-25-80", "-n", "64", "-o", "explorer.html"),
    "run": ("run", "own.toml", "-o", "out"),
}


@pytest.mark.parametrize("name", COMMAND_LINES)
def test_tables_of_the_shipped_drive(name, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "own.toml").write_text(OF_STRUCTURES)
    assert_fit_for_a_spreadsheet(capsys, tmp_path, *COMMAND_LINES[name])


@pytest.mark.parametrize(
    "arguments",
    [
        ("stack", "-n", "2048"),
        ("sobol", "-n", "256"),
        ("sobol", "-n", "256", "--method", "morris"),
        ("allocate", "--rule", "rss", "--set", "allocate.verify_n=16384"),
    ],
    ids=lambda arguments: " ".join(arguments),
)
def test_names_from_a_study_are_no_formulas(arguments, stack_study, tmp_path, capsys):
    sheets = assert_fit_for_a_spreadsheet(capsys, tmp_path, arguments[0], stack_study, *arguments[1:])
    texts = {cell for rows in sheets.values() for row in rows for cell in row}
    assert {"'" + name for name in WILD} <= texts


@pytest.fixture
def recording(tmp_path):
    """Four turns there and back whose file has a wild name."""
    import numpy as np

    from hdopt.kinematics.waveform import kinematic_error_arcmin

    study = hdopt.load_study("csf-25-80")
    there = np.arange(4 * 60) * 2 * np.pi / 60
    theta = np.r_[there, there[::-1]]
    error = kinematic_error_arcmin(study.drive, study.errors, theta)
    error += np.random.default_rng(0).normal(0, 0.01, len(theta))
    table = {"time_s": np.arange(len(theta)) * 0.1, "input_angle_deg": np.degrees(theta)}
    table["output_angle_deg"] = np.degrees(theta) / 80 - error / 60
    file = tmp_path / "=cmd|calc.csv"
    pd.DataFrame(table).to_csv(file, index=False)
    return file


def test_tables_of_sheets(recording, tmp_path, capsys):
    sheets = assert_fit_for_a_spreadsheet(capsys, tmp_path, "inspect", recording, "--limit", "peak_to_peak=1arcmin")
    assert list(sheets) == ["figures", "orders", "limits", "checks"]
    sheets = assert_fit_for_a_spreadsheet(capsys, tmp_path, "inspect", "--each", recording)
    assert "'=cmd|calc.csv" in {row[0] for row in sheets["drives"]}


@pytest.mark.slow
def test_tables_of_diagnosis_and_compensation(recording, tmp_path, capsys):
    assert_fit_for_a_spreadsheet(capsys, tmp_path, "diagnose", recording)
    code, _, error = ends(capsys, "compensate", recording, "-o", tmp_path / "t.csv", "--terms", "4", "--csv",
                          tmp_path / "out.csv", "--xlsx", tmp_path / "out.xlsx")  # fmt: skip
    assert code in (0, 1), error
    assert list(cells_of(tmp_path / "out.xlsx")) == ["recordings", "directions", "methods"]


@pytest.mark.slow
def test_tables_of_a_search(tmp_path, capsys):
    small = ("search.robust=false", 'search.profiles=["ellipse"]', 'search.structures=["integral"]')
    settings_ = [part for one in small for part in ("--set", one)]
    arguments = ("search", "csf-25-80-design-trade", "--no-fronts", *settings_)
    sheets = assert_fit_for_a_spreadsheet(capsys, tmp_path, *arguments)
    assert "best and present" in sheets


def test_a_table_that_cannot_be_written_is_said_before_the_work(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("hdopt.workflow.stack.run_stack", lambda *given: pytest.fail("worked in vain"))
    for option in ("--csv", "--xlsx"):
        code, _, error = ends(capsys, "stack", option, tmp_path / "nowhere" / "t.xlsx")
        assert code == 2 and "nowhere" in error
    code, _, error = ends(capsys, "stack", "--xlsx", tmp_path / "t.csv")
    assert code == 2 and "does not end with .xlsx" in error
    code, _, error = ends(capsys, "stack", "--csv", tmp_path / "t", "--json", tmp_path / "t")
    assert code == 2 and "two outputs" in error


def test_csv_takes_standard_output_alone(capsys):
    _, out, _ = ends(capsys, "profile", "csf-25-80", "--csv", "-")
    assert out.startswith("figure,value,unit\n") and "contact angle" in out and ":" not in out
    code, _, error = ends(capsys, "profile", "csf-25-80", "--csv", "-", "--json", "-")
    assert code == 2 and "one of --json and --csv" in error


def test_tables_from_python(tmp_path):
    result = hdopt.kinematic_error("csf-25-80")
    hdopt.write_tables(result, tmp_path / "ke.xlsx")
    orders = pd.read_excel(tmp_path / "ke.xlsx", sheet_name="orders")
    pd.testing.assert_frame_equal(orders, result.to_frame(), check_dtype=False)
    hdopt.write_tables(result, tmp_path / "ke.csv")
    assert (tmp_path / "ke.csv").read_text() == to_csv(result.to_frame())
    with pytest.raises(HdoptError, match=r"give one of these endings"):
        hdopt.write_tables(result, tmp_path / "ke.ods")
    assert sorted(file.name for file in tmp_path.iterdir()) == ["ke.csv", "ke.xlsx"]


def test_the_cloud_of_the_explorer_is_in_study_units(tmp_path):
    """Would catch radians under a heading in deg, and a peak-to-peak of another drive."""
    from dataclasses import fields

    cloud = hdopt.explore("csf-25-80", tmp_path / "explorer.html", 16).to_frame()
    assert len(cloud) == 16 and len(cloud.columns) == len(fields(hdopt.DriveErrors)) + 1
    for _, row in cloud.head(3).iterrows():
        drive = hdopt.load_study("csf-25-80").with_({"errors": dict(row.drop("peak_to_peak_arcmin"))})
        assert hdopt.kinematic_error(drive, method="closed form").peak_to_peak_arcmin == pytest.approx(
            row["peak_to_peak_arcmin"],
            abs=1e-6,  # the kernel's own promise
        )


@pytest.mark.parametrize(
    ("sobol", "shapley", "names"),
    [
        (True, False, ["indices", "pairs"]),
        (False, True, ["Shapley effects"]),
        (True, True, ["indices", "pairs", "Shapley effects"]),
    ],
)
def test_the_tables_of_sensitivities_are_those_that_were_asked_for(sobol, shapley, names):
    """Fault caught: Shapley effects written where there are none, or left out where there are."""
    frame = pd.DataFrame({"value": [0.5]}, index=pd.Index(["tilt"], name="input"))
    pair = SimpleNamespace(value=0.1, low=0.0, high=0.2)
    indices = SimpleNamespace(to_frame=lambda: frame, second={("tilt", "phase"): pair}) if sobol else None
    effects = SimpleNamespace(to_frame=lambda: frame) if shapley else None
    tables = SobolResult.tables(SimpleNamespace(sobol=indices, shapley=effects))
    assert list(tables) == names
    if sobol:
        assert tables["pairs"].iloc[0].tolist() == ["tilt", "phase", 0.1, 0.0, 0.2]


def test_the_tables_of_a_run_are_those_of_its_page(tmp_path):
    (tmp_path / "own.toml").write_text(OF_STRUCTURES)
    result = hdopt.run_study(tmp_path / "own.toml", tmp_path / "out")
    tables = result.tables()
    assert list(tables["steps"]["step"]) == ["structures"] and tables["steps"]["answer"].all()
    (written,) = [pd.read_csv(file) for file in (tmp_path / "out").glob("structures-table.csv")]
    assert len(tables["structures-table"]) == len(written)
    assert hdopt.verify_run(tmp_path / "out").to_frame()["same"].all()


LARGEST = 9.99e307
"""What a cell of Excel holds at most, by its specifications and limits; an infinite one is told apart."""
FLOATS = st.floats(-LARGEST, LARGEST) | st.sampled_from([float("inf"), float("-inf"), float("nan")])
CELL = st.one_of(
    st.text(max_size=12), st.sampled_from(WILD), FLOATS, st.integers(-(2**40), 2**40), st.booleans(), st.none()
)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.lists(CELL, min_size=2, max_size=2), min_size=1, max_size=6), st.text(max_size=60))
def test_any_cells_come_back_as_what_they_are(rows, name):
    """Control characters, formulas, numbers that are not finite, names of sheets that Excel refuses."""
    frame = pd.DataFrame(rows, columns=["a", "=b"], dtype=object)
    book = openpyxl.load_workbook(io.BytesIO(to_xlsx({name: frame})))
    (sheet,) = book
    head, *body = [list(row) for row in sheet.iter_rows()]
    assert [cell.value for cell in head] == ["a", "'=b"]
    for row, cells in zip(rows, body, strict=True):
        for value, cell in zip(row, cells, strict=True):
            assert cell.data_type != "f"
            if isinstance(value, bool):
                assert cell.value is value
            elif isinstance(value, int) or (isinstance(value, float) and math.isfinite(value)):
                assert isinstance(cell.value, int | float) and math.isclose(cell.value, value, rel_tol=1e-14)
