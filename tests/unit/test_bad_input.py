"""Whatever comes in, a command ends with 2 and one message of three lines at most: never a traceback, never a 1."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from hdopt.cli import Terminated, main
from hdopt.errors import HdoptError, in_brief, shown

BASE = 'drive = "csf-25-80"\n'
RECORDING = "time_s,input_deg,output_deg\n" + "\n".join(f"{i * 0.01},{i * 3.6},{i * 3.6 / 80}" for i in range(400))

STUDIES = {
    "deep array": ("a = " + "[" * 5000 + "]" * 5000, "line 1: is nested too deeply"),
    "deep keys": (".".join("a" * 3000) + " = 1\n", "levels deep"),
    "deep table": ("[" + ".".join("a" * 3000) + "]\n", "levels deep"),
    "400 digits": (
        BASE + "[errors]\naxis_tilt_x_deg = 1" + "0" * 400,
        "line 3, errors.axis_tilt_x_deg: is an integer",
    ),
    "5000 digits": (
        BASE + "[errors]\naxis_tilt_x_deg = 1" + "0" * 5000,
        "line 3: holds an integer of more than 4300 digits",
    ),
    "5000 letters": (BASE + "x" * 5000 + " = 1\n", "a name of 5000 letters"),
    "many faults": (BASE + "[errors]\n" + "".join(f"a{i} = 1\n" for i in range(100)), "more faults"),
    "a long blank": ("[" + " " * 200_000 + "x\n", "is not valid TOML"),
    "bytes": (bytes(range(256)), "is not a text file"),
    "password": ("root:x:0:0:secret", "is not valid TOML"),
    "ratio": (BASE + "[drive]\n", "is not valid TOML"),
}

SETTINGS = {
    "axis_tilt_x_deg=" + "9" * 400: "is an integer of",
    "axis_tilt_x_deg=1e308": "less than or equal to 5",
    "axis_tilt_x_deg=nan": "finite",
    "axis_tilt_x_deg=6": "less than or equal to 5",
    "axis_eccentricity_mm=1000": "less than or equal to 5",
    "wave_generator.width_mm=1e300": "less than or equal to 2000",
    "wave_generator.width_mm=0.001": "greater than or equal to 0.1",
    "flexspline_teeth=10000": "less than or equal to 2000",
    "module_mm=1e-300": "greater than or equal to 0.01",
    "flexspline_inner_radius_mm=1e300": "less than or equal to 2000",
    "semi_major_mm=1e308": "less than or equal to 2000",
    "torque_nm=1e308": "less than or equal to 1000000",
    "z" * 5000 + "=1": "unknown key",
}

COMMANDS = {
    "name": (["ke", "y" * 5000], "unknown study"),
    "control characters": (["ke", "\x1b[31mred\n\n\n\n"], "unknown study"),
    "samples": (["stack", "-n", "1" + "0" * 400], "not in the range"),
    "seed": (["stack", "--seed", "1" + "0" * 400], "not in the range"),
    "tail": (["stack", "-n", "4096", "--tail", "nan"], "finite number"),
    "grid": (["ke", "--sampling-deg", "1e-300"], "take a coarser grid"),
    "engine": (["stack", "--engine", "x" * 5000], "unknown engine"),
    "drive": (["ke", "--drive", "x" * 5000], "--drive: unknown drive 'xx"),
    "nowhere": (["ke", "--json", "no/such/folder.json"], "there is no folder"),
}

RECORDINGS = {
    "long field": ("time_s,input_deg,output_deg\n" + "1" * 200_000 + ",2,3\n", [], ""),
    "long header": ("x" * 200_000 + ",b,c\n1,2,3\n", [], ""),
    "nothing": ("", [], "holds no rows"),
    "ratio 1e308": (RECORDING, ["--drive", "none", "--ratio", "1e308"], "at most 100000"),
    "ratio nan": (RECORDING, ["--drive", "none", "--ratio", "nan"], "finite number above 0"),
    "secret": ("root:x:0:0:secret\nbin:x:1:1:secret\n", [], ""),
}


def ends_with_two(capsys, arguments, message):
    with pytest.raises(SystemExit) as stopped:
        main(arguments)
    said = capsys.readouterr()
    assert stopped.value.code == 2, said.err
    assert said.err.startswith("hdopt: ") and said.err.count("\n") <= 3 and len(said.err) < 2000
    assert message in said.err
    assert "\x1b" not in said.err and "Traceback" not in said.err and "HDOPT_TRACEBACK" not in said.err
    return said.err


@pytest.mark.parametrize("name", STUDIES)
def test_studies(name, tmp_path, capsys):
    text, message = STUDIES[name]
    path = tmp_path / "bad.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    said = ends_with_two(capsys, ["ke", str(path)], message)
    assert "bad.toml" in said and "secret" not in said


@pytest.mark.parametrize("setting", SETTINGS, ids=lambda text: text[:40])
def test_values_beyond_physics(setting, capsys):
    ends_with_two(capsys, ["profile", "--set", setting], SETTINGS[setting])


@pytest.mark.parametrize("name", COMMANDS)
def test_commands(name, capsys):
    ends_with_two(capsys, *COMMANDS[name])


@pytest.mark.parametrize("name", RECORDINGS)
def test_recordings(name, tmp_path, capsys):
    text, options, message = RECORDINGS[name]
    (tmp_path / "r.csv").write_text(text)
    said = ends_with_two(capsys, ["diagnose", str(tmp_path / "r.csv"), *options], message)
    assert "r.csv" in said or "ratio" in said


def test_a_recording_is_not_overwritten_by_its_own_result(tmp_path, capsys):
    recording = tmp_path / "r.csv"
    recording.write_text(RECORDING)
    (tmp_path / "link.json").symlink_to(recording)
    for output in ("r.csv", "link.json"):
        arguments = ["diagnose", str(recording), "--json", str(tmp_path / output)]
        ends_with_two(capsys, arguments, "r.csv is read and was also given as an output")
    assert recording.read_text() == RECORDING


def test_a_cam_with_a_field_beyond_all_limits(tmp_path, capsys):
    (tmp_path / "cam.csv").write_text("angle_deg,radius_mm\n" + "9" * 200_000 + ",1\n")
    chosen = ("profile=measured", "wave_generator.surface=cam", f"wave_generator.file={tmp_path / 'cam.csv'}")
    arguments = ["profile", *(part for setting in chosen for part in ("--set", setting))]
    ends_with_two(capsys, arguments, "cam.csv")


@pytest.mark.parametrize(
    "name", ["negative", "nil", "not finite", "not a number", "another study", "foreign", "text", "other JSON", "deep"]
)
def test_allocations(name, tmp_path, capsys):
    text, message = {
        "negative": (
            '{"errors": {"axis_eccentricity_mm": {"tolerance": -1}}}',
            "is '-1'; it must be a finite",
        ),
        "not finite": ('{"errors": {"axis_eccentricity_mm": {"tolerance": Infinity}}}', "which is not finite"),
        "nil": ('{"errors": {"axis_eccentricity_mm": {"tolerance": 0}}}', "is '0'; it must be a finite number above 0"),
        "not a number": ('{"errors": {"axis_eccentricity_mm": {"tolerance": NaN}}}', "which is not finite"),
        "another study": (
            '{"study": "chase-shaft-housing", "errors": {"axis_eccentricity_mm": {"tolerance": 0.01}}}',
            "is of the study 'chase-shaft-housing', not of 'csf-25-80'; give the allocation of this study",
        ),
        "foreign": ('{"errors": {"gap": {"tolerance": 1}}}', "unknown tolerance 'gap'"),
        "text": ('{"errors": {"axis_eccentricity_mm": {"tolerance": "wide"}}}', "is 'wide'"),
        "other JSON": ('{"peak_to_peak_arcmin": 1}', "holds no tolerances under 'errors'"),
        "deep": ("[" * 100_000, "is nested too deeply"),
    }[name]
    (tmp_path / "a.json").write_text(text)
    (tmp_path / "earlier.cam.csv").write_text("kept")
    outputs = {"dxf": "a.dxf", "cam": "earlier.cam.csv", "json": "a2.json"}
    arguments = [word for kind, file in outputs.items() for word in (f"--{kind}", str(tmp_path / file))]
    said = ends_with_two(capsys, ["export", "--allocation", str(tmp_path / "a.json"), *arguments], message)
    assert "a.json" in said
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "earlier.cam.csv"]
    assert (tmp_path / "earlier.cam.csv").read_text() == "kept"


def test_costs_that_a_solver_gives_up_on(capsys):
    """A dimension 1e15 times as sensitive as the others: Clarabel ends with cvxpy's `SolverError`, scaled or not."""
    stack = ("allocate", "chase-shaft-housing", "--no-compare", "--rule", "rss")
    sensitive = ("--set", "linear_stack.dimensions.shaft.sensitivity=1e15")
    ends_with_two(capsys, [*stack, *sensitive], "the solver CLARABEL gave up on these costs and tolerances; see")


