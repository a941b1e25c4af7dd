"""A refusal names the option, or the file and line, of the number that it speaks of."""

import click
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hdopt
from hdopt.cli import main
from hdopt.cli.app import COMMANDS, cli
from hdopt.study.document import parse_document
from hdopt.study.named import shows, values_named

STUDY = """drive = "csf-25-80"

[requirement]
peak_to_peak_arcmin = 1
yield = 0.99999

[tolerances.axis_tilt_x_deg]
distribution = "normal"
std = 0.05
"""
GEAR = "r.csv --drive none --ratio"
REFUSED = {
    "stack chase-shaft-housing -n": ("1", "31"),
    "stack chase-shaft-housing -n 2048 --quantile": ("0", "1", "-1", "1e-300", "5e-324", "0.99999999", "nan", "inf"),
    "stack chase-shaft-housing -n 2048 --tail": ("nan", "inf", "-inf"),
    "sobol chase-shaft-housing -n": ("1", "100"),
    "sobol chase-shaft-housing --method morris -n": ("1", "100"),
    f"inspect {GEAR} 7.2 --speed-rpm": ("0", "-1", "nan", "inf"),
    f"inspect {GEAR}": ("0", "-1", "1e9", "nan", "inf", "80"),
    f"diagnose {GEAR}": ("0", "-1", "1e9", "nan", "inf", "80"),
    f"compensate -o o.csv {GEAR}": ("0", "-1", "1e9", "nan", "inf", "80"),
    f"compensate -o o.csv {GEAR} 7.2 --terms": ("-1", "1000"),
    "ke csf-25-80 --turns 1 --sampling-deg": ("0", "-1", "1e-300", "1e9", "nan", "inf"),
    "ke csf-25-80 --sampling-deg 1 --turns": ("0", "-1", "1e300", "nan", "inf"),
    "compare cam.csv --probe-radius-mm": ("-1", "nan", "inf"),
}
"""Command line up to the number of its last option -> numbers that are refused before any work."""


def refusal(words, capsys):
    with pytest.raises(SystemExit) as ended:
        main(words)
    assert ended.value.code == 2, words
    return capsys.readouterr().err


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    rows = [f"{i * 0.1},{i * 9.0},{i * 9.0 / 7.2}" for i in range(200)]
    (tmp_path / "r.csv").write_text("\n".join(["time_s,input_deg,output_deg", *rows]))
    (tmp_path / "cam.csv").write_text("\n".join(["angle_deg,radius_mm", *(f"{i},30" for i in range(0, 360, 5))]))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("line", REFUSED)
def test_a_refused_number_comes_with_its_option(line, inputs, capsys):
    option = line.split()[-1]
    for number in REFUSED[line]:
        said = refusal([*line.split(), number], capsys)
        assert option in said, said
        assert said.count("\n") <= 3


def test_every_option_with_a_number_is_bounded_or_tried_above():
    tried = {(line.split()[0], line.split()[-1]) for line in REFUSED}
    for name in COMMANDS:
        for option in cli.get_command(click.Context(cli), name).params:
            kind = option.type
            if isinstance(kind, click.types.IntParamType | click.types.FloatParamType) and not option.is_flag:
                bounded = getattr(kind, "min", None) is not None and getattr(kind, "max", None) is not None
                assert bounded or any((name, word) in tried for word in option.opts), (name, option.opts)


def test_a_number_of_the_study_comes_with_file_and_line(tmp_path, capsys):
    """The quantile is the yield's: whoever is told of n alone looks in the wrong place."""
    (tmp_path / "s.toml").write_text(STUDY)
    said = refusal(["stack", str(tmp_path / "s.toml"), "-n", "2048"], capsys)
    assert "-n 2048; " in said and "s.toml, line 5, requirement.yield: n is 2048, too small" in said
    said = refusal(["stack", "csf-25-80-tolerances", "--set", "requirement.yield=0.999999"], capsys)
    assert "-n 262144 (the default); --set requirement.yield: n is 262144" in said
    with pytest.raises(hdopt.HdoptError, match=r"s\.toml, line 5, requirement\.yield: n is 2048"):
        hdopt.stack(tmp_path / "s.toml", 2048)


@settings(max_examples=100, derandomize=True, deadline=None)
@given(value=st.one_of(st.floats(), st.integers(-(10**6), 10**6)), form=st.sampled_from(["{}", "{!r}", "{:g}"]))
def test_a_message_shows_a_number_however_it_is_written(value, form):
    """But not 1 for 0.99999999, which six digits make of it."""
    written = form.format(value)
    if form == "{:g}" and float(written) != value and float(written).is_integer():
        assert not shows(f"the yield is {written}; it is refused", value, "yield")
        return
    assert shows(f"the yield is {written}; it is refused", value, "yield")
    assert not shows("the yield is refused", value, "yield")


def test_a_common_number_is_taken_only_beside_its_name():
    document = parse_document("a_mm = 2\nlimit = 3\nb = 0.25\nc = 0.25\nd = 0.75\n", "s.toml")
    assert values_named(document, "the limit is 3, 2 are needed") == ("s.toml, line 2, limit",)
    assert values_named(document, "0.25 and 0.75") == ("s.toml, line 5, d",)
