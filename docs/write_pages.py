"""Pages of the site that derive from the program: the study file from its schema, the options from the commands, the
API from what is public. Written anew at every build, so that none can lag."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path

from study_examples import EXAMPLES

ROOMS = {
    "Drive": ("hdopt.drive.geometry", "hdopt.drive.errors", "hdopt.drive.profiles", "hdopt.drive.teeth"),
    "Kinematics": (
        "hdopt.kinematics.exact",
        "hdopt.kinematics.closed_form",
        "hdopt.kinematics.waveform",
        "hdopt.kinematics.extremes",
        "hdopt.kinematics.peak_to_peak",
        "hdopt.kinematics.gradients",
        "hdopt.kinematics.load_sharing",
    ),
    "Mechanics": (
        "hdopt.mechanics.contact",
        "hdopt.mechanics.contact_model",
        "hdopt.mechanics.bending",
        "hdopt.mechanics.lag",
        "hdopt.mechanics.tooth_path",
        "hdopt.mechanics.bearing_life",
    ),
    "Tolerances": (
        "hdopt.tolerance.distributions",
        "hdopt.tolerance.space",
        "hdopt.tolerance.stack",
        "hdopt.tolerance.tail",
        "hdopt.tolerance.worst_case",
        "hdopt.tolerance.sensitivity",
        "hdopt.tolerance.contributors",
        "hdopt.tolerance.capability",
    ),
    "Allocation": ("hdopt.allocation.cost", "hdopt.allocation.grades", "hdopt.allocation.results"),
    "Simulation": ("hdopt.simulation.model", "hdopt.simulation.operation", "hdopt.simulation.effect_values"),
    "Recordings": ("hdopt.recordings.recording", "hdopt.recordings.read", "hdopt.recordings.sheet"),
}
"""Heading -> the modules whose public functions and classes stand under it."""


def write_pages(folder: Path) -> None:
    """Write every derived page into `folder`; a page that did not change keeps its time."""
    folder.mkdir(exist_ok=True)
    pages = {"study-file.md": study_file(), **commands(), "api.rst": api()}
    for name, text in pages.items():
        path = folder / name
        path.parent.mkdir(exist_ok=True)
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def study_file() -> str:
    """The page on the study file, section by section, from the schema."""
    from hdopt.workflow.study_reference import study_reference

    lines = [
        "# The study file, section by section",
        "",
        "A study is one TOML file. This page is written from the schema that checks it. `hdopt new NAME` writes a file",
        "with all of these keys, `hdopt check FILE` says what can be computed from one. A key without a default may be",
        "left out unless it is marked as required; what needs it then says so.",
        "",
    ]
    told = set()
    for name, tables in study_reference().items():
        lines += [f"## [{name}]", ""]
        for place, table in enumerate(tables):
            if place and table.keys in told:
                continue
            told.add(table.keys)
            if place:
                lines += [f"### `{table.name}`" if "=" in table.name else f"### [{table.name}]", ""]
            lines += [_sentence(table.says), ""]
            if table.name in EXAMPLES:
                lines += ["```toml", EXAMPLES[table.name], "```", ""]
            lines += _key_table(table.keys)
    lines += ["## [effects.ID]", "", "What the base model leaves out, a table for each effect:"]
    lines += ["[the effects and their keys](../conventions.md#effects-in-a-study-file).", ""]
    return "\n".join(lines)


def _sentence(says: str) -> str:
    text = re.sub(r"^`?\[[\w.]+\]`?( and \[\w+\])?:? ?", "", says)
    return _safe(text[:1].upper() + text[1:])


def _key_table(keys) -> list[str]:
    if not keys:
        return []
    rows = ["| key | what may stand there | unit | if left out | meaning |", "|---|---|---|---|---|"]
    for key in keys:
        default = "**required**" if key.required else f"`{key.default}`" if key.default else ""
        rows.append(f"| `{key.key}` | {_safe(key.allowed)} | {key.unit} | {default} | {_safe(key.meaning)} |")
    return [*rows, ""]


def _safe(text: str) -> str:
    """Text for a Markdown cell: brackets and bars that are no markup."""
    return (
        text.replace("|", "\\|").replace("[", "\\[").replace("]", "\\]").replace("_", "\\_")
        if "`" not in text
        else (text.replace("|", "\\|").replace("[", "\\[").replace("]", "\\]"))
    )


def commands() -> dict[str, str]:
    """A page for each command, from how-to.md, python.md and the command line itself, and the page that lists them."""
    from hdopt.cli.app import COMMANDS

    lines = ["# A page for each command", "", "How to, options, exit status and the same from Python.", ""]
    lines += ["```{toctree}", ":maxdepth: 1", "", *(f"commands/{name}" for name in COMMANDS), "```", ""]
    return {"commands.md": "\n".join(lines)} | {f"commands/{name}.md": command_page(name) for name in COMMANDS}


def command_page(name: str) -> str:
    """The page of the command `name`."""
    import click

    from hdopt.cli.app import COMMANDS

    command = import_module(f"hdopt.cli.{name}").command
    usage = command.collect_usage_pieces(click.Context(command))
    lines = [f"# hdopt {name}", "", f"{COMMANDS[name]}", "", _how_to(name), ""]
    lines += ["## Options", "", "```text", f"hdopt {name} {' '.join(usage)}", "```", ""]
    lines += ["| option | what it does | if left out |", "|---|---|---|"]
    for param in command.params:
        if isinstance(param, click.Option):
            names = ", ".join(f"`{part}`" for part in (*param.opts, *param.secondary_opts))
            metavar = "" if param.is_flag else f" {_safe(param.metavar or param.type.name.upper())}"
            default = "" if param.is_flag or param.default in (None, (), "") else f"`{param.default}`"
            default = default if param.show_default else ""
            lines.append(f"| {names}{metavar} | {_safe(param.help or '')} | {default} |")
    lines += ["", "## Exit status", ""]
    lines += ["0: done. 1: the answer is no. 2: unusable input, with one message that says what to do.", ""]
    lines += ["## From Python", "", f"{_call(name)} More: [from Python](../../python.md).", ""]
    return "\n".join(lines)


HERE = Path(__file__).parent


def _how_to(name: str) -> str:
    """The paragraph of a command in how-to.md, its links as they are from two folders further down."""
    text = (HERE / "how-to.md").read_text(encoding="utf-8")
    paragraph = text.partition(f"\n## hdopt {name}\n")[2].partition("\n## ")[0].strip()
    paragraph = paragraph.replace("](generated/", "](../")
    return re.sub(r"\]\((?!\.\./)([\w/-]+\.md|examples/index)", r"](../../\1", paragraph)


def _call(name: str) -> str:
    """The row of a command in the table of python.md, as a sentence."""
    text = (HERE / "python.md").read_text(encoding="utf-8")
    row = next(line for line in text.splitlines() if line.startswith(f"| `{name}` |"))
    _, _, call, gives, _ = (part.strip() for part in row.split("|"))
    return f"{call} gives {gives}."


def api() -> str:
    """What `import hdopt` offers, and the rooms' modules."""
    import inspect

    import hdopt

    lines = ["API reference", "=============", ""]
    lines += ["What ``import hdopt`` offers", "-" * 30, ""]
    for name in sorted(hdopt.__all__, key=str.lower):
        kind = "autoclass" if inspect.isclass(getattr(hdopt, name)) else "autofunction"
        lines += [f".. {kind}:: hdopt.{name}", ""]
        if kind == "autoclass":
            lines[-1:] = ["   :members:", ""]
    for room, modules in ROOMS.items():
        lines += [room, "-" * len(room), ""]
        for module in modules:
            lines += [module, "~" * len(module), "", f".. automodule:: {module}", "   :members:", ""]
    return "\n".join(lines)
