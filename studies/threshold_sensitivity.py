"""How far the diagnosis' answers move when one of its thresholds moves by 30 %.

    python -m hdopt.studies.threshold_sensitivity --out build/thresholds --write docs/diagnosis-thresholds.md

answers short cases of the bench as shipped and once for every move, first whole groups of thresholds, then each of a
group that changed an answer. The thresholds of the verdict are moved one by one, on what the other stages had found.
Every answer is kept in the folder as soon as it is given, so that the command goes on where it was stopped;
`--minutes` stops it in time, and the table says what had been tried by then.
"""

from __future__ import annotations

import argparse
import io
import json
import pickle
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, fields
from datetime import date
from pathlib import Path
from typing import Any

from hdopt.bench.cases import CATALOGUE, Spec, simulate
from hdopt.bench.hidden_outside import KINDS
from hdopt.diagnosis import diagnose
from hdopt.diagnosis.settings import DEFAULT, DiagnosisSettings, Threshold, moved, thresholds
from hdopt.diagnosis.verdict.diagnosis import Diagnosis
from hdopt.diagnosis.verdict.draw import draw_verdict
from hdopt.files import write_bytes, write_text
from hdopt.recordings.read import recording_from_table
from hdopt.study import load_study

FACTORS = (0.7, 1.3)
REPLAYED = "verdict"
"""The group that is moved on kept evidence: nothing before the verdict looks at it, save one test of confounding."""
DRAWS = 100
"""Seeds tried until the physics can be so large in a short record."""

HEADER = """\
# Thresholds of the diagnosis

Every number that decides, as it stands in `hdopt/diagnosis/settings.py`: value, unit, where it comes from, and how many
answers change when it becomes 0.7 or 1.3 times as large (whole numbers move by one at least). Written by

    python -m hdopt.studies.threshold_sensitivity --out build/thresholds --write docs/diagnosis-thresholds.md

"""
TRIED = """\
The {cases} cases are one short recording of every effect of the catalogue at half of the drive's own error, one of each
of {outside} kinds of physics outside it, and the rest with nothing hidden; {right} of the {cases} are answered rightly
as shipped.

Thresholds of the verdict are moved one by one, on what the other stages had found. The others are moved as groups
first: in a group that changes no answer each stands with 0, though moves within it may make up for each other;
"group: n" says that the group changes n answers and that its members were not moved singly yet. The last of these
answers was given on {last}, by the program of that day.
"""
NOT_TRIED = """\
The moves have not been tried on these settings yet.
"""

Answer = tuple[str, tuple[str, ...]]
"""Verdict and the effects named, in the order of the alphabet."""


@dataclass(frozen=True)
class Case:
    """A case of the bench: its `name`, what it is made from, and its true `answers`."""

    name: str
    spec: Spec
    answers: tuple[Answer, ...]


def cases(nothing: int = 4, severity: float = 0.5) -> tuple[Case, ...]:
    """One short case of every effect, at `severity` times the drive's own error, one of every kind of physics outside
    the catalogue at the same, and as many as `nothing` says with nothing hidden.
    """
    made = [
        Case(f"nothing {i}", Spec("nothing", i, size="brief"), (("adequate", ()), ("insufficient", ())))
        for i in range(nothing)
    ]
    for effect in CATALOGUE:
        made.append(Case(effect, _possible("single", (effect,), severity, ""), (("named", (effect,)),)))
    for kind in KINDS:
        made.append(Case(kind, _possible("unknown", (), severity, kind), (("unknown", ()),)))
    return tuple(made)


def _possible(family: str, effects: tuple[str, ...], severity: float, outside: str) -> Spec:
    for seed in range(DRAWS):
        spec = Spec(family, seed, effects, severity, outside, size="brief")
        if simulate(spec) is not None:
            return spec
    raise ValueError(f"{effects or outside}: no short record of {DRAWS} can hold {severity} times the drive's error")


