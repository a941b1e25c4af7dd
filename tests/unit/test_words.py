"""What the command line says in numbers: how many of what, no rounding noise, and every file that it wrote."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import click
import pytest

import hdopt.optimize.summary as summary
from hdopt.cli import main
from hdopt.cli.app import COMMANDS, cli
from hdopt.cli.common import OutputFile
from hdopt.words import counted, settled, without_minus_nought

ROOT = Path(__file__).resolve().parents[2]
MANY = re.compile(
    r" (?:[a-z-]+ )?(rows|lines|samples|points|drives|files|turns|orders|gaps|places|recordings|stamps|cells|keys)\b"
)
OTHERS = {"--bench", "--allocation", "--output"}
"""Options whose FILE is read, and that of the explorer, whose Python call claims it."""


def literal_plurals(tree):
    """Line and text of f-strings that put a plain number before one of `MANY` themselves; totals, after 'of', may."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.JoinedStr):
            continue
        before = ""
        for value, following in zip(node.values, node.values[1:], strict=False):
            text = following.value if isinstance(following, ast.Constant) else ""
            is_count = isinstance(value, ast.FormattedValue) and value.format_spec is None
            constant = is_count and isinstance(value.value, ast.Name) and value.value.id.isupper()
            if is_count and not constant and MANY.match(str(text)) and not before.endswith("of "):
                yield node.lineno, f"{ast.unparse(value.value)}{text}"
            before = str(value.value) if isinstance(value, ast.Constant) else ""


AT_LEAST_TWO = {
    "verify_n samples",  # a yield is verified with thousands
    "n points a scrambling",  # beyond the end of the sequence
    "2 * sampling.replicates samples",
    "n drives by the exact geometry",  # more than 4096
    "self.drives drives",  # a sample of the tolerances
    "sobol.evaluations drives",
    "len(drives) recordings can",  # after "none of"
}
"""Counts that cannot be one."""


def test_no_sentence_says_1_rows():
    """Would catch '1 rows with missing values dropped': a count in an f-string with its noun always in the plural."""
    found = []
    for folder in ("hdopt/cli", "hdopt/recordings", "hdopt/study", "hdopt/report", "hdopt/workflow", "hdopt/optimize",
                   "hdopt/drive", "hdopt/tolerance", "hdopt/allocation", "geometry"):  # fmt: skip
        for file in sorted((ROOT / folder).rglob("*.py")):
            for line, said in literal_plurals(ast.parse(file.read_text(encoding="utf-8"))):
                if not any(said.startswith(known) for known in AT_LEAST_TWO):
                    found.append(f"{file.relative_to(ROOT)}:{line}: {said}")
    assert not found, "\n".join(found)


def test_counted():
    assert [counted(n, "row") for n in (0, 1, 2)] == ["0 rows", "1 row", "2 rows"]
    assert counted("1", "input turn") == "1 input turn" and counted("1.5", "input turn") == "1.5 input turns"
    assert counted(1, "row was", "rows were") == "1 row was" and counted(3, "row was", "rows were") == "3 rows were"


@pytest.mark.parametrize("noise", [-4.6e-11, 2e-12, -0.0, 0.0])
def test_rounding_noise_about_nought_is_not_printed(noise):
    """Would catch a room of -4.6e-11 mm beside its limit of 0."""
    assert summary._row("Room", "mm", noise, noise).split() == ["Room", "0", "mm", "was", "0"]
    assert summary.number(noise, "mm") == "0 mm"
    assert settled(2e-9) == 2e-9


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("moved by (-0.000, 0.010) um", "moved by ( 0.000, 0.010) um"),
        ("  perimeter   -0.0000 mm", "  perimeter    0.0000 mm"),
        ("-0", " 0"),
        ("-0.0001 mm, -0.5, -10, -0e-5, x-0.0, 2024-01-00", "-0.0001 mm, -0.5, -10, -0e-5, x-0.0, 2024-01-00"),
    ],
)
def test_a_number_rounded_to_nought_has_no_minus(line, said):
    assert without_minus_nought(line) == said


def test_every_output_file_of_every_command_is_claimed_and_so_said():
    """Would catch an option that writes a file past `OutputFile`, by which `emit` names what was written."""
    context = click.Context(cli)
    for name in COMMANDS:
        for option in cli.get_command(context, name).params:
            if isinstance(option, click.Option) and option.metavar == "FILE" and not OTHERS & set(option.opts):
                assert isinstance(option.type, OutputFile), f"{name} {option.opts}"


def test_every_written_file_is_said_once(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    files = {"--csv": "ke.csv", "--xlsx": "ke.xlsx", "--json": "ke.json"}
    with pytest.raises(SystemExit):
        main(["ke", *(part for pair in files.items() for part in pair)])
    lines = capsys.readouterr().out.splitlines()
    assert sorted(line for line in lines if "wrote" in line) == sorted(f"wrote {file}" for file in files.values())
    assert "requirement" in lines[-1]
    with pytest.raises(SystemExit):
        main(["new", "own"])
    assert capsys.readouterr().out.count("wrote own.toml\n") == 1
    with pytest.raises(SystemExit):
        main(["ke", "--csv", "ke.csv", "--json", "-"])
    assert "wrote" not in capsys.readouterr().out
