"""The commands. Each lives in a module of its own that is imported only when the command is used."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, wraps
from importlib import import_module
from typing import TypeVar

import click

R = TypeVar("R")

COMMANDS: dict[str, str] = {
    "new": "A commented study to begin with.",
    "check": "What can be computed from a study, and what is missing for the rest.",
    "ke": "Kinematic error of one drive: peak-to-peak, orders, contact, lag.",
    "profile": "The wave generator's profile: contact angle, curvature change, bending stress.",
    "stack": "Monte Carlo stack of the tolerances: distribution, yield, Ppk; tails and worst case on request.",
    "sobol": "Which tolerances matter: Sobol' indices with intervals, Shapley effects where inputs are correlated.",
    "allocate": "Least-cost tolerances that keep the requirement, verified.",
    "inspect": "The acceptance sheet of a drive from its recordings: figures, checks, limits, Ppk.",
    "compensate": "What a controller can subtract: a table or harmonics of both angles, checked on held-out parts.",
    "diagnose": "What physics recordings of a drive hold that the model leaves out.",
    "search": "Which design: the best under limits, fronts, and what the choice costs.",
    "export": "The wave generator as checked STEP, DXF, STL, 3MF, drawing and picture.",
    "compare": "A measured cam against the one that a study designs.",
    "explore": "A page with the drive under sliders: waveform, beat, orders, peak-to-peak, tolerance cloud.",
    "run": "Everything a study file asks for, with report.html.",
    "studies": "The shipped studies, a line each.",
}
"""Command -> its line in `hdopt --help`; the command is `command` in `hdopt.cli.<name>`."""


class LazyGroup(click.Group):
    """A group that knows its commands' names and help lines without importing them."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        return _command(name) if name in COMMANDS else None

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            from hdopt.errors import unknown_name

            raise click.UsageError(unknown_name("command", args[0], COMMANDS))
        return super().resolve_command(ctx, args)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@cache
def _command(name: str) -> click.Command:
    command: click.Command = import_module(f"hdopt.cli.{name}").command
    if command.callback is not None:
        command.callback = _placing(command.callback)
    return command


def _placing(work: Callable[..., R]) -> Callable[..., R]:
    """`work` of a command, whose refusals name the options or the files that they speak of."""

    @wraps(work)
    def placing(*arguments: object, **options: object) -> R:
        from hdopt.errors import EngineFailed, HdoptError, MissingLibrary, NoResult

        try:
            return work(*arguments, **options)
        except EngineFailed as error:
            error.args = (f"--engine: {error}", *error.args[1:])
            raise
        except HdoptError as error:
            if not isinstance(error, NoResult | MissingLibrary):
                from hdopt.cli.place import placed
                from hdopt.files import FilesOfWork, files_of_work

                context = click.get_current_context()
                error.args = (placed(str(error), context, files_of_work() or FilesOfWork()), *error.args[1:])
            raise

    return placing


@click.group(cls=LazyGroup, context_settings={"help_option_names": ["-h", "--help"]})
@click.version_option(package_name="hdopt")
def cli() -> None:
    """Design optimization and tolerancing for harmonic drives (strain wave gears).

    Exit status: 0 done, 1 the answer is "no", 2 unusable input.
    """
