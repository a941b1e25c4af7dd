"""Put hand-made faults in one at a time and see whether the tests notice: `python -m tests.mutants.faults [ROOM...]`.

Each fault in `hand_made/ROOM.toml` is one that a reviewer who knows the physics would look for: a term dropped, a sign
turned, rows leaked. The tests that should notice it are those of its room, or those that it names, one file after the
other, that which noticed it last before the others; golden answers do not count. Outcomes are kept in `asked.json`.
Asked is what never was, what no test noticed, and what was noticed before its file or that test changed. What is known
of a room is written to docs/mutants.md. Two processes at once want a `--folder` each.
"""

from __future__ import annotations

import argparse
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from tests.mutants.hand_made import ROOT, Fault, faults_of, rooms
from tests.mutants.ledger import asked, digest_of, is_known, keep
from tests.mutants.trial import load_libraries, refreshed_tree, tried

PAGE = ROOT / "docs" / "mutants.md"


def section(room: str, faults: Sequence[Fault], found: dict[str, list[str]]) -> str:
    """The part of the page about one `room`: counts, survivors, and what cannot be seen, with its reason."""
    counted = [fault for fault in faults if not fault.equivalent]
    said = {fault: found.get(fault.key, ["not asked"])[0] for fault in counted}
    killed, survived, late, left = (
        list(said.values()).count(word) for word in ("killed", "survived", "timeout", "not asked")
    )
    share = killed / max(killed + survived, 1)
    counts = f"{killed} of {killed + survived} noticed ({share:.0%}); {late} ran out of time, {left} not asked yet."
    lines = [f"## {room}", "", counts, ""]
    lines += [f"- {word}: {one.name} (`{one.file}`)" for one, word in said.items() if word != "killed"]
    lines += [f"- nothing to see: {fault.name}: {fault.equivalent}" for fault in faults if fault.equivalent]
    return "\n".join(lines).rstrip() + "\n"


def with_sections(page: str, written: dict[str, str]) -> str:
    """`page` with the sections of the rooms `written`, each in place of its old one, in the order of the alphabet."""
    head, *old = re.split(r"(?m)^(?=## )", page)
    by_room = {one.split("\n", 1)[0].removeprefix("## ").strip(): one for one in old} | written
    return "\n".join([head.rstrip() + "\n", *(by_room[room].rstrip() + "\n" for room in sorted(by_room))])


def summary(faults: list[Fault], found: dict[str, list[str]]) -> str:
    """How many of all `faults` have been asked, what came, and how many answers still hold; `found` as kept."""
    faults = [one for one in faults if not one.equivalent]
    said = [found[one.key][0] for one in faults if one.key in found]
    missed, left = len(said) - said.count("killed"), len(faults) - len(said)
    noticed = "all of them are noticed" if not missed else f"all but {missed} are noticed"
    standing = sum(is_known(one, found) for one in faults)
    return (
        f"Of {len(faults)} faults on the lists {len(said)} have been asked: {noticed}; {left} are not asked yet.\n"
        f"{standing} of the answers rest on texts that stand as they stood; the other files or tests have changed.\n"
    )


def with_summary(page: str, text: str) -> str:
    """`page` with `text` in place of the paragraph that says how many were asked."""
    return re.sub(r"(?m)^Of \d+ faults on the lists (?:.+\n)+", text, page)


def _killer_first(fault: Fault, found: dict[str, list[str]]) -> Fault:
    """`fault` with the test file first that noticed it when it was last asked."""
    by = found.get(fault.key, ["", "", ""])[2]
    return replace(fault, tests=tuple(sorted(fault.tests, key=lambda name: name != by)))


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.mutants.faults", description=__doc__)
    parser.add_argument("rooms", nargs="*", metavar="ROOM", help=f"of {', '.join(rooms())}; all where omitted")
    parser.add_argument("--only", default="", help="only faults whose name holds this text")
    parser.add_argument("--file", default="", help="only faults in files whose path holds this text")
    parser.add_argument("--tests", default="", help="only faults whose first test file matches this pattern")
    parser.add_argument("--afresh", action="store_true", help="ask again for those that were noticed too")
    parser.add_argument("--new", action="store_true", help="ask only for those that never were asked for")
    parser.add_argument("--folder", type=Path, default=ROOT / "build" / "mutants", help="what was run is kept here")
    options = parser.parse_args()
    folder = options.folder.resolve()
    load_libraries()
    tree, found = refreshed_tree(folder), asked()
    listed = {room: faults_of(room) for room in options.rooms or rooms()}
    pending = [
        _killer_first(fault, found)
        for faults in listed.values()
        for fault in faults
        if not fault.equivalent
        and options.only in fault.name
        and options.file in fault.file
        and re.search(options.tests, fault.tests[0])
        and (options.afresh or not is_known(fault, found))
        and not (options.new and fault.key in found)
    ]
    if gone := [fault for fault in pending if (ROOT / fault.file).read_text(encoding="utf-8").count(fault.old) != 1]:
        raise SystemExit("the old text does not stand there once: " + ", ".join(f"{x.room}: {x.name}" for x in gone))
    stands = {(fault, by): digest_of(fault, (by,) if by else ()) for fault in pending for by in ("", *fault.tests)}
    for number, (fault, said, by) in enumerate(tried(pending, tree, folder), start=1):
        keep(fault, [said, stands[fault, by], by])
        print(f"{number}/{len(pending)} {said}: {fault.room}: {fault.name}", flush=True)
    found = asked()
    written = {
        room: section(room, faults, found)
        for room, faults in listed.items()
        if any(fault.key in found for fault in faults)
    }
    print("\n".join(written.values()))
    if PAGE.exists():
        page = with_sections(PAGE.read_text(encoding="utf-8"), written)
        every = [fault for room in rooms() for fault in faults_of(room)]
        PAGE.write_text(with_summary(page, summary(every, found)), encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