def answer_of(diagnosis: Diagnosis) -> Answer:
    """What of a `diagnosis` counts as its answer."""
    return diagnosis.verdict, tuple(sorted(found.id for found in diagnosis.effects))


def diagnosed(case: Case, settings: DiagnosisSettings) -> Diagnosis:
    """The diagnosis of `case` under `settings`."""
    drive = load_study(drive="csf-25-80").drive
    drawn = simulate(case.spec)
    assert drawn is not None  # `cases` chose seeds that can be drawn
    records = [recording_from_table(table, drive.geometry.ratio) for table in drawn.tables]
    return diagnose(records, drive, settings=settings)


class _Keeper(pickle.Pickler):
    """Pickles evidence with a hole where the settings were."""

    def persistent_id(self, obj: object) -> str | None:
        return "settings" if isinstance(obj, DiagnosisSettings) else None


class _Filler(pickle.Unpickler):
    """Fills the hole with other settings."""

    def __init__(self, kept: bytes, settings: DiagnosisSettings) -> None:
        super().__init__(io.BytesIO(kept))
        self.settings = settings

    def persistent_load(self, pid: Any) -> DiagnosisSettings:  # Any: as `pickle` has it
        return self.settings


def kept(diagnosis: Diagnosis) -> bytes:
    """The evidence of `diagnosis`, its settings left out."""
    buffer = io.BytesIO()
    _Keeper(buffer, pickle.HIGHEST_PROTOCOL).dump(diagnosis.evidence)
    return buffer.getvalue()


def redrawn(evidence: bytes, settings: DiagnosisSettings) -> Answer:
    """The answer that the verdict's rules draw under `settings` from kept `evidence`."""
    return answer_of(draw_verdict(_Filler(evidence, settings).load(), ()))


@dataclass(frozen=True)
class Move:
    """A threshold ("group.name") or a whole group ("group"), `key`, times `factor`."""

    key: str
    factor: float

    @property
    def settings(self) -> DiagnosisSettings:
        """The settings after the move."""
        return moved(DEFAULT, self.key, self.factor)


