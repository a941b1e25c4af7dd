"""The command lines whose answers are kept: every command on every shipped study, with settings that take seconds."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path

from tests.regression.golden import compact, hdopt

# The closed form and its sums: rounding may change with the order of summation, by parts in 1e12.
EXACT = 1e-9
# Peak-to-peaks of many drives are in single precision: another processor type rounds them by a few parts in 1e7.
SINGLE = 1e-6
# An optimiser stops where the objective no longer changes by 1e-9, so about 1e-4.5 away along a flat direction: another
# order of summation moved an allocated tolerance by 1e-5.
SEARCHED = 1e-4

CSF = ("csf-25-80", "csf-25-80-tolerances", "csf-25-80-design-trade", "paper-reproduction", "concealed-physics")
FAST_STACK = ("-n", "4096")
FAST_ALLOCATION = ("--no-compare", "--set", "allocate.curve=[]")

SMALL_SEARCH = (
    *("--set", "search.robust=false"),
    *("--set", 'search.profiles=["ellipse"]'),
    *("--set", 'search.structures=["integral"]'),
)


@dataclass(frozen=True)
class Command:
    """A command line, how closely its numbers must come again, and whether `make check` runs it."""

    arguments: tuple[str, ...]
    relative: float = EXACT
    slow: bool = False

    @property
    def name(self) -> str:
        return " ".join(self.arguments)


COMMANDS = (
    *(Command(("ke", study)) for study in CSF),
    Command(("ke", "csf-25-80", "--sampling-deg", "10", "--turns", "80")),
    *(Command(("ke", "--structure", s)) for s in ("automatic", "one_way_major", "one_way_minor")),
    Command(("ke", "--set", "homogenization=contact")),
    Command(("ke", "chase-shaft-housing")),
    *(Command(("profile", study)) for study in CSF),
    *(Command(("profile", "--profile", p)) for p in ("resal", "two_disk", "ellipse")),
    Command(("stack", "csf-25-80", *FAST_STACK), SINGLE),
    Command(("stack", "csf-25-80", "-n", "2048", "--sampling", "monte-carlo"), SINGLE),
    Command(("stack", "csf-25-80", "-n", "2048", "--worst-case"), SEARCHED),
    Command(("stack", "csf-25-80", "-n", "2048", "--tail", "1.2"), SINGLE, slow=True),
    Command(("stack", "csf-25-80-tolerances", "-n", "2048", "--quantile", "0.95"), SINGLE),
    Command(("stack", "chase-shaft-housing", *FAST_STACK, "--worst-case"), SEARCHED),
    Command(("stack", "paper-reproduction", "-n", "2048"), SINGLE),
    Command(("sobol", "csf-25-80", "-n", "256"), SINGLE),
    Command(("sobol", "csf-25-80", "-n", "256", "--no-second-order", "--shapley", "groups"), SINGLE, slow=True),
    Command(("sobol", "chase-shaft-housing", "-n", "512")),
    *(Command(("allocate", "chase-shaft-housing", "--rule", r), SEARCHED) for r in ("worst_case", "rss")),
    Command(("allocate", "csf-25-80-tolerances", "--rule", "rss", *FAST_ALLOCATION), SEARCHED, slow=True),
    Command(
        ("search", "csf-25-80-design-trade", "--no-fronts", *SMALL_SEARCH),
        SEARCHED,
        slow=True,
    ),
    Command(("search", "csf-25-80", "--no-fronts"), SEARCHED, slow=True),
    *(Command(("export", study)) for study in ("csf-25-80", "csf-25-80-tolerances")),
    Command(("export", "csf-25-80", "--set", "wave_generator.profile=resal")),
    Command(("run", "chase-shaft-housing"), SEARCHED, slow=True),
    Command(("run", "paper-reproduction"), SINGLE, slow=True),
    Command(("run", "csf-25-80"), SINGLE, slow=True),
)


def answer(command: Command) -> dict:
    """Exit status and JSON of a command line, as kept."""
    if command.arguments[0] != "run":
        status, result = hdopt(*command.arguments)
    else:
        with tempfile.TemporaryDirectory() as folder:
            status, result = hdopt(*command.arguments, "-o", str(Path(folder) / "out"))
    return {"status": status, "json": compact(result)}
