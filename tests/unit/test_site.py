"""The documentation site builds without a warning, and what it says is true: commands, equations, figures, links."""

from __future__ import annotations

import os
import re
import runpy
import shlex
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from urllib.parse import urlsplit

import pytest

from hdopt.cli import main
from hdopt.cli.app import COMMANDS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = sorted([*DOCS.glob("*.md"), *(DOCS / "development").glob("*.md")])


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path):
    """Broken links between pages, pages in no list, docstrings that are no text; the gallery's code runs elsewhere."""
    arguments = ["-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", tmp_path / "trees"]
    built = subprocess.run(
        [sys.executable, *arguments, DOCS, tmp_path / "site"],
        env={**os.environ, "HDOPT_DOCS_PICTURES": "0"},
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert built.returncode == 0, built.stderr[-3000:]
    for page in ("index", "tutorial", "generated/study-file", "generated/api", "examples/index", "verification"):
        assert (tmp_path / "site" / f"{page}.html").exists()
    assert broken_links(tmp_path / "site") == []
    for command in COMMANDS:
        page = (tmp_path / "site" / "generated" / "commands" / f"{command}.html").read_text(encoding="utf-8")
        assert "From Python" in page and "Exit status" in page and "--" in page, command
    theory = (tmp_path / "site" / "theory.html").read_text(encoding="utf-8")
    assert [name for name, _ in equations() if f'href="generated/api.html#{name}"' not in theory
            and f'href="generated/api.html#module-{name}"' not in theory] == []  # fmt: skip
    assert theory.count('<svg class="math"') >= len(equations())


def broken_links(site: Path) -> list[str]:
    """Links from page to page of a built site that lead nowhere."""
    broken = []
    for page in site.rglob("*.html"):
        for link in re.findall(r'href="([^"#?:]+)(?:#[^"]*)?"', page.read_text(encoding="utf-8")):
            if not (page.parent / link).exists():
                broken.append(f"{page.relative_to(site)}: {link}")
    return broken


def consoles(page: Path) -> list[tuple[list[str], list[str]]]:
    """The (command, lines of output) of every console block of a page."""
    found = []
    for block in re.findall(r"```console\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
        command, *lines = block.rstrip("\n").split("\n")
        assert command.startswith("$ hdopt "), command
        found.append((shlex.split(command.removeprefix("$ hdopt ")), lines))
    return found


@pytest.mark.slow
def test_every_command_of_the_tutorial_says_what_the_page_says(tmp_path, monkeypatch, capsys):
    """Would catch an answer that changed and a line of output in other words; '...' stands for what is left out."""
    monkeypatch.chdir(tmp_path)
    blocks = consoles(DOCS / "tutorial.md")
    assert len(blocks) >= 7
    for arguments, lines in blocks:
        with pytest.raises(SystemExit) as end:
            main(arguments)
        out = capsys.readouterr().out
        assert end.value.code == 0
        place = 0
        for line in filter(None, (line.strip() for line in lines)):
            for part in filter(None, (part.strip() for part in line.split("..."))):
                assert part in out[place:], f"hdopt {' '.join(arguments)}: {part!r} is not, or not there, in\n{out}"
                place = out.index(part, place) + len(part)


@pytest.mark.parametrize("page", [DOCS / "tutorial.md", ROOT / "README.md"], ids=lambda page: page.name)
def test_python_on_the_pages_runs(page):
    for block in re.findall(r"```python\n(.*?)```", page.read_text(encoding="utf-8"), re.S):
        exec(compile(block, page.name, "exec"), {})


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_has_its_paragraph(command):
    text = (DOCS / "how-to.md").read_text(encoding="utf-8")
    assert f"\n## hdopt {command}\n" in text


FUNCTION_AND_TEST = re.compile(r"`(hdopt\.[\w.]+)` · `(tests/[\w/.]+)`")


def equations() -> list[tuple[str, str]]:
    """(function, test) of every equation on the page on theory."""
    text = (DOCS / "theory.md").read_text(encoding="utf-8")
    return re.findall(r"^`(hdopt\.[\w.]+)` · `(tests/[\w/.]+)`$", text, re.M)


def test_every_equation_has_its_function_and_its_test():
    """Would catch a function that was renamed and a test file that moved."""
    found = equations()
    text = (DOCS / "theory.md").read_text(encoding="utf-8")
    blocks = re.findall(r"\$\$(.+?)\$\$((?:\n\n\$\$.+?\$\$)*)\n\n(.*)", text)
    assert len(blocks) == len(found) >= 28
    assert all(FUNCTION_AND_TEST.fullmatch(line) for *_, line in blocks), "an equation without its function and test"
    for function, test in found:
        assert (ROOT / test).exists(), test
        module, _, name = function.rpartition(".")
        try:
            import_module(function)
        except ModuleNotFoundError:
            assert hasattr(import_module(module), name), function
        said = (ROOT / test).read_text(encoding="utf-8")
        assert name in said or module.rpartition(".")[2] in said, f"{test} does not name {name}"


@pytest.mark.slow
def test_the_figures_of_the_verification_page_still_come_out():
    """Would catch a published figure that no longer comes out, in every digit shown."""
    from hdopt.studies.verification import comparisons, renewed

    page = (DOCS / "verification.md").read_text(encoding="utf-8")
    assert renewed(page) == page, "renew with: python -m hdopt.studies.verification docs/verification.md"
    assert len(comparisons()) >= 30


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md"], ids=lambda page: page.name)
def test_links_between_pages_lead_somewhere(page):
    for link in re.findall(r"\]\(([^)#:\s]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if not link.startswith(("generated/", "examples/")):
            assert (page.parent / link).exists(), link


GALLERY = [path for path in DOCS.glob("gallery/*") if path.suffix in (".py", ".rst", ".txt", ".md")]
"""Without the tables that its examples write when the site is made."""
SOURCES = [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CITATION.cff", *GALLERY]


@pytest.mark.parametrize("page", SOURCES, ids=lambda page: page.name)
def test_links_to_elsewhere_are_well_formed(page):
    """Would catch a link with a bracket or a full stop in it, to this machine, or unencrypted: no network is asked."""
    for link in re.findall(r"\bhttps?:[^\s<>\"'`]*", page.read_text(encoding="utf-8")):
        link = link.rstrip(").,;") if link.count(")") > link.count("(") else link
        parts = urlsplit(link)
        assert parts.scheme == "https" and re.fullmatch(r"([a-z0-9-]+\.)+[a-z]{2,}", parts.netloc), link
        assert not re.search(r"[.,;:]$|//|[()\[\]]", parts.path), link


def test_the_citation_is_of_this_version():
    import hdopt

    text = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"\nversion: {hdopt.__version__}\n" in text
    assert f"## {hdopt.__version__}\n" in (DOCS / "changelog.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_is_what_the_page_says(shell, tmp_path):
    text = (DOCS / "how-to.md").read_text(encoding="utf-8")
    assert f"_HDOPT_COMPLETE={shell}_source" in text
    script = "from hdopt.cli import main; main()"
    env = {**os.environ, "_HDOPT_COMPLETE": f"{shell}_source"}
    made = subprocess.run([sys.executable, "-c", script], env=env, capture_output=True, text=True, timeout=60)
    assert made.returncode == 0 and "hdopt" in made.stdout and not made.stderr


def study_examples() -> dict[str, str]:
    """How the page on the study file writes each table."""
    return runpy.run_path(str(DOCS / "study_examples.py"))["EXAMPLES"]


WITHOUT_EXAMPLE = ("drive", "cs_teeth", "fs_teeth", "cs_roundness", "tolerances.cs_teeth", "contributors.NAME",
                   "linear_stack.dimensions.NAME", 'model = "table".grades')  # fmt: skip
"""Tables that a shipped study shows, or whose example stands one table above."""


def test_every_table_of_a_study_has_an_example_that_loads(tmp_path):
    """Would catch a kind of distribution or cost that was added without a word on how it is written."""
    import hdopt
    from hdopt.workflow.study_reference import study_reference

    examples = study_examples()
    tables = {table.name for tables in study_reference().values() for table in tables}
    of_bounds = {name for name in tables if name.startswith("search.variables.")}
    assert tables - examples.keys() - of_bounds <= set(WITHOUT_EXAMPLE)
    (tmp_path / "eccentricities.csv").write_text("0.001\n0.004\n0.006\n0.003\n")
    for name, text in examples.items():
        file = tmp_path / "own.toml"
        file.write_text(f'drive = "csf-25-80"\n{text}\n')
        study = hdopt.load_study(file)
        assert study.drive, name
        if "tolerances" in text and "correlation" not in name:
            assert study.sections["tolerances"].distributions(tmp_path), name
            assert [cost.build((0.396, 63.36)) for cost in study.sections["tolerances"].costs().values()] or (
                "cost" not in text
            )


def test_ratios_of_benchmarks_are_for_one_drive_and_of_the_shortest_time():
    """Would catch a mean in place of the shortest time, a ratio turned round, and drives that are not counted."""
    from tests.benchmarks.ratios import END, START, renewed

    def one(name, least, **extra):
        return {"name": name, "stats": {"min": least, "mean": 9 * least}, "extra_info": extra}

    slow = one("test_walk_of_80_turns_in_numpy", 0.3, drives=1)
    run = {"benchmarks": [slow, one("test_kernel[1]", 0.6, drives=1_000_000)]}
    page = renewed(f"before {START}\nold\n{END} after", run)
    assert "over the compiled kernel | 5e5 |" in page and "old" not in page
    assert page.startswith("before ") and page.endswith(" after")


MADE_UP = ("studies/NAME.toml", "docs/gallery/example_NN_name.py", "tests/mutants/asked.json")
"""Files on the pages that stand for others, or that a run leaves."""


def options_of(command: str) -> set[str]:
    params = import_module(f"hdopt.cli.{command}").command.params
    return {option for param in params for option in (*param.opts, *param.secondary_opts)} | {"--help"}


def codes(text: str) -> list[str]:
    """What stands on a page as code: in backticks, in fences, and indented."""
    fenced = [line for block in re.findall(r"```\w*\n(.*?)```", text, re.S) for line in block.split("\n")]
    inline = re.findall(r"`([^`\n]+(?:\n[^`\n]+)?)`", re.sub(r"```.*?```", "", text, flags=re.S))
    return [code.replace("\n", " ") for code in (*inline, *fenced, *re.findall(r"^    (\S.+)$", text, re.M))]


@pytest.mark.parametrize("page", [*PAGES, ROOT / "README.md", ROOT / "CONTRIBUTING.md"], ids=lambda page: page.name)
def test_every_option_and_file_that_a_page_names_exists(page):
    """Would catch an option that was renamed, one of another command, and a file that moved."""
    every = {option for command in COMMANDS for option in options_of(command)}
    rooms = (ROOT, DOCS, ROOT / "hdopt", ROOT / "hdopt" / "diagnosis", ROOT / "hdopt" / "report")
    for code in codes(page.read_text(encoding="utf-8")):
        for command, rest in re.findall(r"(?:^|[\s$/])hdopt ([a-z]+)\b([^|;]*)", code):
            assert command in COMMANDS, code
            assert set(re.findall(r"(?<![\w-])--[a-z0-9][\w-]*", rest)) <= options_of(command), code
        assert set(re.findall(r"^--[a-z0-9][\w-]*", code)) <= every, code
        for file in re.findall(r"(?<![\w/.~])((?:[\w-]+/)+[\w-]+\.(?:py|toml|md|js|json|csv|ipynb))\b", code):
            assert file in MADE_UP or any((room / file).exists() for room in rooms), file


def test_no_target_of_make_is_taken_for_a_folder_of_its_name():
    """`make docs` is made each time, though `docs` exists."""
    said = (ROOT / "Makefile").read_text(encoding="utf-8")
    (phony,) = re.findall(r"^\.PHONY: (.+)$", said, re.M)
    named = [name for name in re.findall(r"^([a-z]+):", said, re.M) if (ROOT / name).exists()]
    assert "docs" in named
    assert set(named) <= set(phony.split())