GRADES = (
    "linear_stack.dimensions.shaft.cost={model='table', grades=[{grade='a', tolerance=0.004, cost=2.0}, "
    "{grade='b', tolerance=0.009, cost=1.0}]}"
)


@pytest.mark.parametrize(("setting", "solver"), [("required_yield=0.99", "CLARABEL"), (GRADES, "HIGHS")])
def test_a_solver_that_gives_up_is_one_message(setting, solver, capsys, monkeypatch):
    import cvxpy

    def gives_up(problem, solver, **options):
        raise cvxpy.error.SolverError(f"Solver {solver!r} failed. Try another solver.\n" * 50)

    monkeypatch.setattr(cvxpy.Problem, "solve", gives_up)
    asked = ["allocate", "chase-shaft-housing", "--no-compare", "--set", setting]
    ends_with_two(capsys, asked, f"the solver {solver} gave up")


def test_messages_are_short_whatever_comes_in():
    assert in_brief("a\nb\nc\nd\ne") == "a\nb\nand 3 more faults of this kind"
    assert len(in_brief("x" * 10_000)) <= 600
    assert in_brief("a\x1b[31m\tb") == "a\\x1b[31m\\tb"
    assert len(shown("x" * 10_000)) < 70
    with pytest.raises(HdoptError):
        raise HdoptError(in_brief("one line"))


