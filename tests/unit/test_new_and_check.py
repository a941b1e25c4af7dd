"""A study to begin with, what a study lacks, and the messages on the way: each says what to do next."""

from __future__ import annotations

import json
import re
import tomllib

import pytest

import hdopt
from hdopt.cli import main
from hdopt.errors import HdoptError, IncompleteStudy, MissingValue
from hdopt.study import load_study, shipped_drives, shipped_studies
from hdopt.study.defaults import defaults_taken, used_by
from hdopt.study.nearest import UNIT, near_keys
from hdopt.study.schema import ANY_NAME, SECTIONS, known_paths, section_model
from hdopt.workflow.check_study import PROBES, check_study
from hdopt.workflow.explore import explorer_page
from hdopt.workflow.study_reference import section_reference, study_reference

OWN = """[drive]
flexspline_teeth = 200
circular_spline_teeth = 202
module_mm = 0.25
pressure_angle_deg = 20
flexspline_inner_radius_mm = 24.2
[wave_generator]
width_mm = 7.5
[errors]
axis_tilt_x_deg = 0.1
"""


def said(capsys, *arguments):
    """Exit status, standard output and standard error of a command line."""
    with pytest.raises(SystemExit) as end:
        main(list(arguments))
    out = capsys.readouterr()
    return end.value.code, out.out, out.err


@pytest.mark.parametrize("source", [*shipped_drives(), *shipped_studies()])
def test_a_new_study_has_the_numbers_of_its_source(source, tmp_path):
    """Would catch a section, a key or a nested table that is not written, or written as another value."""
    made = hdopt.new_study(tmp_path / "mine", source)
    ours, theirs = hdopt.load_study(made.file), hdopt.load_study(source)
    titled = {**theirs.data, "study": {**theirs.data.get("study", {}), "title": "mine"}}
    assert ours.data == titled
    if "drive" in theirs.sections:
        assert ours.drive == theirs.drive


def test_every_key_of_the_schema_stands_in_a_new_study_and_is_explained(tmp_path):
    text = hdopt.new_study(tmp_path / "mine").file.read_text()
    for name in SECTIONS:
        if name in ("effects", "contributors"):
            continue
        assert re.search(rf"^(# )?\[{name}\]$", text, re.M), name
        for key in section_reference(name)[0].keys:
            beside, above = rf"^(# )?{key.key} = .+# \S", rf"^# \S.*\n(# )?{key.key} = "
            assert re.search(beside, text, re.M) or re.search(above, text, re.M), f"{name}.{key.key}"
    wide = [line for line in text.splitlines() if len(line) > 120]
    assert wide == [], "lines that an editor has to scroll for"


def test_a_default_behind_a_comment_sign_is_the_one_that_holds(tmp_path):
    """Each '# key = value' taken in gives the same study: would catch a default that the comment has wrong."""
    file = hdopt.new_study(tmp_path / "mine", "csf-25-80-tolerances").file
    before = hdopt.load_study(file)
    lines = file.read_text().splitlines()
    section, tried = "", 0
    for place, line in enumerate(lines):
        section = line.strip("[]") if line.startswith("[") else section
        if line.startswith("# ["):
            section = ""
        if section and re.match(r"# \w+ = (?!\.\.\.)", line):
            changed = [*lines[:place], line[2:], *lines[place + 1 :]]
            (tmp_path / "changed.toml").write_text("\n".join(changed))
            assert hdopt.load_study(tmp_path / "changed.toml").sections == before.sections, line
            tried += 1
    assert tried >= 3


def test_every_key_has_a_meaning():
    """Would catch a key added to the schema without a word on it: comments and the docs' page would be empty there."""
    without = [
        f"{table.name}: {key.key}"
        for name, tables in study_reference().items()
        for table in tables
        for key in table.keys
        if not key.meaning or not table.says
    ]
    assert without == []


