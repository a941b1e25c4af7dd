"""Diagnoses of many drives on one page: the verdicts, every drive, what was found in which."""

from __future__ import annotations

from typing import TYPE_CHECKING

from hdopt.report import Figure, Item, KeyFigures, Report, Section, Table
from hdopt.report.sections.words import label
from hdopt.report.theme import BLUE, VERMILLION, figure
from hdopt.words import counted

if TYPE_CHECKING:
    from hdopt.diagnosis.verdict.many import DiagnosedBatch

NUMBERS = {"value": ".4g", "low": ".4g", "high": ".4g"}
SAYS = "Each recording was diagnosed by itself; no drive's verdict leans on another's."


def diagnoses_report(batch: DiagnosedBatch) -> Report:
    """One page on a `batch` of diagnoses."""
    import pandas as pd

    done = [drive for drive in batch.drives if not drive.error]
    counts = {"Drives": str(len(done))}
    counts |= {f"Verdict {name}": str(count) for name, count in batch.verdicts.items()}
    counts |= {label(name): f"in {count} of {len(done)}" for name, count in batch.effects.items()}
    if len(done) < len(batch.drives):
        counts["Not diagnosed"] = str(len(batch.drives) - len(done))
    rows = [
        (
            drive.name,
            drive.verdict,
            ", ".join(f"{label(name)} ({100 * confidence:.0f} %)" for name, confidence in drive.effects.items()),
            drive.number("heldout_rms_base_arcmin"),
            drive.number("heldout_rms_extended_arcmin"),
            drive.number("false_alarm_p"),
        )
        for drive in done
    ]
    columns = ["drive", "verdict", "effects, confidence", "base, arcmin", "extended, arcmin", "false alarm p"]
    items: list[Item] = [
        KeyFigures(counts),
        Figure("diagnoses", "Error on turns that no model saw", _left(batch), "Base model and what was added to it."),
        Table("diagnoses-table", "Every drive", pd.DataFrame(rows, columns=columns)),
    ]
    if len(found := batch.parameters()):
        found["effect"] = found["effect"].map(label)
        items.append(Table("found-table", "What was found, with 95 % intervals", found, "", NUMBERS))
    if failed := [(drive.name, drive.error) for drive in batch.drives if drive.error]:
        frame = pd.DataFrame(failed, columns=["recording", "why"])
        items.append(Table("failed-table", "Recordings that could not be diagnosed", frame))
    section = Section("diagnoses", "Drives", tuple(items), SAYS)
    return Report("Diagnoses of many drives", f"{counted(len(batch.drives), 'recording')}", (section,), batch.to_dict())


def _left(batch: DiagnosedBatch) -> object:
    made = figure("Drive", "Held-out error (arcmin rms)", 380)
    done = [drive for drive in batch.drives if not drive.error]
    for model, colour in (("base", VERMILLION), ("extended", BLUE)):
        left = [drive.number(f"heldout_rms_{model}_arcmin") for drive in done]
        made.add_scatter(x=[d.name for d in done], y=left, mode="markers", name=model, marker={"color": colour})
    return made