def process(*arguments, **options):
    """hdopt as a process of its own, which SIGINT reaches even where the tests run in the background of a shell."""
    code = "from hdopt.cli import main; main()"
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.Popen(command, stderr=subprocess.PIPE, text=True, preexec_fn=_interruptible, **options)


def _interruptible():
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.mark.parametrize(("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 143)])
def test_an_interruption_that_a_callback_swallows_is_still_one(number, status, monkeypatch, capsys):
    """Would catch status 2 where compiled code drops the exception that a signal raised and ends with its own."""

    def computed(*arguments):
        try:
            os.kill(os.getpid(), number)
            time.sleep(5)
        except BaseException:
            lost = True
        assert lost
        raise RuntimeError("the kernel was left in an undefined state")

    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    monkeypatch.setattr("hdopt.cli._run", computed)
    try:
        with pytest.raises(SystemExit) as ended:
            main(["studies"])
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.value.code == status
    assert "undefined" not in capsys.readouterr().err


@pytest.mark.parametrize(("interruption", "status"), [(KeyboardInterrupt, 130), (Terminated, 143)])
def test_an_interruption_that_a_library_hides_is_still_one(interruption, status, monkeypatch, capsys):
    """A compiled library that is interrupted while it is imported raises an ImportError, which ended with status 2."""

    def imported(*arguments):
        try:
            raise interruption
        except BaseException as error:
            raise ImportError("initialization failed") from error

    monkeypatch.setattr("hdopt.cli._run", imported)
    with pytest.raises(SystemExit) as ended:
        main(["studies"])
    assert ended.value.code == status
    assert "initialization" not in capsys.readouterr().err


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs /dev/full")
def test_a_full_disk_behind_standard_output():
    with open("/dev/full", "w") as full, process("studies", stdout=full) as running:
        assert running.wait(60) == 2
        assert running.stderr.read() == "hdopt: writing to standard output failed: No space left on device\n"


@pytest.mark.parametrize("closed", [1, 2])
def test_a_closed_stream_is_as_good_as_nothing(closed, tmp_path):
    """Would catch an answer in the first file that is opened, and a message that goes to standard output instead."""
    words = ["new", str(tmp_path / "mine")] if closed == 1 else ["ke", "no-such-study"]
    code = (
        f"import os, sys; os.close({closed}); os.execv(sys.executable, [sys.executable, '-m', 'hdopt', *sys.argv[1:]])"
    )
    done = subprocess.run([sys.executable, "-c", code, *words], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout + done.stderr) == (0 if closed == 1 else 2, "")
    if closed == 1:
        assert (tmp_path / "mine.toml").read_text().startswith("#")


def test_a_closed_pipe_ends_quietly():
    reading, writing = os.pipe()
    os.close(reading)
    with process("studies", stdout=writing) as running:
        os.close(writing)
        assert (running.wait(60), running.stderr.read()) == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "delay"),
    [*((signal.SIGINT, delay) for delay in (0.3, 1.6, 4.0)), *((signal.SIGTERM, delay) for delay in (0.8, 2.5, 5.0))],
)
def test_a_signal_at_any_time_ends_without_a_trace(tmp_path, number, delay):
    """From the imports to the threads at work: 130 or 143, one line, and no file but the finished parts of `run`."""
    arguments = ["stack", "-n", "200000000", "--json", str(tmp_path / "out.json")]
    with process(*arguments, stdout=subprocess.DEVNULL, env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)}) as running:
        time.sleep(delay)
        running.send_signal(number)
        status = running.wait(120)  # where the kernels are not on disk yet, a signal may wait for one to be compiled
        said = running.stderr.read().removeprefix("\n")  # the line that a terminal has its ^C on
    began = status in (130, 143)
    assert began or status == -number  # before the program's first line, the system answers by itself
    if began:
        assert said in ("hdopt: interrupted\n", "hdopt: ended by SIGTERM\n")
    assert not list(tmp_path.glob("*.json")) and not list(tmp_path.glob(".*"))
