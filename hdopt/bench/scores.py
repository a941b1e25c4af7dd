"""What a blind proof yields: rates with intervals, the gate's criteria, and the text that a reader gets."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any  # Any: groups are names or pairs of numbers

import pandas as pd
from scipy.stats import beta

from hdopt.bench import thresholds as t
from hdopt.bench.marking import MOST_UNDECIDABLE


@dataclass(frozen=True)
class Rate:
    """`hits` of `n`, with the two-sided Clopper-Pearson interval and the one-sided upper bound."""

    hits: int
    n: int

    @property
    def value(self) -> float:
        return self.hits / self.n if self.n else float("nan")

    def _bound(self, upper: bool, level: float) -> float:
        if not self.n:
            return 1.0 if upper else 0.0
        if upper:
            return 1.0 if self.hits == self.n else float(beta.ppf(level, self.hits + 1, self.n - self.hits))
        return 0.0 if self.hits == 0 else float(beta.ppf(1 - level, self.hits, self.n - self.hits + 1))

    @property
    def upper_bound(self) -> float:
        return self._bound(True, t.CONFIDENCE)

    @property
    def interval(self) -> tuple[float, float]:
        level = 0.5 + t.CONFIDENCE / 2
        return self._bound(False, level), self._bound(True, level)


@dataclass(frozen=True)
class CaseScore:
    """One case: its truth, what was said, the credit (0 or 1) and why it is not 1."""

    id: str
    family: str
    gear: str
    severity: float
    truth: tuple[str, ...]
    outside: str
    hidden: str  # variant or kind, for the list of failures
    verdict: str
    said: tuple[str, ...]
    explanations: int
    credit: float
    reason: str
    claim: bool  # of physics or structure
    told_apart: bool  # by the likelihood rule
    excused: bool  # not told apart, and within the share that may be
    improvement: float  # share of the oracle's; NaN where there was nothing to gain
    below_noise: bool

    @property
    def nothing(self) -> bool:
        """Whether nothing is hidden in it."""
        return not self.truth and not self.outside


@dataclass(frozen=True)
class Bin:
    """A row of the reliability table."""

    low: float
    high: float
    stated: float
    right: Rate


@dataclass(frozen=True)
class Criterion:
    name: str
    value: float
    limit: float
    passed: bool
    detail: str


@dataclass(frozen=True)
class Scores:
    """Result of a blind proof. What is called right follows `marking`."""

    cases: tuple[CaseScore, ...]
    families: dict[str, Rate]
    false_alarms: Rate
    false_alarms_by_family: dict[str, Rate]
    right_by_count: dict[int, Rate]  # number of hidden effects; at the gate's severities
    strict_by_count: dict[int, Rate]  # the same without excused cases: named with the very set
    right_by_size: dict[tuple[int, float], Rate]  # (number, severity)
    right_by_effect: dict[str, Rate]
    undecidable: Rate
    unknown_named: Rate
    unknown_recognised: Rate
    unknown_by_form: dict[str, Rate]
    improvement: tuple[float, int]  # median, cases
    below_noise: int  # answers that claim a held-out error below the noise
    coverage: Rate
    coverage_by_parameter: dict[str, Rate]
    reliability: tuple[Bin, ...]
    calibration_error: float
    log_score: tuple[float, float]  # as stated, of the best constant
    redrawn: int  # draws in which physics could not be as large as asked for
    drives: int
    invalid: tuple[str, ...]

    @property
    def failed(self) -> tuple[CaseScore, ...]:
        """Cases without credit."""
        return tuple(case for case in self.cases if case.credit < 1)

    @property
    def coverage_by_effect(self) -> dict[str, Rate]:
        """Share of intervals that hold the truth, by effect."""
        found: dict[str, Rate] = {}
        for name, rate in self.coverage_by_parameter.items():
            effect = name.split(".")[0]
            before = found.get(effect, Rate(0, 0))
            found[effect] = Rate(before.hits + rate.hits, before.n + rate.n)
        return found

    def gate(self) -> tuple[Criterion, ...]:
        """The criteria of the gate, each with its value and limit."""
        return (
            _at_most("false-alarm rate, upper bound", self.false_alarms, t.FALSE_ALARM_BOUND, bound=True),
            *(
                _at_least(f"exact sets, {n} hidden", self.right_by_count.get(n, Rate(0, 0)), limit)
                for n, limit in t.EXACT_SET.items()
            ),
            _at_most("unknown physics named", self.unknown_named, t.UNKNOWN_NAMED),
            _at_least("unknown physics recognised", self.unknown_recognised, t.UNKNOWN_RECOGNISED),
            Criterion(
                "median held-out improvement over the oracle's",
                self.improvement[0],
                t.IMPROVEMENT,
                self.improvement[0] >= t.IMPROVEMENT,
                f"{self.improvement[1]} cases",
            ),
            *self._stated(),
            _at_most("cases that cannot be told apart", self.undecidable, MOST_UNDECIDABLE),
            Criterion("enough cases", float(self._enough), 1.0, self._enough, f"{len(self.cases)} cases"),
        )

    def _stated(self) -> tuple[Criterion, ...]:
        """Criteria of what an answer states of itself: intervals and confidences."""
        low, high = t.COVERAGE
        off = [n for n, r in self.coverage_by_effect.items() if r.n and not _overlap(r.interval, t.COVERAGE)]
        said = f"{sum(b.right.n for b in self.reliability)} statements"
        stated, constant = self.log_score
        return (
            Criterion(
                "95 % intervals that hold the truth",
                self.coverage.value,
                low,
                low <= self.coverage.value <= high,
                f"{self.coverage.hits} of {self.coverage.n}, at most {high:g}",
            ),
            Criterion("effects whose intervals do not", float(len(off)), 0.0, not off, ", ".join(off)),
            Criterion(
                "calibration error of confidences",
                self.calibration_error,
                t.CALIBRATION_ERROR,
                self.calibration_error <= t.CALIBRATION_ERROR,
                said,
            ),
            Criterion("log score of confidences, over the best constant", stated, constant, stated > constant, said),
        )

    @property
    def _enough(self) -> bool:
        counts = {"nothing hidden": self.false_alarms.n}
        counts |= {family: rate.n for family, rate in self.families.items()}
        least = all(counts.get(family, 0) >= n for family, n in t.LEAST.items())
        return least and len(self.cases) >= t.CASES and self.drives >= t.DRIVES

    @property
    def passed(self) -> bool:
        """Whether every criterion of the gate holds."""
        return all(criterion.passed for criterion in self.gate())

    def to_frame(self) -> pd.DataFrame:
        """The gate, a row a criterion."""
        return pd.DataFrame([criterion.__dict__ for criterion in self.gate()]).set_index("name")

    def cases_frame(self) -> pd.DataFrame:
        """A row a case."""
        return pd.DataFrame([case.__dict__ for case in self.cases]).set_index("id")

    def reliability_frame(self) -> pd.DataFrame:
        """A row a bin of stated confidences."""
        return pd.DataFrame(
            [
                {
                    "confidence": f"{b.low:g}-{b.high:g}",
                    "statements": b.right.n,
                    "stated": b.stated,
                    "right": b.right.value,
                    "low": b.right.interval[0],
                    "high": b.right.interval[1],
                }
                for b in self.reliability
            ]
        )

    def summary(self) -> str:
        """Everything a reader needs, as text."""
        with pd.option_context(
            "display.width", 160, "display.max_colwidth", 60, "display.float_format", "{:.3f}".format
        ):
            parts = [self.to_frame().to_string()]
            parts.append("right by family\n" + _rows(self.families))
            parts.append("false alarms by family\n" + _rows(self.false_alarms_by_family))
            sizes = {f"{n} hidden, severity {s:g}": rate for (n, s), rate in self.right_by_size.items()}
            parts.append("right by number and severity\n" + _rows(sizes))
            strict = {f"{n} hidden": rate for n, rate in self.strict_by_count.items()}
            parts.append("named with the very set, where the records can tell\n" + _rows(strict))
            parts.append("right by effect, at the gate's severities\n" + _rows(self.right_by_effect))
            parts.append("unknown physics recognised, by form\n" + _rows(self.unknown_by_form))
            parts.append(f"answers that claim less held-out error than the noise: {self.below_noise}")
            parts.append("intervals that hold the truth\n" + _rows(self.coverage_by_parameter))
            parts.append("reliability of confidences\n" + self.reliability_frame().to_string(index=False))
            parts.append(f"draws in which physics could not be so large, and that were repeated: {self.redrawn}")
            if self.invalid:
                parts.append("answers outside the contract\n" + "\n".join(self.invalid))
            parts.append(f"failed cases: {len(self.failed)} of {len(self.cases)}\n" + self._failed_rows())
        return "\n\n".join(parts)

    def _failed_rows(self) -> str:
        columns = ["family", "gear", "severity", "truth", "hidden", "verdict", "said", "told_apart", "reason"]
        if not self.failed:
            return ""
        failed = self.cases_frame()[[*columns, "credit"]]
        failed = failed[failed["credit"] < 1][columns].sort_values(["family", "severity"])
        failed = failed.assign(truth=failed["truth"].map(" + ".join), said=failed["said"].map(" + ".join))
        return failed.to_string()


def _at_most(name: str, rate: Rate, limit: float, bound: bool = False) -> Criterion:
    value = rate.upper_bound if bound else rate.value
    return Criterion(name, value, limit, value <= limit, f"{rate.hits} of {rate.n}")


def _at_least(name: str, rate: Rate, limit: float) -> Criterion:
    return Criterion(name, rate.value, limit, rate.value >= limit, f"{rate.hits} of {rate.n}")


def _overlap(one: tuple[float, float], other: tuple[float, float]) -> bool:
    return one[0] <= other[1] and other[0] <= one[1]


def _rows(table: Mapping[Any, Rate]) -> str:
    """A line a rate; Any, because a rate may stand under a name, a number or a pair of them."""
    return "\n".join(f"  {name!s:44s} {rate.value:6.3f}  {rate.hits} of {rate.n}" for name, rate in table.items())