@pytest.mark.parametrize(
    ("setting", "said_of_it"),
    [
        ("study.step=1", "unknown key 'step'; did you mean 'steps'?"),
        ("search.foo=1", "known: search.front_points"),
        ("wavegen.x=1", "unknown key 'wavegen.x'; it may begin with study, drive, wave_generator"),
    ],
)
def test_a_key_that_is_none_is_answered_with_those_of_its_section(setting, said_of_it):
    """Would catch a list of 794 keys from the top of the alphabet."""
    with pytest.raises(HdoptError) as error:
        hdopt.load_study("csf-25-80", [setting])
    assert said_of_it in str(error.value)


def test_steps_and_title_are_set_by_their_whole_name():
    study = hdopt.load_study("csf-25-80", ['study.steps=["waveform"]', "study.title=Mine"])
    assert study.data["study"]["steps"] == ["waveform"] and study.data["study"]["title"] == "Mine"


def test_new_does_not_write_over_a_file(tmp_path, capsys):
    (tmp_path / "mine.toml").write_text("")
    status, _, error = said(capsys, "new", str(tmp_path / "mine"))
    assert status == 2 and "is there already" in error
    assert (tmp_path / "mine.toml").read_text() == ""


def test_a_new_drive_needs_one_message_for_all_that_it_lacks(tmp_path, capsys):
    """Would catch a message a key: after adding what the first one lists, the file must do."""
    file = tmp_path / "own.toml"
    file.write_text("[drive]\nflexspline_teeth = 200\n")
    status, _, error = said(capsys, "ke", str(file))
    assert status == 2 and error.count("\n") == 1
    named = re.findall(r"\b(drive|wave_generator)\.(\w+)", error)
    shipped = hdopt.load_study().data
    text = "[drive]\nflexspline_teeth = 160\n" + "".join(f"{k} = {shipped[s][k]}\n" for s, k in named if s == "drive")
    text += "[wave_generator]\n" + "".join(f"{k} = {shipped[s][k]}\n" for s, k in named if s == "wave_generator")
    file.write_text(text + "[errors]\naxis_tilt_x_deg = 0.1\n")
    assert hdopt.kinematic_error(file).peak_to_peak_arcmin > 0


