"""Which of a study's effects a command counts, and its extended model with them."""

from __future__ import annotations

from dataclasses import dataclass

from hdopt.simulation import EffectValues, ExtendedModel
from hdopt.study import Study

CHOICES = {
    "all": ("drive", "bench"),
    "drive": ("drive",),
    "none": (),
}
"""`include` of [operation] -> the origins that count."""


@dataclass(frozen=True)
class Inclusion:
    """The effects of a study, split by whether they count. `asked` says whether the study chose, not the command."""

    choice: str
    asked: bool
    counted: tuple[EffectValues, ...]
    left_out: tuple[EffectValues, ...]

    @property
    def says(self) -> tuple[str, ...]:
        """What counts and what does not, in plain words; () for a study without effects."""
        found = []
        if self.counted:
            found.append(f"computed with {_names(self.counted)} (what [effects] adds to the base model)")
        if self.left_out:
            how = "as [operation] include asks" if self.asked else "set operation.include=all to count all"
            bench = [effect for effect in self.left_out if effect.origin == "bench"]
            why = "of the bench that measured, not of the drive; " if len(bench) == len(self.left_out) else ""
            found.append(f"computed without {_names(self.left_out)} ({why}{how})")
        return tuple(found)


def inclusion(study: Study, default: str) -> Inclusion:
    """Which effects of a `study` count: as its [operation] includes, or by `default` ('all', 'drive' or 'none')."""
    asked = _asked(study)
    choice = asked or default
    origins = CHOICES[choice]
    return Inclusion(
        choice,
        asked is not None,
        tuple(effect for effect in study.effects if effect.origin in origins),
        tuple(effect for effect in study.effects if effect.origin not in origins),
    )


def _asked(study: Study) -> str | None:
    if "operation" not in study.sections:
        return None
    from hdopt.study.effects import OperationSection

    section = study.find("operation", OperationSection)
    return None if section is None else section.include


def extended_model(study: Study, default: str = "all") -> ExtendedModel:
    """The extended model of the one drive of a `study`, at its operating condition, with the effects that count: as
    [operation] includes, or by `default` ('all', 'drive', 'none')."""
    return ExtendedModel(study.drive, study.errors, inclusion(study, default).counted, study.operation)


def _names(effects: tuple[EffectValues, ...]) -> str:
    return ", ".join(effect.id for effect in effects)
