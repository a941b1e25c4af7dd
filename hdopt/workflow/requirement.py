"""Whether a study's requirement is met, and by how much: one line in every command, one key in its JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any  # Any: values of JSON

if TYPE_CHECKING:
    from hdopt.allocation.results import AllocateResult
    from hdopt.optimize.records import SearchResult
    from hdopt.study import Study
    from hdopt.study.tolerances import RequirementSection
    from hdopt.tolerance.results import StackResult
    from hdopt.workflow.kinematic_error import KinematicErrorResult


@dataclass(frozen=True)
class Verdict:
    """A number against its limit. `at_least`: it must not fall below the limit, as a yield; else not exceed it."""

    quantity: str
    """What is compared, in words: 'peak-to-peak', 'yield'."""
    value: float
    limit: float
    unit: str = ""
    at_least: bool = False

    @property
    def margin(self) -> float:
        """How much is to spare, in the unit of the value; negative where the requirement is missed."""
        return self.value - self.limit if self.at_least else self.limit - self.value

    @property
    def met(self) -> bool:
        """Whether the requirement is met; a value that is not a number meets none."""
        return self.margin >= 0

    @property
    def line(self) -> str:
        """'requirement met: peak-to-peak 0.9 arcmin, at most 1 arcmin allowed, 0.1 arcmin to spare'."""
        says = f"requirement {'met' if self.met else 'missed'}: {self.quantity}"
        by = "to spare" if self.met else "short" if self.at_least else "too much"
        if self.at_least:
            by_percent = 100 * abs(self.margin)
            margin = f"{by_percent:.0f} % {by}" if by_percent >= 10 else f"{by_percent:.2g} % {by}"
            return f"{says} {_percent(self.value)}, at least {_percent(self.limit)} needed, {margin}"
        unit = f" {self.unit}" if self.unit else ""
        margin = f"{abs(self.margin):.3g}{unit} {by}"
        return f"{says} {self.value:.4g}{unit}, at most {self.limit:.4g}{unit} allowed, {margin}"

    def to_dict(self) -> dict[str, Any]:
        """JSON-ready: quantity, value, limit, unit, met, margin."""
        return {
            "quantity": self.quantity,
            "value": self.value,
            "limit": self.limit,
            "unit": self.unit,
            "met": self.met,
            "margin": self.margin,
        }


def _percent(share: float) -> str:
    """A `share` with enough digits to tell it from a whole: '99.07 %', '99.9987 %'."""
    left = 100 * (1 - share)
    digits = 2 if left >= 0.01 or left <= 0 else math.ceil(-math.log10(left)) + 1
    return f"{100 * share:.{digits}f} %"


def _requirement(study: Study) -> RequirementSection | None:
    from hdopt.study.tolerances import RequirementSection

    return study.find("requirement", RequirementSection)


def required_limits(study: Study) -> dict[str, float]:
    """The limit that [requirement] of a `study` puts on a recording, arcmin by the name of the figure; {} for none."""
    section = _requirement(study)
    return {} if section is None else {"peak_to_peak": section.peak_to_peak_arcmin}


SOBOL_CHECK_N = 2**16
"""Drives that tell the yield beside Sobol' indices: known within about 0.001."""


def of_kinematic_error(study: Study, result: KinematicErrorResult) -> Verdict | None:
    """The peak-to-peak of one drive, the `result` of the `study`, against [requirement]; None where it has none.

    Compared is what the requirement speaks of: a single tooth pair, or with homogenization = "contact" the value evened
    out by the teeth in mesh.
    """
    section = _requirement(study)
    if section is None:
        return None
    evened = section.homogenization == "contact" and result.nonuniform_arcmin is not None
    value = result.nonuniform_arcmin if evened and result.nonuniform_arcmin is not None else result.peak_to_peak_arcmin
    return Verdict("peak-to-peak", value, section.peak_to_peak_arcmin, "arcmin")


def of_tolerances(study: Study, seed: int = 1) -> Verdict | None:
    """The yield of the tolerances of a `study`, from a stack of its own with `seed`; None where it has no
    requirement."""
    if "requirement" not in study.sections and "linear_stack" not in study.sections:
        return None
    from hdopt.workflow.stack import stack

    found = stack(study, SOBOL_CHECK_N, seed=seed).stack
    return Verdict(f"yield of {found.n} drives", found.conforming.value, found.required_yield, at_least=True)


def of_stack(result: StackResult) -> Verdict:
    """The yield that the stack `result` found against the one required."""
    found = result.stack
    return Verdict("yield", found.conforming.value, found.required_yield, at_least=True)


def of_allocation(result: AllocateResult) -> Verdict:
    """The verified yield in the `result` of an allocation against the one required."""
    return Verdict("verified yield", result.verified_yield.value, result.required_yield, at_least=True)


def of_search(study: Study, result: SearchResult) -> Verdict | None:
    """The best design in the `result` of a search of `study` against [requirement], in the quantity that was searched
    for; None where the study has none, where that is no peak-to-peak or of another share of drives, and where no design
    keeps the search's own limits: the nearest is none to be built."""
    if not result.feasible:
        return None
    return _of_best(study, result.objective, result.setup.settings.quantile, result.best.quantities)


def _of_best(study: Study, objective: str, share: float, quantities: Mapping[str, float]) -> Verdict | None:
    """The best design's `quantities` against [requirement], where the `objective` is a peak-to-peak of one drive or of
    the `share` of drives that the requirement asks for."""
    section = _requirement(study)
    if section is None or section.homogenization == "contact":
        return None
    quantile = "quantile" in objective
    if quantile and share != section.required_yield:
        return None
    key = objective if quantile else "peak_to_peak_arcmin"
    if key not in quantities:
        return None
    what = f"peak-to-peak of {100 * section.required_yield:g} % of drives" if quantile else "peak-to-peak"
    return Verdict(f"{what}, best design", quantities[key], section.peak_to_peak_arcmin, "arcmin")


def of_run(study: Study, found: Mapping[str, Mapping[str, Any]]) -> Verdict | None:
    """The requirement of `study` against what the steps of a run `found`, their results by name: the yield of its
    stack, else its drive's peak-to-peak, else that of the best design of its search."""
    section = _requirement(study)
    if "yield" in found.get("stack", {}):
        needed = found["stack"]["required_yield"]
        return Verdict("yield", found["stack"]["yield"]["value"], needed, at_least=True)
    if section is not None and section.homogenization != "contact" and "waveform" in found:
        value = found["waveform"].get("peak_to_peak_arcmin")
        if isinstance(value, float):
            return Verdict("peak-to-peak", value, section.peak_to_peak_arcmin, "arcmin")
    searched = found.get("search", {})
    if "best" in searched and searched.get("feasible", True):
        from hdopt.study.search import SearchSection

        share = study.section("search", SearchSection, "a search").quantile
        return _of_best(study, searched["objective"], share, searched["best"]["quantities"])
    return None
