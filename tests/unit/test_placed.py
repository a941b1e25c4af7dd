"""A refusal names the option, or the file and line, of the number that it speaks of."""

import re
from dataclasses import replace
from pathlib import Path

import click
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import hdopt
from hdopt.cli import main
from hdopt.cli.app import COMMANDS, _placing, cli
from hdopt.cli.place import placed
from hdopt.errors import EngineFailed, HdoptError
from hdopt.files import FilesOfWork, note_input, watching_files
from hdopt.parallel.cluster import Dask
from hdopt.study import leaves, load_study
from hdopt.study.document import parse_document
from hdopt.study.named import keys_named, places_named, shows, values_named
from hdopt.workflow.placed import numbers_named

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


@pytest.mark.parametrize(
    ("line", "innocent"),
    [
        ("ke --sampling-deg 0", "errors.cs_tooth_phase_deg"),
        ("ke --sampling-deg -3", "errors"),
        ("stack -n 2000 --quantile 0.99999", "load.input_speed_rpm"),
    ],
)
def test_a_refused_option_points_to_nothing_else(line, innocent, inputs, capsys):
    """Faults caught: values of the study that are equal to the option's, or to a limit that the message names, beside
    a unit or a little word that their keys share with it: a speed of 2000 for -n 2000, a phase of 0 for 'above 0'."""
    said = refusal(line.split(), capsys)
    assert innocent not in said and ".toml" not in said, said


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
@given(
    value=st.one_of(st.floats(), st.integers(-(10**6), 10**6)),
    form=st.sampled_from(["{}", "{!r}", "{:g}", "{:.9g}", "{:.12g}"]),
)
def test_a_message_shows_a_number_however_it_is_written(value, form):
    """But not 1 for 0.99999999, which six digits make of it."""
    written = form.format(value)
    if "g}" in form and float(written) != value and float(written).is_integer():
        assert not shows(f"the yield is {written}; it is refused", value, "yield")
        return
    assert shows(f"the yield is {written}; it is refused", value, "yield")
    assert not shows("the yield is refused", value, "yield")


def test_a_unit_or_a_little_word_names_no_key():
    """Faults caught: 'give 1 to 64' for a peak_to_peak_arcmin of 1, 'above 0 deg' for a phase_deg of 0."""
    assert not shows("it is -1; give 1 to 64", 1.0, "peak_to_peak_arcmin")
    assert not shows("it must lie above 0 deg", 0.0, "cs_tooth_phase_deg")
    assert shows("a peak of 1 is too small", 1.0, "peak_to_peak_arcmin")


def test_a_common_number_is_taken_only_beside_its_name():
    document = parse_document("a_mm = 2\nlimit = 3\nb = 0.25\nc = 0.25\nd = 0.75\n", "s.toml")
    assert values_named(document, "the limit is 3, 2 are needed") == ("s.toml, line 2, limit",)
    assert values_named(document, "0.25 and 0.75") == ("s.toml, line 5, d",)
    # Would catch a refusal without a line because its value stands in the study twice.
    assert values_named(document, "0.25 is too small") == ("s.toml, line 3, b", "s.toml, line 4, c")


def test_of_keys_with_one_value_the_one_that_is_spoken_of_is_meant():
    """A width of 0.5 mm that is too small was said to be the module too."""
    document = parse_document("module_mm = 0.5\nwidth_mm = 0.5\n", "s.toml")
    assert values_named(document, "its axial width is 0.5 mm; 1.7 mm are needed") == ("s.toml, line 2, width_mm",)
    assert len(values_named(document, "0.5 mm are too small")) == 2


def test_a_line_of_another_file_and_a_letter_are_no_values():
    """Faults caught: 102 teeth for line 102 of a cam, and 'a = 2' of a distribution for 'slot 2 for a disc'."""
    document = parse_document("teeth = 102\na = 2\nlines = 720\n", "s.toml")
    assert values_named(document, "line 102: holds a number that is not finite") == ()
    assert values_named(document, "lines 7, 9 and 102: no numbers") == ()
    assert values_named(document, "slot 2 for a disc reaches 33.2 mm") == ()
    assert values_named(document, "a = 2 is too small") == ("s.toml, line 2, a",)
    assert values_named(document, "720 lines are too many") == ("s.toml, line 3, lines",)
    assert values_named(document, "102 teeth are too few") == ("s.toml, line 1, teeth",)


