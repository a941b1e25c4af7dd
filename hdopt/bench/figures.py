"""The figures of a run that the register keeps and the page shows."""

from __future__ import annotations

from typing import Any  # Any: values of JSON; groups are names or pairs of numbers

from hdopt.bench.scores import Rate, Scores


def figures(scores: Scores) -> dict[str, Any]:
    """`scores` as a short dictionary; rates as [hits, n]."""
    return {
        "cases": len(scores.cases),
        "passed": scores.passed,
        "missed": [criterion.name for criterion in scores.gate() if not criterion.passed],
        "false_alarms": _pair(scores.false_alarms),
        "false_alarms_by_family": _pairs(scores.false_alarms_by_family),
        "right_by_family": _pairs(scores.families),
        "right_by_count": _pairs(scores.right_by_count),
        "strict_by_count": _pairs(scores.strict_by_count),
        "right_by_size": {f"{n} at {s:g}": _pair(rate) for (n, s), rate in scores.right_by_size.items()},
        "right_by_effect": _pairs(scores.right_by_effect),
        "unknown_named": _pair(scores.unknown_named),
        "unknown_recognised": _pair(scores.unknown_recognised),
        "undecidable": _pair(scores.undecidable),
        "improvement": [_round(scores.improvement[0]), scores.improvement[1]],
        "coverage": _pair(scores.coverage),
        "coverage_by_effect": _pairs(scores.coverage_by_effect),
        "calibration_error": _round(scores.calibration_error),
        "log_score": [_round(value) for value in scores.log_score],
        "reliability": [[b.low, b.high, _round(b.stated), *_pair(b.right)] for b in scores.reliability],
        "redrawn": scores.redrawn,
        "invalid": len(scores.invalid),
    }


def _pair(rate: Rate) -> list[int]:
    return [rate.hits, rate.n]


def _pairs(rates: dict[Any, Rate]) -> dict[str, list[int]]:
    return {str(name): _pair(rate) for name, rate in rates.items()}


def _round(value: float) -> float | None:
    return None if value != value else round(value, 4)
