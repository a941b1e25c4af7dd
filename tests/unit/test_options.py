"""Every option of every command reaches the call that does the work: each is given a value that is not its default."""

import inspect

import click
import pytest
from click.testing import CliRunner

from hdopt.cli.app import COMMANDS, cli
from hdopt.cli.common import CHECK, status
from hdopt.cli.export import FILES
from hdopt.workflow import recorded_drive
from hdopt.workflow.requirement import Verdict

REC = ("one.csv", "two.csv")
CASES = {
    "stack": (
        "hdopt.workflow.stack.stack",
        "-n 640 --tail 1.5 --worst-case --quantile 0.8 --quantile 0.7 --sampling monte-carlo --seed 7",
        {"n": 640, "tail": 1.5, "worst_case": True, "quantiles": (0.8, 0.7), "sampling": "monte-carlo", "seed": 7},
    ),
    "sobol": (
        "hdopt.workflow.stack.sobol",
        "-n 640 --no-second-order --shapley groups --seed 7",
        {"n": 640, "second_order": False, "shapley": "groups", "seed": 7},
    ),
    "sobol --method": (
        "hdopt.workflow.stack.screen",
        "--method delta -n 640 --seed 7",
        {"method": "delta", "n": 640, "seed": 7},
    ),
    "ke": (
        "hdopt.workflow.kinematic_error.kinematic_error",
        "--sampling-deg 9 --turns 3 --method closed",
        {"sampling_deg": 9.0, "turns": 3.0, "method": "closed"},
    ),
    "allocate": (
        "hdopt.workflow.allocate.allocate",
        "csf-25-80-tolerances --rule rss --no-compare --seed 7",
        {"rule": "rss", "compare": False, "seed": 7},
    ),
    "search": (
        "hdopt.workflow.search.search",
        "csf-25-80-design-trade --no-fronts --regions --seed 7",
        {"fronts": False, "regions": True, "seed": 7},
    ),
    "compare": (
        "hdopt.workflow.compare.compare",
        "cam.csv --probe-radius-mm 2 --surface bearing --part disc_1 --fit minimum_zone",
        {"measured": "cam.csv", "probe_radius_mm": 2.0, "surface": "bearing", "part": "disc_1", "fit": "minimum_zone"},
    ),
    "compensate": (
        "hdopt.workflow.compensate.compensate",
        "one.csv two.csv -o table.json --terms 3 --seed 7",
        {"terms": 3, "seed": 7},
    ),
    "diagnose": (
        "hdopt.workflow.diagnose.diagnose",
        "one.csv two.csv --nuisance drift,time-warp --seed 7",
        {"recordings": ["one.csv", "two.csv"], "nuisance": ("drift", "time-warp"), "seed": 7},
    ),
    "diagnose --each": (
        "hdopt.workflow.diagnose_many.diagnose_many",
        "one.csv two.csv --each --nuisance drift --seed 7",
        {"nuisance": ("drift",), "seed": 7},
    ),
    "inspect": (
        "hdopt.workflow.inspect.inspect",
        "one.csv two.csv --limit rms=60arcsec --mounting A,B --speed-rpm 30 --serial S1 --conditions cold --seed 7",
        {"limits": {"rms": 1.0}, "mountings": ("A", "B"), "speed_rpm": 30.0, "seed": 7},
    ),
    "inspect --each": (
        "hdopt.workflow.inspect_many.inspect_many",
        "one.csv two.csv --each --limit rms=60arcsec --seed 7",
        {"limits": {"rms": 1.0}, "seed": 7},
    ),
    "explore": (
        "hdopt.workflow.explore.explore",
        "-o page.html -n 5 --seed 7",
        {"file": "page.html", "n": 5, "seed": 7},
    ),
    "export": (
        "hdopt.workflow.export.export",
        "--step cam.step --allocation found.json",
        {"tolerances": "found.json"},
    ),
    "new": ("hdopt.workflow.new_study.new_study", "mine --from resal", {"name": "mine", "source": "resal"}),
    "run": ("hdopt.workflow.run.run_study", "-o there --seed 7 --resume", {"seed": 7, "resume": True}),
}
"""By command: the call that does the work, a command line, and what of it the call must have got, by argument."""
STUDIES = {
    "ke": ("--structure automatic", "wave_generator.structure", "automatic"),
    "profile": ("--profile resal", "wave_generator.profile", "resal"),
    "export": ("--step cam.step --context", "export.context", True),
    "export --structure": ("--step cam.step --structure automatic", "wave_generator.structure", "automatic"),
    "stack": ("--set wave_generator.width_mm=7.5", "wave_generator.width_mm", 7.5),
    "sobol": ("--set wave_generator.width_mm=7.5", "wave_generator.width_mm", 7.5),
}
"""By command: options that change the study, the key, and what it then holds."""
SEEN_ELSEWHERE = {
    *("--json", "--csv", "--xlsx"),  # test_tables, test_cli
    *("--set", "--drive", "--study"),  # test_study_changes
    *("--engine", "--resume", "--verify"),  # test_engine, test_run_folder
    *("--check", "--help"),  # test_cli_tolerances, test_inspect
    *("--report", "--write-study", "--write-bench", "--plot", "--as"),  # files: test_python_calls, test_compensate
    *("--ratio", "--columns", "--bench"),  # below: of recordings
    *(f"--{kind}" for kind in FILES),  # what `export` writes: tests/cad
}

