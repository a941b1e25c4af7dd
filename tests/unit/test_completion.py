"""The Tab key: every option whose values have names offers them, every one that takes a file the files."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys

import click
import pytest
from click.shell_completion import ShellComplete

from hdopt.cli.app import COMMANDS, cli

FREE = {"--columns", "--limit", "--mounting", "--serial", "--conditions", "--set"}
"""Options of text that the user makes up; `NAME` of `hdopt new` is an argument of that kind."""


def offers(*words, incomplete=""):
    found = ShellComplete(cli, {}, "hdopt", "_X").get_completions(list(words), incomplete)
    return {item.value or item.type for item in found}


def named_options():
    context = click.Context(cli)
    for name in COMMANDS:
        for option in cli.get_command(context, name).params:
            if isinstance(option, click.Option) and not option.is_flag and not FREE & set(option.opts):
                if not isinstance(option.type, click.types.FloatParamType | click.types.IntParamType):
                    yield name, max(option.opts, key=len)


@pytest.mark.parametrize(("command", "option"), sorted(named_options()))
def test_every_option_with_names_or_files_completes(command, option):
    """Would catch `--structure`, which offered nothing, and every --csv FILE, which offered no files."""
    found = ShellComplete(cli, {}, "hdopt", "_X").get_completions([command, option], "")
    assert found, f"{command} {option}"


@pytest.mark.parametrize(
    ("words", "incomplete", "expected"),
    [
        (("ke", "--structure"), "one", {"one_way_major", "one_way_minor"}),
        (("ke", "--method"), "", {"exact", "closed-form"}),
        (("stack", "--geometry"), "", {"exact", "closed-form", "auto"}),
        (("stack", "--sampling"), "", {"sobol", "monte-carlo"}),
        (("allocate", "--rule"), "", {"worst_case", "rss", "yield"}),
        (("sobol", "--method"), "mo", {"morris"}),
        (("sobol", "--shapley"), "", {"inputs", "groups"}),
        (("profile", "--profile"), "t", {"two_disk"}),
        (("ke", "--drive"), "csf", {"csf-25-80"}),
        (("inspect", "--drive"), "no", {"none"}),
        (("diagnose", "--nuisance"), "drift,t", {"drift,time-warp"}),
        (("compensate", "--as"), "", {"csv", "json", "c"}),
    ],
)
def test_what_is_offered(words, incomplete, expected):
    assert offers(*words, incomplete=incomplete) == expected


@pytest.mark.parametrize(("command", "option"), [("ke", "method"), ("stack", "geometry")])
def test_the_closed_form_needs_no_quotes(command, option):
    context = click.Context(cli)
    for name in ("closed-form", "closed form"):
        asked = cli.get_command(context, command).make_context(command, [f"--{option}", name])
        assert asked.params[option] == "closed form"


BASH = """eval "$(_HDOPT_COMPLETE=bash_source hdopt)"
COMP_WORDS=(hdopt ke --structure one) COMP_CWORD=3; _hdopt_completion hdopt one --structure; echo "${COMPREPLY[@]}"
"""


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_completes(tmp_path):
    """Bash itself, with the line of the how-to, asks and gets."""
    script = tmp_path / "hdopt"
    script.write_text(f"#!{sys.executable}\nfrom hdopt.cli import main\nmain()\n")
    script.chmod(0o755)
    env = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    done = subprocess.run(["bash", "-c", BASH], env=env, capture_output=True, text=True, timeout=60)
    assert done.stdout.split() == ["one_way_major", "one_way_minor"], done.stderr
