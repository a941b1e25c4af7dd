"""What can be computed from a study, and which keys are missing for the rest: found by trying, so never out of date."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any  # Any: parsed TOML and JSON

from hdopt.errors import HdoptError, IncompleteStudy, MissingValue
from hdopt.files import ShownAsTable
from hdopt.study import DEFAULT_STUDY, AnyStudy, Study, load_study, study_document, study_of, with_values
from hdopt.study.defaults import USED, defaults_taken

if TYPE_CHECKING:
    import pandas as pd

VERDICT = "verdict on the requirement"
MOST_TRIES = 16
"""Times that a missing number is put in and the rest tried; the longest list of missing keys has fewer."""
PASSING = ("drive", "wave_generator")
"""Sections of which an incomplete study gets the shipped drive's numbers, to see what else is missing."""


@dataclass(frozen=True)
class Capability:
    """Something that can be computed: `what`, by which `commands`; `missing` keys, or `why` it cannot be for another
    reason. Both empty: it can."""

    what: str
    commands: tuple[str, ...]
    missing: tuple[str, ...] = ()
    why: str = ""

    @property
    def can(self) -> bool:
        """Whether it can be computed."""
        return not self.missing and not self.why


@dataclass(frozen=True)
class StudyCheck(ShownAsTable):
    """What a study allows. `defaults` says, a line a section, what holds where it says nothing; `doubts` which sizes of
    the drive hardly belong together."""

    study: str
    capabilities: tuple[Capability, ...]
    defaults: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    @property
    def complete(self) -> bool:
        """Whether the one drive of the study can be computed, without which nothing else can."""
        return any(one.can for one in self.capabilities)

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready: `can`, names; `missing`, name -> keys; `why`, name -> another reason; `defaults`; `doubts`."""
        return {
            "study": self.study,
            "can": [one.what for one in self.capabilities if one.can],
            "missing": {one.what: list(one.missing) for one in self.capabilities if one.missing},
            "why": {one.what: one.why for one in self.capabilities if one.why},
            "defaults": list(self.defaults),
            "doubts": list(self.doubts),
        }

    def to_frame(self) -> pd.DataFrame:
        """One row a capability."""
        import pandas as pd

        rows = [
            (one.what, ", ".join(one.commands), one.can, ", ".join(one.missing), one.why) for one in self.capabilities
        ]
        return pd.DataFrame(rows, columns=["what", "commands", "can", "missing", "why"])

    def tables(self) -> dict[str, pd.DataFrame]:
        """What goes into a spreadsheet."""
        return {"check": self.to_frame()}


def check_study(study: AnyStudy = None) -> StudyCheck:
    """What can be computed from `study` (a study, its name or its path), and what is missing for the rest.

    Raises `HdoptError` for a file with faults other than missing keys.
    """
    loaded, lacking = (study, ()) if isinstance(study, Study) else _loaded(study)
    found = [_tried(replace(one, missing=lacking), probe, loaded) for one, probe in PROBES]
    found = [_judged(one, found) for one in found]
    names = tuple(dict.fromkeys(name for sections in USED.values() for name in sections if name in loaded.sections))
    defaults = defaults_taken(loaded.sections, names, loaded.document)
    return StudyCheck(loaded.name, tuple(found), defaults, _doubts(loaded, lacking))


def _doubts(study: Study, lacking: tuple[str, ...]) -> tuple[str, ...]:
    """Sizes of the drive of the `study` that hardly belong together; none of one that has the shipped drive's for what
    is `lacking`, or that cannot be made."""
    from hdopt.mechanics.sizes import doubts

    if lacking:
        return ()
    try:
        return doubts(study.drive)
    except HdoptError:
        return ()


def _judged(one: Capability, found: Sequence[Capability]) -> Capability:
    """The verdict, `one` of what is `found`, with only the commands whose own work can be done; "no" where there is
    none, and others as they are."""
    if one.what != VERDICT or not one.can:
        return one
    work = {name: other for other in reversed(found) if other.what != VERDICT for name in other.commands}
    able = tuple(name for name in one.commands if work[name].can)
    return replace(one, commands=able) if able else replace(one, why="none of its commands can be run")


def _loaded(source: Any) -> tuple[Study, tuple[str, ...]]:
    """The study, and the keys without which it is none: they have the shipped drive's numbers for the time being."""
    try:
        return load_study(source), ()
    except IncompleteStudy as error:
        if any(key.partition(".")[0] not in PASSING for key in error.keys):
            raise
        document, name, folder = study_document(source)
        data = {**document.data}
        for section in PASSING:
            own = data.get(section, {})
            wanted = {*own, *(key.partition(".")[2] for key in error.keys if key.startswith(f"{section}."))}
            shipped = load_study(DEFAULT_STUDY).data[section]
            data[section] = {**own, **{key: shipped[key] for key in wanted if key in shipped}}
        return study_of(replace(document, data=data), name, folder), error.keys