def test_sections_that_are_missing_come_in_one_message(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(OWN.partition("[wave_generator]")[0])
    with pytest.raises(MissingValue, match=r"needs \[wave_generator\] and \[errors\], which .* add them"):
        hdopt.kinematic_error(file)
    file.write_text(OWN)
    with pytest.raises(MissingValue, match=r"a stack needs \[tolerances\] and \[requirement\], which .* add them"):
        hdopt.stack(file)


def test_check_tells_what_an_own_drive_allows(tmp_path, capsys):
    file = tmp_path / "own.toml"
    file.write_text(OWN)
    status, out, _ = said(capsys, "check", str(file), "--json", "-")
    found = json.loads(out)
    assert status == 0
    assert found["can"] == ["kinematic error of one drive"]
    assert found["missing"]["flank pressure"] == [
        "load.torque_nm",
        "load.tooth_face_width_mm",
        "drive.flexspline_addendum_mm",
        "drive.circular_spline_addendum_mm",
    ]
    assert found["missing"]["tolerance stack and sensitivities"] == ["[tolerances]", "[requirement]"]
    frame = hdopt.check_study(file).to_frame()
    assert list(frame["what"]) == [one.what for one, _ in PROBES]


def test_the_verdict_names_no_command_that_cannot_be_run(tmp_path, capsys):
    """Would catch `hdopt ke` offered for a verdict beside a line that says it needs [errors]."""
    file = tmp_path / "own.toml"
    tolerance = 'axis_eccentricity_mm = { distribution = "rayleigh", scale = 0.005 }'
    limit = "[requirement]\npeak_to_peak_arcmin = 0.8\n"
    file.write_text(f"{OWN.partition('[errors]')[0]}\n[tolerances]\n{tolerance}\n{limit}")
    _, out, _ = said(capsys, "check", str(file))
    assert "no   kinematic error of one drive: give [errors]" in out
    assert "yes  verdict on the requirement (hdopt stack, hdopt sobol)\n" in out


def test_a_verdict_that_no_command_can_give_is_none(tmp_path, capsys):
    """Fault caught: 'yes' with all four commands, each of which ends with what is missing."""
    file = tmp_path / "own.toml"
    flat = OWN.replace("[wave_generator]", '[wave_generator]\nprofile = "two_disk"')
    tolerance = 'axis_eccentricity_mm = { distribution = "rayleigh", scale = 0.005 }'
    file.write_text(f"{flat}\n[tolerances]\n{tolerance}\n[requirement]\npeak_to_peak_arcmin = 0.8\n")
    _, out, _ = said(capsys, "check", str(file))
    (line,) = [line for line in out.splitlines() if "verdict on the requirement" in line]
    assert line.startswith("  no ")


def test_callouts_alone_are_stacked(tmp_path, capsys):
    """They stand in place of tolerances. Fault caught: an empty [tolerances] asked for beside them."""
    file = tmp_path / "own.toml"
    callout = 'bore = { callout = "coaxiality", value_mm = 0.02, feeds = "axis_eccentricity" }'
    text = f"{OWN}\n[requirement]\npeak_to_peak_arcmin = 0.8\n[contributors]\n{callout}\n"
    found = []
    for more in ("", "[tolerances]\n"):
        file.write_text(text + more)
        _, out, error = said(capsys, "stack", str(file), "-n", "2048", "--json", "-")
        assert not error
        found.append(json.loads(out)["yield"])
        assert "yes  tolerance stack and sensitivities" in said(capsys, "check", str(file))[1]
    assert found[0] == found[1]
    file.write_text(text.partition("[contributors]")[0] + "[contributors]\n")
    assert "needs a [tolerances] section" in said(capsys, "stack", str(file), "-n", "2048")[2]


def test_an_explorer_needs_what_a_stack_needs(tmp_path):
    """Fault caught: an empty [contributors] taken for callouts, and the page refused that may do without a cloud."""
    file = tmp_path / "own.toml"
    callout = 'bore = { callout = "coaxiality", value_mm = 0.02, feeds = "axis_eccentricity" }'
    for callouts, cloud in (("", False), (callout, True)):
        file.write_text(f"{OWN}\n[requirement]\npeak_to_peak_arcmin = 0.8\n[contributors]\n{callouts}\n")
        page = explorer_page(hdopt.load_study(file), 16)
        assert (len(page.cloud) > 0) is cloud
        assert any("the study has no [tolerances]" in note for note in page.notes) is not cloud


@pytest.mark.parametrize("value", [True, "keyway", 14.0, 6])
def test_an_assumed_size_is_printed_as_a_study_takes_it(value):
    """Would catch `hub = True` and `mount = keyway`, which no study file may say."""
    from hdopt.geometry.model import Assumption

    assert tomllib.loads(str(Assumption("size", value, "a rule")).partition(" (")[0]) == {"size": value}


def test_check_of_an_incomplete_drive_says_all_at_once(tmp_path, capsys):
    file = tmp_path / "own.toml"
    file.write_text("[drive]\nflexspline_teeth = 200\n")
    status, out, _ = said(capsys, "check", str(file), "--json", "-")
    found = json.loads(out)
    assert status == 1 and found["can"] == []
    assert found["missing"]["kinematic error of one drive"] == [
        "drive.circular_spline_teeth",
        "drive.module_mm",
        "drive.pressure_angle_deg",
        "drive.flexspline_inner_radius_mm",
        "wave_generator.width_mm",
        "[errors]",
    ]


@pytest.mark.parametrize("place", range(len(PROBES)), ids=[one.what for one, _ in PROBES])
def test_what_check_calls_missing_is_what_stops_the_work(place, tmp_path):
    """For each key of the shipped study: without it the work asks for that key if and only if `check` says so."""
    capability, probe = PROBES[place]
    whole = hdopt.load_study("csf-25-80-tolerances")
    probe(whole)
    for section, keys in whole.data.items():
        for key in keys:
            field = section_model(section).model_fields.get(key)
            if field is None or field.is_required():
                continue
            data = {name: {k: v for k, v in rows.items() if (name, k) != (section, key)} for name, rows in
                    whole.data.items()}  # fmt: skip
            study = hdopt.load_study().with_(data)
            stopped: tuple[str, ...] = ()
            try:
                probe(study)
            except MissingValue as error:
                stopped = error.keys
            except HdoptError:
                continue
            checked = {one.what: one for one in hdopt.check_study(study).capabilities}[capability.what]
            assert (f"{section}.{key}" in stopped) == (f"{section}.{key}" in checked.missing), (section, key)


MESSAGES = {
    "a decimal comma": ("[drive]\nmodule_mm = 0,3\n", r"line 2, module_mm = 0,3: a decimal point is needed.*: 0\.3"),
    "a comma in a table": (
        "[tolerances]\naxis_tilt_x_deg = { distribution = 'normal', std = 0,03 }\n",
        r"decimal point is needed, not a comma: 0\.03",
    ),
    "a comma in quotes": ("[wave_generator]\nwidth_mm = '8,5'\n", r"a decimal point is needed, not a comma: 8\.5"),
    "a unit": ("[wave_generator]\nwidth_mm = 9 mm\n", "a number stands alone, 9, in the unit that ends the key's name"),
    "no quotes": ("[wave_generator]\nprofile = ellipse\n", 'a text needs quotation marks, "ellipse"'),
    "both drives": ('drive = "csf-25-80"\n[drive]\nmodule_mm = 1\n', "keep one of them"),
    "a kind": (
        "[tolerances]\naxis_tilt_x_deg = { distribution = 'norml', std = 0.1 }\n",
        ".distribution: is 'norml'; it must be one of normal, uniform",
    ),
    "a bare tolerance": ("[tolerances]\naxis_tilt_x_deg = 0.1\n", "give its distribution, as in { distribution"),
    "a cost": (
        "[tolerances]\naxis_tilt_x_deg = { distribution = 'normal', std = 0.1, cost = { model = 'x' } }\n",
        ".model: is 'x'; it must be one of reciprocal, power",
    ),
    "a list": ("[search]\nprofiles = 'ellipse'\n", "must be a list, in square brackets"),
    "a whole number": ("[export]\nbolt_count = 2.5\n", "must be a whole number"),
    "another section's key": ("[errors]\npressure_angle_deg = 12\n", r"it belongs into \[drive\]"),
    "a ratio": ("[drive]\nratio = 100\n", "did you mean 'flexspline_teeth' or 'circular_spline_teeth'"),
    "half a name": ("[errors]\neccentricity = 0.01\n", "'axis_eccentricity_mm' or 'wg_eccentricity_mm'"),
    "a symbol": ("[errors]\ne1 = 0.01\n", "did you mean 'axis_eccentricity_mm'"),
    "without its unit": ("[wave_generator]\nwidth = 9\n", "write 'width_mm', with its unit"),
}
OF_PYDANTIC = re.compile("Input |tag|dictionary|extract|pydantic|valid (list|integer|boolean|number|string)", re.I)


@pytest.mark.parametrize("name", MESSAGES)
def test_messages_are_in_the_words_of_whoever_wrote_the_file(name, tmp_path):
    text, message = MESSAGES[name]
    file = tmp_path / "own.toml"
    file.write_text(text)
    with pytest.raises(HdoptError, match=message) as refused:
        hdopt.load_study(file)
    assert not OF_PYDANTIC.search(str(refused.value).partition(": ")[2])


def test_a_comma_given_by_set_is_explained(capsys):
    status, _, error = said(capsys, "ke", "--set", "module_mm=0,3")
    assert status == 2 and "a decimal point is needed, not a comma: 0.3" in error


def test_a_commas_list_is_no_decimal_comma(tmp_path):
    """A list of whole numbers without blanks is TOML; its fault elsewhere on the line must not be called a comma."""
    file = tmp_path / "own.toml"
    file.write_text("[allocate]\ncurve = [1,2] x\n")
    with pytest.raises(HdoptError) as refused:
        hdopt.load_study(file)
    assert "decimal" not in str(refused.value)


def test_names_that_are_like_nothing_get_no_suggestion():
    keys = [key for name in ("search", "tolerances") for key in section_model(name).model_fields]
    assert near_keys("ratio", keys) == []
    assert near_keys("colour", keys) == []
    assert near_keys("axis_tilt_z_deg", keys) == ["axis_tilt_x_deg"] or near_keys("axis_tilt_z_deg", keys)


@pytest.mark.parametrize("section", ["drive", "wave_generator", "errors", "load", "operation", "requirement"])
def test_a_misspelt_key_without_its_unit_leads_to_that_key(section):
    """Would catch `modul` taken for `model`: a unit that the user leaves out counted as misspelt."""
    names = sorted({path[-1] for path in known_paths({}) if ANY_NAME not in path})
    assert len(names) > 300
    for key in section_model(section).model_fields:
        stem = UNIT.sub("", key)
        for said in (stem, stem[:-1], stem[:1] + stem[2:]):  # whole, its last letter gone, its second
            if len(said) > 4 and said not in names:
                assert key in near_keys(said, names), said


@pytest.mark.parametrize(("said", "meant"), [("modul", "module_mm"), ("temp", "temperature_difference_k")])
def test_set_leads_to_what_was_begun(said, meant):
    with pytest.raises(HdoptError, match=f"unknown key '{said}'; did you mean '{meant}'"):
        load_study("csf-25-80", overrides=[f"{said}=0.3"])


def test_a_key_like_nothing_is_not_answered_with_the_first_of_hundreds():
    with pytest.raises(HdoptError, match=r"unknown key 'druckwinkel'; hdopt new NAME writes a study with every key"):
        load_study("csf-25-80", overrides=["druckwinkel=20"])


def test_an_incomplete_study_names_its_keys(tmp_path):
    file = tmp_path / "own.toml"
    file.write_text(OWN.replace("module_mm = 0.25\n", ""))
    with pytest.raises(IncompleteStudy) as refused:
        hdopt.load_study(file)
    assert refused.value.keys == ("drive.module_mm",)


def test_what_a_command_falls_back_on_is_printed(tmp_path, capsys):
    """Would catch a default taken in silence: profile, structure, the axes by rule, errors that are zero."""
    file = tmp_path / "own.toml"
    file.write_text(OWN)
    _, out, _ = said(capsys, "ke", str(file))
    assert "default: [wave_generator] falls back on semi_major_mm = inner radius + module, semi_minor_mm from" in out
    assert "profile = ellipse, structure = integral" in out
    assert "default: [errors] does not give axis_eccentricity_mm, axis_tilt_y_deg, wg_eccentricity_mm" in out
    _, out, _ = said(capsys, "profile", "--json", "-")
    assert json.loads(out)["defaults"] == ["no study given: the shipped csf-25-80"]
    _, out, _ = said(capsys, "profile", "csf-25-80")
    assert "default:" not in out


def test_what_stays_of_a_shipped_drive_is_printed(tmp_path, capsys):
    """A study that starts from a shipped drive and gives one error keeps the other seven: 0.987 arcmin in place of
    none. Faults caught: that in silence; a line for what was set to 0, or set on the command line, or by a study that
    gives nothing of its own; directions counted beside their sizes; costs taken for tolerances."""
    file = tmp_path / "own.toml"
    sizes = 'drive = "csf-25-80"\n[errors]\naxis_eccentricity_mm = 0.012\naxis_tilt_x_deg = 0\n'
    file.write_text(sizes)
    kept = "default: [errors] keeps of csf-25-80 {}wg_eccentricity_mm = 0.005, wg_tilt_major_deg = 0.1, "
    for command in (("ke",), ("stack", "-n", "2048"), ("check",)):
        _, out, _ = said(capsys, *command, str(file))
        assert kept.format("axis_tilt_y_deg = 0.2, ") in out and "; say where yours is 0\n" in out
        assert "direction_deg = " not in out
    _, out, _ = said(capsys, "ke", str(file), "--set", "errors.axis_tilt_y_deg=0")
    assert kept.format("") in out
    file.write_text(
        'drive = "csf-25-80"\n[tolerances]\naxis_tilt_x_deg = { distribution = "uniform", lower = -0.1, upper = 0.1 }\n'
    )
    _, out, _ = said(capsys, "stack", str(file), "-n", "2048")
    assert "default: [tolerances] keeps of csf-25-80 axis_eccentricity_mm, axis_tilt_y_deg, wg_eccentricity_mm, " in out
    for whole in ("csf-25-80", "csf-25-80-tolerances"):
        assert "keeps of" not in said(capsys, "stack", whole, "-n", "2048", "--set", "errors.axis_tilt_x_deg=0")[1]


def test_a_drive_in_place_of_the_studys_own_is_said(tmp_path, capsys):
    """Fault caught: another drive computed under the name of a study, in silence."""
    file = tmp_path / "own.toml"
    file.write_text(OWN)
    _, out, _ = said(capsys, "ke", str(file), "--drive", "csf-25-80")
    sections = "[drive], [wave_generator], [clearances], [material], [load]"
    assert f"default: --drive: {sections} are those of csf-25-80, whatever {file} gives" in out
    assert "--drive:" not in said(capsys, "ke", "--drive", "csf-25-80")[1]


def test_a_drive_that_nobody_named_is_said(tmp_path, capsys):
    """Would catch a recording judged by the shipped drive's ratio without a word."""
    rows = "\n".join(f"{i * 0.01},{i * 3.6},{i * 3.6 / 80}" for i in range(400))
    (tmp_path / "run.csv").write_text("time_s,input_angle_deg,output_angle_deg\n" + rows + "\n")
    _, out, _ = said(capsys, "inspect", str(tmp_path / "run.csv"))
    assert "default: no drive given: the shipped csf-25-80" in out
    _, out, _ = said(capsys, "inspect", str(tmp_path / "run.csv"), "--drive", "csf-25-80")
    assert "default:" not in out


def test_run_speaks_for_every_section_that_a_study_has():
    sections = hdopt.load_study("chase-shaft-housing").sections
    assert used_by("run", sections) == tuple(sections)
    assert defaults_taken(sections, used_by("run", sections))[0].startswith("[linear_stack] falls back on")


def test_a_study_that_says_everything_falls_back_on_nothing():
    study = hdopt.load_study()
    assert defaults_taken(study.sections, ("wave_generator", "errors", "tolerances", "requirement")) == ()
    without = study.with_({"requirement": {"peak_to_peak_arcmin": 1.0}})
    (line,) = defaults_taken(without.sections, ("requirement",))
    assert line == "[requirement] falls back on yield = 0.9973, homogenization = single_tooth"


def test_sizes_of_another_drive_are_said(tmp_path):
    """Would catch a new drive that keeps the wave generator of the one that it was copied from: 'the teeth overlap'."""
    sizes = {"flexspline_teeth": 200, "circular_spline_teeth": 202, "module_mm": 0.25}
    changes = {f"drive.{key}": value for key, value in (sizes | {"flexspline_inner_radius_mm": 24.1}).items()}
    with pytest.raises(HdoptError, match=r"semi_major_mm is 31\.046, 6\.946 mm beyond .*leave semi_major_mm"):
        assert hdopt.load_study("csf-25-80").with_(changes).drive
    own = hdopt.load_study("csf-25-80").with_(changes | {"semi_major_mm": 24.35, "semi_minor_mm": 23.85})
    assert own.drive.wave_generator.profile.semi_major == 24.35


def test_teeth_that_overlap_all_round_do_not_hide_the_kinematic_error():
    """The addenda bear on the contact angle alone: a note says what is wrong with them."""
    study = hdopt.load_study("csf-25-80").with_(flexspline_addendum_mm=0.9)
    result = hdopt.kinematic_error(study)
    assert result.peak_to_peak_arcmin == hdopt.kinematic_error("csf-25-80").peak_to_peak_arcmin
    assert result.contact_angle_deg is None and "overlap all round" in " ".join(result.notes)


def test_what_everything_lacks_is_said_once(tmp_path, capsys):
    (tmp_path / "own.toml").write_text(
        "[drive]\nflexspline_teeth = 200\ncircular_spline_teeth = 202\nmodule_mm = 0.25\n"
        "[errors]\naxis_eccentricity_mm = 0.01\naxis_eccentricity_direction_deg = 0\n"
    )
    with pytest.raises(SystemExit):
        main(["check", str(tmp_path / "own.toml")])
    out = capsys.readouterr().out
    for key in ("drive.pressure_angle_deg", "drive.flexspline_inner_radius_mm", "wave_generator.width_mm"):
        assert out.count(key) == 1
    assert "  no   kinematic error of one drive\n" in out
    assert "  no   lag at reversal: give clearances.backlash_mm\n" in out


def test_orders_that_are_nil_are_counted_not_listed(capsys):
    with pytest.raises(SystemExit):
        main(["ke", "csf-25-80", "--set", "fs_tooth_amplitude_mm=0", "--set", "wg_eccentricity_mm=0"])
    out = capsys.readouterr().out
    assert "   0.0000  " not in out and "E1, CS teeth" in out
    assert "orders below 5e-05 arcmin left out" in out


@pytest.mark.parametrize("name", [*shipped_drives(), *shipped_studies()])
def test_no_size_of_what_ships_is_in_doubt(name):
    study = load_study(drive=name) if name in shipped_drives() else load_study(name)
    if "drive" in study.sections:
        assert check_study(study).doubts == ()


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        (
            {"flexspline_teeth": 200, "circular_spline_teeth": 202},
            r"200 / 2 = 39\.6 mm, lies 20\.7 modules beyond its wall",
        ),
        ({"module_mm": 0.317}, r"deflects the flexspline by 0\.396 mm, 1\.25 modules, where about one is usual"),
        ({"module_mm": 0.317}, r"160 / 2 = 25\.36 mm, lies 19 modules inside its wall, which ends at 31\.39 mm"),
        ({"flexspline_wall_mm": 2.0}, r"lies 2\.45 modules inside its wall, which ends at 32\.65 mm"),
        (
            {"module_mm": 0.317},
            r"^flexspline_addendum_mm is 0\.874 and circular_spline_addendum_mm is 0\.811 times the module of 0\.317",
        ),
        ({"circular_spline_addendum_mm": 0.18}, r"^circular_spline_addendum_mm is 0\.455 times the module of 0\.396"),
        ({"semi_minor_mm": 30.5}, r"would stretch the flexspline's wall round its turn, as from 30\.65 to 30\.77 mm"),
        ({"semi_minor_mm": 29.9}, r"would compress the flexspline's wall round its turn, as from 30\.65 to 30\.48 mm"),
    ],
)
def test_a_number_left_over_from_another_drive_is_doubted(changes, said):
    """By hand: 0.396 mm x 200/2 = 39.6 mm; the wall ends at 30.65 + 0.74 = 31.39 mm; 0.277 / 0.317 = 0.874; the ring's
    radius is nearly the mean of the axes and (a - b)^2 / (8 (a + b)) more: 30.774 mm, 30.476 mm."""
    study = load_study("csf-25-80").with_(changes)
    (doubt,) = [one for one in check_study(study).doubts if re.search(said, one)]
    assert doubt in check_study(study).to_dict()["doubts"]


def test_another_drive_whose_sizes_belong_together_is_not_doubted():
    """100:1 on the same pitch circle, with its own deflection and addenda."""
    study = load_study("csf-25-80").with_(
        flexspline_teeth=200,
        circular_spline_teeth=202,
        module_mm=0.317,
        semi_major_mm=30.967,
        semi_minor_mm=30.33,
        flexspline_addendum_mm=0.222,
        circular_spline_addendum_mm=0.206,
    )
    assert check_study(study).doubts == ()