def test_digits_of_a_name_are_no_values():
    document = parse_document("teeth = 160\nplay = -162\n", "s.toml")
    assert values_named(document, "cams-160/a.csv, runs/160/b.csv and csf-25-160, or v160, -162 of them") == (
        "s.toml, line 2, play",
    )
    assert values_named(document, "cams-162 is no folder") == ()


def test_a_value_of_a_key_that_is_named_is_that_keys():
    """Fault caught: a bore of 30 mm, named and refused, said to be a direction of 30 deg too."""
    document = parse_document("[errors]\ndirection_deg = 30\n[export]\nbore_mm = 30\n", "s.toml")
    said = "the keyway of a 30 mm bore reaches beyond; give a smaller export.bore_mm or another direction"
    assert places_named(document, said) == ("s.toml, line 4, export.bore_mm",)
    assert "errors.direction_deg" in places_named(document, "the direction of 30 is odd")[0]


@pytest.mark.parametrize(
    "where",
    ["cam.csv: ", "cam.csv, line 3: ", "{folder}/my cam.csv: ", "my cam.csv has points: ", "cam: ", "cam, line 3: "],
)
def test_a_message_that_begins_with_a_file_points_to_no_study(where, tmp_path, monkeypatch):
    """In Python as on the command line: its numbers are of that file, whatever values of the study they equal."""
    monkeypatch.chdir(tmp_path)
    for name in ("cam.csv", "my cam.csv", "cam"):
        (tmp_path / name).write_text("")
    said = "the points leave 102.5 deg of the cam out"

    @numbers_named
    def refused(study):
        raise HdoptError(where.format(folder=tmp_path) + said)

    @numbers_named
    def without_file(study):
        raise HdoptError(said)

    study = load_study("csf-25-80", ["wave_generator.width_mm=102.5"])
    with pytest.raises(HdoptError, match=rf"^{re.escape(where.format(folder=tmp_path) + said)}$"):
        refused(study)
    with pytest.raises(HdoptError, match=rf"^--set wave_generator.width_mm: {said}$"):
        without_file(study)


FOLDERS = ("0", "6", "160", "cams-162", "162-cams", "160 cams", "csf-25-160", "run 0.5", "0.0")
"""Folders whose digits are values of the shipped study, or the defaults of options."""
BROKEN = {
    "compare": ("1,2\n", "angle_deg,radius_mm\n1,28\n", "angle_deg,radius_mm\n1,2\n3,x\n"),
    "inspect": ("input_deg,output_deg\n1,2\n", "input_deg,output_deg\n" + "x,y\n" * 30),
    "diagnose": ("", "time_s,input_deg\n1,2\n"),
    "ke": ("drive = 3\n", 'drive = "csf-25-80"\n[errors]\ne1 = 3\n'),
}


@pytest.mark.parametrize("command", BROKEN)
@pytest.mark.parametrize("relative", [False, True])
def test_digits_of_a_folder_are_no_numbers(command, relative, tmp_path, monkeypatch, capsys):
    """A refusal of a broken file begins with it, whatever its folder is called. Fault caught: a cam in a folder 160 was
    refused with line 5 of the drive, which has 160 teeth, and one in a folder 0 with the radius of a probe."""
    monkeypatch.chdir(tmp_path)
    for folder in FOLDERS:
        for text in BROKEN[command]:
            path = tmp_path / folder / ("s.toml" if command == "ke" else "r.csv")
            path.parent.mkdir(exist_ok=True)
            path.write_text(text)
            given = str(path.relative_to(tmp_path)) if relative else str(path)
            said = refusal([command, given], capsys)
            assert said.startswith((f"hdopt: {given}", f"hdopt: {path.name}")), said