def _tried(one: Capability, probe: Callable[[Study], object], study: Study) -> Capability:
    """`one` with all that `probe` misses: what it asks for is put in from the shipped drive until it asks no more."""
    missing = list(one.missing)
    for _ in range(MOST_TRIES):
        try:
            probe(study)
        except MissingValue as error:
            new = [key for key in error.keys if key not in missing]
            missing += new
            try:
                study = _with(study, new)
            except (HdoptError, KeyError):
                break
        except HdoptError as error:
            return replace(one, missing=tuple(missing), why="" if missing else str(error))
        else:
            break
    return replace(one, missing=tuple(missing))


def _with(study: Study, keys: list[str]) -> Study:
    """`study` with these missing `keys`, or [sections], as the shipped drive has them."""
    shipped = load_study(DEFAULT_STUDY).data
    values: dict[str, Any] = {}
    for key in keys:
        value: Any = shipped
        for part in key.strip("[]").split("."):
            value = value[part]
        values[key.strip("[]")] = value
    if not values:
        raise KeyError(keys)
    return study_of(with_values(study.document, values.items(), "check"), study.name, study.folder)


def _one_drive(study: Study) -> None:
    from hdopt.workflow.waveform import model_of

    assert study.drive and study.errors
    if study.effects:
        model_of(study)


def _verdict(study: Study) -> None:
    from hdopt.study.tolerances import RequirementSection

    if "linear_stack" not in study.sections:
        study.section("requirement", RequirementSection, "a verdict")


def _contact(study: Study) -> None:
    from hdopt.mechanics.contact_model import contact_of

    contact_of(study.drive)


def _lag(study: Study) -> None:
    from hdopt.mechanics.lag import lag

    lag(study.drive, study.errors, [0.0, 1.0], [0.0, 0.0])


def _curvature(study: Study) -> None:
    from hdopt.mechanics.bending import max_curvature_change

    max_curvature_change(study.drive.geometry, study.drive.wave_generator.profile)


def _stress(study: Study) -> None:
    from hdopt.mechanics.bending import max_bending_stress

    max_bending_stress(study.drive)


def _pressure(study: Study) -> None:
    from hdopt.mechanics.contact_model import mean_flank_pressure

    mean_flank_pressure(study.drive)


def _stack(study: Study) -> None:
    from hdopt.workflow.stack import study_problem

    study_problem(study)


def _allocation(study: Study) -> None:
    from hdopt.workflow.allocate import items_of
    from hdopt.workflow.stack import study_problem

    space = study_problem(study).space
    if "linear_stack" not in study.sections:
        items_of(study, space)


def _search(study: Study) -> None:
    from hdopt.optimize.objectives import QUANTITIES
    from hdopt.workflow.search_setup import setup_of

    setup = setup_of(study, 1)
    asked = (setup.settings.objective, setup.settings.second_objective, *(limit.quantity for limit in setup.limits()))
    for key in asked:
        if key is not None and key in QUANTITIES:
            QUANTITIES[key].value(setup.trade, setup.baseline)


def _export(study: Study) -> None:
    from hdopt.geometry.assembly import wave_generator_model
    from hdopt.workflow.export import export_options

    wave_generator_model(study.drive, export_options(study))


PROBES: tuple[tuple[Capability, Callable[[Study], object]], ...] = (
    (Capability("kinematic error of one drive", ("ke", "run")), _one_drive),
    (Capability(VERDICT, ("ke", "stack", "sobol", "allocate")), _verdict),
    (Capability("contact angle, teeth in mesh and k_e", ("ke", "profile")), _contact),
    (Capability("lag at reversal", ("ke",)), _lag),
    (Capability("curvature of the ring", ("profile",)), _curvature),
    (Capability("bending stress", ("profile",)), _stress),
    (Capability("flank pressure", ("profile",)), _pressure),
    (Capability("tolerance stack and sensitivities", ("stack", "sobol")), _stack),
    (Capability("least-cost tolerances", ("allocate",)), _allocation),
    (Capability("design search", ("search",)), _search),
    (Capability("wave generator as files", ("export",)), _export),
)
"""What can be computed, and the cheapest piece of it that asks for every number that the whole needs."""