class Answers:
    """The answers given so far, kept in a `folder`, one file a case and move."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def _file(self, case: Case, move: Move | None) -> Path:
        name = "as shipped" if move is None else f"{move.key} x {move.factor:g}"
        return self.folder / f"{case.name} - {name}.json"

    def get(self, case: Case, move: Move | None) -> Answer | None:
        """The answer to `case` after `move` (None: as shipped), if it was given."""
        file = self._file(case, move)
        if not file.exists():
            return None
        verdict, effects = json.loads(file.read_text(encoding="utf-8"))
        return verdict, tuple(effects)

    def put(self, case: Case, move: Move | None, answer: Answer) -> None:
        """Keep the `answer` to `case` after `move` (None: as shipped)."""
        write_text(self._file(case, move), json.dumps(answer))

    @property
    def last(self) -> date:
        """The day of the last answer, today where none was given."""
        days = [date.fromtimestamp(file.stat().st_mtime) for file in self.folder.glob("*.json")]
        return max(days, default=date.today())

    def evidence(self, case: Case) -> Path:
        """Where the evidence of `case` is kept."""
        return self.folder / f"{case.name}.evidence"

    def answered(self, case: Case, move: Move | None = None) -> Answer:
        """The answer to `case` after `move`: the one kept, or a new one."""
        known = self.get(case, move)
        if known is not None:
            return known
        if move is not None and move.key.startswith(f"{REPLAYED}."):
            given = redrawn(self.evidence(case).read_bytes(), move.settings)
        else:
            diagnosis = diagnosed(case, DEFAULT if move is None else move.settings)
            given = answer_of(diagnosis)
            if move is None:
                write_bytes(self.evidence(case), kept(diagnosis))
        self.put(case, move, given)
        return given

    def changed(self, tried: Sequence[Case], move: Move) -> list[Case] | None:
        """Those of the cases `tried` that `move` answers otherwise; None where not all were tried yet."""
        after = [self.get(case, move) for case in tried]
        if None in after:
            return None
        return [case for case, given in zip(tried, after, strict=True) if given != self.get(case, None)]


def groups() -> tuple[str, ...]:
    """The groups of thresholds that are moved as a whole first."""
    return tuple(one.name for one in fields(DEFAULT) if one.name != REPLAYED)


def work(answers: Answers, tried: Sequence[Case]) -> Iterator[tuple[Case, Move | None]]:
    """What is to be answered, in its order: cases as shipped, thresholds of the verdict, groups, and the thresholds of
    groups that matter, on the cases of which their group changed the answer. `answers` are those given so far,
    `tried` the cases.
    """
    yield from ((case, None) for case in tried)
    for one in thresholds():
        if one.group == REPLAYED:
            yield from ((case, Move(one.key, factor)) for factor in FACTORS for case in tried)
    for factor in FACTORS:
        for group in groups():
            yield from ((case, Move(group, factor)) for case in tried)
    for factor in FACTORS:
        for one in thresholds():
            if one.group != REPLAYED:
                matter = answers.changed(tried, Move(one.group, factor)) or []
                yield from ((case, Move(one.key, factor)) for case in matter)


def told(one: Threshold, factor: float, answers: Answers, tried: Sequence[Case]) -> str:
    """What moving the threshold `one` by `factor` does to the `answers` of the cases `tried`: a cell of the table."""
    asked: Sequence[Case] = tried
    if one.group != REPLAYED:
        by_group = answers.changed(tried, Move(one.group, factor))
        if by_group is None:
            return "not tried"
        asked = by_group
    changed = answers.changed(asked, Move(one.key, factor))
    if changed is None:
        return "not tried" if one.group == REPLAYED else f"group: {len(asked)}"
    if not changed:
        return "0"
    names = ", ".join(f"{case.name}: {_said(answers.get(case, Move(one.key, factor)))}" for case in changed)
    return f"{len(changed)} ({names})"


def _said(answer: Answer | None) -> str:
    verdict, effects = answer or ("not tried", ())
    return f"{verdict} {', '.join(effects)}".strip() if effects else verdict


def row_of(one: Threshold) -> list[str]:
    """What the table says of the threshold `one` itself: name, value, unit, origin."""
    values = one.value if isinstance(one.value, tuple) else (one.value,)
    return [f"`{one.name}`", ", ".join(f"{v:g}" for v in values), one.unit, one.origin]


def page(answers: Answers, tried: Sequence[Case]) -> str:
    """The documentation's page on every threshold, from the `answers` to the cases `tried`."""
    given = [answers.get(case, None) for case in tried]
    right = sum(answer in case.answers for case, answer in zip(tried, given, strict=True))
    counts = {"cases": len(tried), "outside": len(KINDS), "right": right}
    tells = NOT_TRIED if None in given else TRIED.format(**counts, last=answers.last)
    lines = (HEADER + tells).splitlines()
    group = ""
    for one in thresholds():
        if one.group != group:
            group = one.group
            lines += ["", f"## {group}", "", "| threshold | value | unit | origin | x 0.7 | x 1.3 |", "|---" * 6 + "|"]
        cells = row_of(one) + [told(one, factor, answers, tried) for factor in FACTORS]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main(arguments: Sequence[str] | None = None) -> None:
    """Answer what is not answered yet and write the table. `arguments` are those of the command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, default=Path("build/thresholds"), help="folder of the answers")
    parser.add_argument("--write", type=Path, help="the page to write")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after so many minutes")
    options = parser.parse_args(arguments)
    answers, tried, end = Answers(options.out), cases(), time.monotonic() + 60 * options.minutes
    for case, move in work(answers, tried):
        if time.monotonic() > end:
            break
        answers.answered(case, move)
    if options.write:
        write_text(options.write, page(answers, tried))


if __name__ == "__main__":
    main()