NOTHING_RANDOM = ("ke", "profile", "export", "compare")
"""They take --seed, as every command does, for nothing."""


class Called(Exception):
    """Raised in place of the work."""


@pytest.fixture
def asked_of(monkeypatch, tmp_path):
    """Run a command line whose work is the function of that name: what the function would have got, by argument."""
    monkeypatch.chdir(tmp_path)
    for name in REC:
        (tmp_path / name).write_text("input_deg,output_deg\n0,0\n")
    monkeypatch.setattr(recorded_drive.RecordedDrive, "recordings", lambda self, files: [str(one) for one in files])

    def run(work, command, line):
        module, _, name = work.rpartition(".")
        signature, got = inspect.signature(getattr(__import__(module, fromlist=[name]), name)), {}

        def stand_in(*args, **kwargs):
            bound = signature.bind(*args, **kwargs)
            bound.apply_defaults()
            got.update(bound.arguments)
            raise Called

        monkeypatch.setattr(work, stand_in)
        result = CliRunner().invoke(cli, [command, *line.split()])
        assert isinstance(result.exception, Called), (result.output, result.exception)
        return got

    return run


@pytest.mark.parametrize("case", CASES)
def test_options_reach_the_work(case, asked_of):
    """Would catch an option that is read and not passed on, or a default in its place."""
    work, line, wanted = CASES[case]
    got = asked_of(work, case.split()[0], line)
    assert {name: got[name] for name in wanted} == wanted


@pytest.mark.parametrize("case", STUDIES)
def test_options_that_change_the_study_change_it(case, asked_of):
    line, key, value = STUDIES[case]
    command = case.split()[0]
    work = {"profile": "hdopt.workflow.kinematic_error.profile"}.get(command) or CASES[command][0]
    study = asked_of(work, command, line)["study"]
    data = getattr(study, "data", None)
    if data is None:  # a stack's problem: its drive alone
        assert study.response.drive.wave_generator.width == value
        return
    section, _, last = key.partition(".")
    assert data[section][last] == value


def test_a_stack_takes_the_geometry_asked_for(asked_of):
    assert asked_of("hdopt.workflow.stack.stack", "stack", "--geometry auto")["study"].geometry == "auto"


def test_a_sheet_bears_its_words(asked_of):
    got = asked_of(*("hdopt.workflow.inspect.inspect", "inspect", "one.csv --serial S1 --conditions cold"))
    assert (got["label"].serial, got["label"].conditions) == ("S1", "cold")


@pytest.mark.parametrize("command", ["inspect", "diagnose", "compensate -o t.csv"])
def test_what_is_said_of_recordings_reaches_their_reader(command, asked_of):
    name, _, more = command.partition(" ")
    line = f"one.csv --drive none --ratio 101 --columns input=a:deg --bench bench.toml {more}"
    got = asked_of("hdopt.workflow.recorded_drive.recorded_drive", name, line)
    assert [str(value) for value in got.values()] == ["none", "101.0", "input=a:deg", "bench.toml"]


def test_every_option_of_every_command_is_tried_here():
    """A new option wants a line above, or the test that tries it."""
    tried = {"stack": {"--geometry"}}
    for name in NOTHING_RANDOM:
        tried[name] = {"--seed"}
    lines = [(case, line) for case, (_, line, _) in CASES.items()] + [(case, one[0]) for case, one in STUDIES.items()]
    for case, line in lines:
        tried.setdefault(case.split()[0], set()).update(line.split())
    missing = []
    for name in COMMANDS:
        for option in cli.get_command(click.Context(cli), name).params:
            names = {*option.opts, *option.secondary_opts} if isinstance(option, click.Option) else SEEN_ELSEWHERE
            if not names & (SEEN_ELSEWHERE | tried.get(name, set())):
                missing.append(f"{name} {option.opts[0]}")
    assert missing == []


@pytest.mark.parametrize("answer", [True, False])
@pytest.mark.parametrize("checked", [True, False])
@pytest.mark.parametrize("value", [0.5, 1.0, 1.5, None])
@pytest.mark.parametrize("at_least", [True, False])
def test_the_status_says_whether_the_requirement_is_met(answer, checked, value, at_least):
    """1 where the answer is no, or where --check was given and the requirement is missed; on the limit it is met."""
    verdict = None if value is None else Verdict("yield", value, 1.0, at_least=at_least)
    missed = value is not None and (value < 1.0 if at_least else value > 1.0)
    with click.Context(cli) as context:
        context.meta[CHECK] = checked
        assert status(answer, verdict) == int(not answer or (checked and missed))
    if verdict is not None:
        assert verdict.met is not missed
        assert verdict.line.startswith("requirement missed" if missed else "requirement met")


@pytest.mark.parametrize(
    "line", ["compensate r.csv -o -", "inspect r.csv --report -", "stack csf-25-80-tolerances --xlsx -"]
)
def test_standard_output_is_no_file_where_nothing_is_written_to_it(line, tmp_path, monkeypatch):
    """Fault caught: a file called '-' in the working directory, and no word of it."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "r.csv").write_text("input_deg,output_deg\n0,0\n")
    said = CliRunner().invoke(cli, line.split(), standalone_mode=True)
    assert said.exit_code != 0
    assert "-" not in {path.name for path in tmp_path.iterdir()}
    assert "only --json and --csv write to standard output" in said.output
