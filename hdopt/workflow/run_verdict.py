"""What a run's page says first: whether the requirement is met, and the few findings of its steps that say why."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any  # Any: results of steps, JSON-ready

from hdopt.report import Ruling, Section
from hdopt.report.cells import in_words
from hdopt.report.sections.verdict import verdict_section
from hdopt.report.sections.words import in_sentence, label, percent
from hdopt.words import listed
from hdopt.workflow.requirement import Verdict

Found = Mapping[str, Mapping[str, Any]]
"""Step -> its results."""


def section_of_run(verdict: Verdict | None, found: Found) -> Section | None:
    """The verdict of a run with what its steps `found`; None where no requirement was judged."""
    if verdict is None:
        return None
    if verdict.at_least:
        says = _of_yield(verdict, found["stack"])
    else:
        says = _of_drive(verdict) if "waveform" in found else _of_best_design(verdict)
    ruling = Ruling(verdict.met, says)
    reasons = [*_of_stack(found), *_of_one_drive(verdict, found), *_of_allocation(found), *_of_search(found)]
    return verdict_section(ruling, reasons)


def _of_yield(verdict: Verdict, stack: Mapping[str, Any]) -> str:
    limit, unit = _limit(stack)
    return (
        f"{percent(verdict.value)} of {_of_what(stack)} to these tolerances stay within {limit:.4g} {unit}; "
        f"{percent(verdict.limit)} must."
    )


def _of_drive(verdict: Verdict) -> str:
    by = f"{abs(verdict.margin):.3g} {verdict.unit}"
    return (
        f"The drive in [errors] has {verdict.value:.4g} {verdict.unit} peak-to-peak, {verdict.limit:.4g} "
        f"{verdict.unit} is allowed: {by} {'to spare' if verdict.met else 'too much'}."
    )


def _of_best_design(verdict: Verdict) -> str:
    by = f"{abs(verdict.margin):.3g} {verdict.unit}"
    what, _, share = verdict.quantity.partition(", ")[0].partition(" of ")
    whose = f"{share} with the chosen wave generator stay" if share else "The chosen design stays"
    return (
        f"{whose} within {verdict.value:.4g} {verdict.unit} {what}, {verdict.limit:.4g} "
        f"{verdict.unit} is allowed: {by} {'to spare' if verdict.met else 'too much'}."
    )


def _limit(stack: Mapping[str, Any]) -> tuple[float, str]:
    key = next(key for key in stack if key.startswith("limit_"))
    return float(stack[key]), key.removeprefix("limit_")


def _of_what(stack: Mapping[str, Any]) -> str:
    """What a `stack` samples: drives, or assemblies of dimensions where there is no drive."""
    return "assemblies" if stack.get("method", "") is None else "drives"


def _of_stack(found: Found) -> list[str]:
    stack = found.get("stack", {})
    if "yield" not in stack:
        return []
    limit, unit = _limit(stack)
    needed = stack["required_yield"]
    quantile = stack["quantiles"][f"{needed:g}"]["value"]
    side = "above" if quantile > limit else "below"
    says = [
        f"{percent(needed)} of the {_of_what(stack)} stay below {quantile:.4g} {unit}, "
        f"{abs(quantile - limit):.3g} {unit} {side} the limit: [[stack-distribution]]."
    ]
    shares = sorted(stack.get("contributions", {}).items(), key=lambda item: -item[1])
    most = [f"{in_sentence(in_words(name))} ({100 * share:.0f} %)" for name, share in shares[:3] if share > 0.01]
    if most:
        says.append(f"Most of the spread comes from {listed(most)}: [[stack-contributions]].")
    return says


def _of_one_drive(verdict: Verdict, found: Found) -> list[str]:
    says = []
    waveform = found.get("waveform", {})
    if verdict.at_least and waveform.get("required_arcmin") is not None:
        value, limit = waveform["peak_to_peak_arcmin"], waveform["required_arcmin"]
        says.append(
            f"The one drive in [errors] has {value:.4g} arcmin, {'above' if value > limit else 'within'} the limit. It "
            "is one example, with every error as large as [errors] says; the verdict is about all drives that the "
            "tolerances allow."
        )
    structures = found.get("structures", {})
    spans = {name: row["peak_to_peak_arcmin"] for name, row in structures.items() if isinstance(row, Mapping)}
    if len(spans) > 1:
        best = min(spans, key=lambda name: spans[name])
        says.append(
            f"For that drive the structure with the least error is {in_sentence(label(best))}, {spans[best]:.4g} "
            "arcmin: [[structures-table]]."
        )
    return says


def _of_allocation(found: Found) -> list[str]:
    allocation = found.get("allocate", {})
    if allocation.get("status") == "infeasible":
        return [f"No tolerances are enough: {allocation['reason']}."]
    if "total_cost" not in allocation:
        return []
    check, what = allocation["verified_yield"]["value"], _of_what(found.get("stack", {}))
    if allocation.get("status") == "not verified":
        return [
            f"The tolerances found cost {allocation['total_cost']:.4g}; only {percent(check)} of {what} then stay "
            "within the limit, fewer than are needed: [[allocate-tolerances]]."
        ]
    return [
        f"The least-cost tolerances that keep it cost {allocation['total_cost']:.4g}, and {percent(check)} of {what} "
        "then stay within the limit: [[allocate-tolerances]]."
    ]


def _of_search(found: Found) -> list[str]:
    search = found.get("search", {})
    if "best" not in search:
        return []
    if "stack" in found or "waveform" in found:
        return ["Another wave generator was searched for: [[trade-chosen-combinations]]."]
    from hdopt.optimize.objectives import QUANTITIES

    objective = search["objective"]
    best, before = search["best"]["quantities"][objective], search["baseline"]["quantities"][objective]
    unit = QUANTITIES[objective].unit
    says = [
        f"With the study's own wave generator it is {before:.4g} {unit} instead of {best:.4g} {unit}: "
        "[[trade-chosen-against-baseline]]."
    ]
    held = [in_sentence(price["title"]) for price in search["active"]]
    return [*says, f"What holds it is {listed(held)}: [[trade-chosen-prices]]."] if held else says
