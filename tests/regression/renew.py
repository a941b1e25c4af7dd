"""Renew the golden answers: `python -m tests.regression.renew [commands] [cases] [--only PATTERN]`, both groups where
none is given, those whose names match PATTERN ("stack *").

Says which answers moved and by what. Numbers that moved by less than they are compared to stay as they were.
"""

from __future__ import annotations

import argparse
from fnmatch import fnmatch

from tests.regression import cases, commands
from tests.regression.golden import differences, store, stored


def _renewed(group, names, only, answer, relative):
    try:
        old = stored(group)
    except FileNotFoundError:
        old = {}
    new = {}
    for name in names:
        if not fnmatch(name, only):
            new |= {name: old[name]} if name in old else {}
            continue
        now = answer(name)
        moved = differences(old[name], now, relative(name)) if name in old else ["new"]
        new[name] = now if moved else old[name]
        for line in moved:
            print(f"{group}: {name}: {line}", flush=True)
    store(group, new)


def main(arguments=None):
    parser = argparse.ArgumentParser(prog="python -m tests.regression.renew", description=__doc__)
    parser.add_argument("groups", nargs="*", help="commands, cases")
    parser.add_argument("--only", default="*", metavar="PATTERN")
    options = parser.parse_args(arguments)
    groups = options.groups or ("commands", "cases")
    if "commands" in groups:
        known = {command.name: command for command in commands.COMMANDS}
        _renewed(
            "commands",
            known,
            options.only,
            lambda name: commands.answer(known[name]),
            lambda name: known[name].relative,
        )
    if "cases" in groups:
        _renewed("cases", cases.SPECS, options.only, cases.answer, lambda name: cases.FITTED)


if __name__ == "__main__":
    main()