WORDS = st.sampled_from(
    ["the", "solver", "sobol", "ellipse", "threads", "rss", "least_squares", "csf-25-80", "none", "12", "0.5", "arcmin"]
)
COMMAND_LINES = {
    "stack": ["csf-25-80-tolerances"],
    "allocate": ["csf-25-80-tolerances"],
    "search": ["csf-25-80-design-trade"],
    "ke": ["s.toml"],
    "run": ["s.toml"],
    "export": ["s.toml"],
    "compare": ["cam.csv"],
    "explore": [],
    "inspect": ["r.csv"],
    "diagnose": ["r.csv", "--drive", "none", "--ratio", "7.2"],
    "compensate": ["r.csv", "-o", "o.csv"],
}


@pytest.mark.parametrize("name", COMMAND_LINES)
def test_whatever_a_command_refuses_names_a_file_or_an_option(name, inputs):
    """Words that are the defaults of options are in many a message, and no place to look."""
    (inputs / "s.toml").write_text(STUDY)
    context = cli.get_command(click.Context(cli), name).make_context(name, list(COMMAND_LINES[name]))
    with watching_files() as work, context:
        study = context.params.get("study")
        if "recordings" not in context.params:
            load_study(None if name == "compare" else study)
        for recording in context.params.get("recordings", ()):
            note_input(recording)
        places = [re.escape(path.name) for path in work.inputs] + [re.escape(work.facts.get("source", "r.csv"))]
        places += [rf"(?<!\S){word}(?!\w)" for parameter in context.command.params for word in parameter.opts]

        @settings(max_examples=50, derandomize=True, deadline=None)
        @given(st.lists(WORDS, min_size=1, max_size=8).map(" ".join))
        def refused(message):
            if name in ("inspect", "diagnose", "compensate") or not re.search(rf"(?<!\S){study}(?!\S)", message):
                said = placed(message, context, work)
                assert said.endswith(message)
                assert any(re.search(place, said.removesuffix(message)) for place in places), said

        refused()


@pytest.mark.parametrize("source", ["csf-25-80-tolerances", "csf-25-80-design-trade", "paper-reproduction"])
def test_a_message_that_names_a_key_comes_with_its_line(source):
    document = load_study(source).document
    keys = [path for path in leaves(document.data) if path in document.lines and len(path) > 1]
    for path in keys:
        dotted = ".".join(path)
        said = placed(f"the pieces do not fit; change {dotted}", None, of(document))
        assert said.startswith(f"{document.source}, line {document.lines[path]}, {dotted}: ")
        if len(path) == 2:
            assert placed(f"[{path[0]}] {path[1]} is too large", None, of(document)).startswith(document.where(path))
        assert keys_named(document, f"nothing fits; leave it out, as with {dotted}") == (), "an example is nobody's"
    assert len(keys) >= 3 and keys_named(document, "hdopt.stack and drive.nothing, docs/a.b") == ()


def of(document):
    return FilesOfWork(facts={"source": document.source}, values=lambda message: places_named(document, message))


@pytest.mark.parametrize("called", ["cam.csv", "cams/cam.csv", "/work/cams/cam.csv"])
def test_the_numbers_of_a_file_that_was_read_are_no_studys(called):
    """Fault caught: an input known by its bare name alone, so that one in a folder is placed at a study's line."""
    document = parse_document("radius_mm = 21.5\n", "s.toml")
    work = replace(of(document), inputs={Path("/work/cams/cam.csv"): ""})
    said = f"{called}, line 7: the radius 21.5 comes twice"
    assert placed(said, None, work) == said
    assert placed("the radius 21.5 is too large", None, work).startswith("s.toml, line 1, radius_mm")


def test_an_engine_that_fails_is_no_fault_of_the_study():
    def work():
        Dask("127.0.0.1:9", timeout_s=1.0)._knock()

    with pytest.raises(EngineFailed, match="^--engine: no Dask scheduler answers at 127"):
        _placing(work)()


def test_an_option_whose_word_is_refused_is_named(inputs, capsys):
    (inputs / "s.toml").write_text(STUDY)
    said = refusal(["compare", "cam.csv", "--part", "lid"], capsys)
    assert said.startswith("hdopt: --part lid: unknown part")
