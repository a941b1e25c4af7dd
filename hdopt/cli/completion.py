"""What the shell offers after an option: the names that it takes, looked up only when the Tab key asks."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import click
from click.shell_completion import CompletionItem

Offer = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def offered(names: Callable[[], Iterable[str]], files: bool = False) -> Offer:
    """What completes an option that takes one of `names()`; where none of them fits, with `files`, a file."""

    def offer(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        found = [CompletionItem(name) for name in names() if name.startswith(incomplete)]
        return found or (a_file(context, parameter, incomplete) if files else [])

    return offer


def several(names: Callable[[], Iterable[str]]) -> Offer:
    """What completes an option that takes some of `names()` between commas."""

    def offer(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
        before, comma, last = incomplete.rpartition(",")
        return [CompletionItem(f"{before}{comma}{name}") for name in names() if name.startswith(last)]

    return offer


def a_file(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The files of the disk."""
    return [CompletionItem(incomplete, type="file")]


def a_folder(context: click.Context, parameter: click.Parameter, incomplete: str) -> list[CompletionItem]:
    """The folders of the disk."""
    return [CompletionItem(incomplete, type="dir")]


def drives() -> tuple[str, ...]:
    """The shipped drives."""
    from hdopt.study import shipped_drives

    return tuple(shipped_drives())


def studies() -> tuple[str, ...]:
    """The shipped studies."""
    from hdopt.study import shipped_studies

    return tuple(shipped_studies())


def recorded() -> tuple[str, ...]:
    """What a recording may be said to be of."""
    return (*studies_and_drives(), "none")


def studies_and_drives() -> tuple[str, ...]:
    """The shipped studies and drives."""
    return tuple(dict.fromkeys((*studies(), *drives())))


def structures() -> tuple[str, ...]:
    """How the wave generator may be joined to its shaft."""
    from hdopt.drive.geometry import Structure

    return tuple(structure.value for structure in Structure)


def profiles() -> tuple[str, ...]:
    """The wave generator's profiles."""
    from hdopt.drive.profiles import PROFILES

    return tuple(PROFILES)


def geometries() -> tuple[str, ...]:
    """The geometries of one drive, as a shell takes them."""
    from hdopt.kinematics.waveform import GEOMETRIES

    return tuple(map(_hyphened, GEOMETRIES))


def stack_geometries() -> tuple[str, ...]:
    """The geometries of sampled drives, as a shell takes them."""
    from hdopt.workflow.stack import STACK_GEOMETRIES

    return tuple(map(_hyphened, STACK_GEOMETRIES))


def samplings() -> tuple[str, ...]:
    """How drives may be sampled."""
    from hdopt.tolerance.sampling import SAMPLINGS

    return tuple(SAMPLINGS)


def rules() -> tuple[str, ...]:
    """The rules of an allocation."""
    from hdopt.workflow.allocate import RULES

    return RULES


def sensitivity_methods() -> tuple[str, ...]:
    """The analyses of sensitivity."""
    from hdopt.tolerance.screening import METHODS

    return ("sobol", *METHODS)


def nuisances() -> tuple[str, ...]:
    """What a diagnosis may fit beside every model."""
    from hdopt.diagnosis.inference.nuisance import NUISANCES

    return tuple(NUISANCES)


def engines() -> tuple[str, ...]:
    """What may do the work."""
    from hdopt.parallel.engine import ENGINES

    return tuple(name for name in ENGINES if "://" not in name)


def _hyphened(name: str) -> str:
    return name.replace(" ", "-")


def unhyphened(context: click.Context, parameter: click.Parameter, name: str) -> str:
    """A geometry as the rest of the program names it: "closed form" for closed-form, which needs no quotes."""
    return "closed form" if name == "closed-form" else name
