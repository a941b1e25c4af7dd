"""What a blind proof yields: rates with intervals, the gate's criteria, and the text that a reader gets."""

from dataclasses import dataclass

import pandas as pd
from scipy.stats import beta

from hdopt.bench import thresholds


@dataclass(frozen=True)
class Rate:
    """`hits` of `n`, with the two-sided Clopper-Pearson interval and the one-sided upper bound."""

    hits: int
    n: int

    @property
    def value(self):
        return self.hits / self.n if self.n else float("nan")

    def _bound(self, upper, level):
        if not self.n:
            return 1.0 if upper else 0.0
        if upper:
            return 1.0 if self.hits == self.n else float(beta.ppf(level, self.hits + 1, self.n - self.hits))
        return 0.0 if self.hits == 0 else float(beta.ppf(1 - level, self.hits, self.n - self.hits + 1))

    @property
    def upper_bound(self):
        return self._bound(True, thresholds.CONFIDENCE)

    @property
    def interval(self):
        level = 0.5 + thresholds.CONFIDENCE / 2
        return self._bound(False, level), self._bound(True, level)


@dataclass(frozen=True)
class CaseScore:
    """One case: its truth, what was said, the credit (0 to 1) and why it is not 1."""

    id: str
    family: str
    severity: float
    truth: tuple[str, ...]
    hidden: str  # variant or kind, for the list of failures
    verdict: str
    said: tuple[str, ...]
    explanations: int
    credit: float
    reason: str
    alarm: bool  # a claim of physics or structure
    detectable: bool
    improvement: float  # share of the oracle's; NaN where there was nothing to gain
    below_noise: bool


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
    """Result of a blind proof."""

    cases: tuple[CaseScore, ...]
    false_alarms: Rate
    decoy_false_alarms: Rate
    insufficient: Rate  # of the cases with nothing hidden; no error, but no answer either
    exact: dict[float, tuple[float, int]]  # severity -> mean credit, cases
    exact_detectable: dict[float, tuple[float, int]]  # the same, of what the records can show
    exact_by_effect: dict[str, tuple[float, int]]  # at the gate's severities
    exact_gate: tuple[float, int]
    exact_ceiling: float  # credit at the gate's severities of an answer that lists every rival the key leaves standing
    unknown_recall: Rate
    unknown_named: Rate
    unknown_by_kind: dict[str, Rate]
    improvement: tuple[float, int]  # median, cases
    below_noise: int  # answers that claim a held-out error below the noise
    coverage: Rate
    coverage_by_parameter: dict[str, Rate]
    reliability: tuple[Bin, ...]
    calibration_error: float
    unknown_kinds: int
    invalid: tuple[str, ...]

    @property
    def failed(self):
        return tuple(case for case in self.cases if case.credit < 1)

    def gate(self):
        """The criteria of the gate, each with its value and limit."""
        t = thresholds
        bound, (exact, n_exact), (median, n_median) = self.false_alarms.upper_bound, self.exact_gate, self.improvement
        enough = (
            self.false_alarms.n >= t.NOTHING_CASES
            and self.unknown_named.n >= t.UNKNOWN_CASES
            and self.unknown_kinds >= t.UNKNOWN_KINDS
            and set(t.SEVERITIES) <= set(self.exact)
        )
        said = sum(bin.right.n for bin in self.reliability)
        return (
            Criterion(
                "false-alarm rate, upper bound",
                bound,
                t.FALSE_ALARM_BOUND,
                bound <= t.FALSE_ALARM_BOUND,
                f"{self.false_alarms.hits} of {self.false_alarms.n}",
            ),
            Criterion(
                f"exact set at severity >= {t.EXACT_SET_FROM_SEVERITY}",
                exact,
                t.EXACT_SET,
                exact >= t.EXACT_SET,
                f"{n_exact} cases",
            ),
            Criterion(
                "unknown physics named",
                self.unknown_named.value,
                t.UNKNOWN_NAMED,
                self.unknown_named.value <= t.UNKNOWN_NAMED,
                f"{self.unknown_named.hits} of {self.unknown_named.n}",
            ),
            Criterion(
                "median held-out improvement over the oracle's",
                median,
                t.IMPROVEMENT,
                median >= t.IMPROVEMENT,
                f"{n_median} cases",
            ),
            Criterion(
                "calibration error of confidences",
                self.calibration_error,
                t.CALIBRATION_ERROR,
                self.calibration_error <= t.CALIBRATION_ERROR,
                f"{said} statements",
            ),
            Criterion("enough cases", float(enough), 1.0, enough, f"{len(self.cases)} cases"),
        )

    @property
    def passed(self):
        return all(criterion.passed for criterion in self.gate())

    def to_frame(self):
        """The gate, a row a criterion."""
        return pd.DataFrame([criterion.__dict__ for criterion in self.gate()]).set_index("name")

    def cases_frame(self):
        return pd.DataFrame([case.__dict__ for case in self.cases]).set_index("id")

    def reliability_frame(self):
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

    def summary(self):
        """Everything a reader needs, as text."""
        with pd.option_context(
            "display.width", 160, "display.max_colwidth", 60, "display.float_format", "{:.3f}".format
        ):
            parts = [self.to_frame().to_string()]
            low, high = self.false_alarms.interval
            parts.append(f"false alarms {self.false_alarms.value:.3f} [{low:.3f}, {high:.3f}] with nothing hidden")
            parts.append(
                f"decoys without physics: {self.decoy_false_alarms.hits} false alarms of {self.decoy_false_alarms.n}; "
                f"answered insufficient with nothing hidden: {self.insufficient.hits} of {self.insufficient.n}"
            )
            parts.append(
                "exact set by severity\n"
                + pd.DataFrame(
                    [
                        {"severity": s, "credit": c, "cases": n, "credit_detectable": self.exact_detectable[s][0]}
                        for s, (c, n) in self.exact.items()
                    ]
                ).to_string(index=False)
            )
            parts.append(
                f"an answer that lists every explanation the records leave open would have {self.exact_ceiling:.3f} "
                "at the gate's severities"
            )
            parts.append("exact set by effect, at the gate's severities\n" + _rows(self.exact_by_effect))
            recall = {k: (r.value, r.n) for k, r in self.unknown_by_kind.items()}
            parts.append(
                f"unknown physics recognised: {self.unknown_recall.hits} of {self.unknown_recall.n}\n" + _rows(recall)
            )
            parts.append(f"answers that claim less held-out error than the noise: {self.below_noise}")
            low, high = self.coverage.interval
            parts.append(
                f"parameter intervals that hold the truth: {self.coverage.hits} of {self.coverage.n}, "
                f"rate in [{low:.3f}, {high:.3f}]\n"
                + _rows({k: (r.value, r.n) for k, r in self.coverage_by_parameter.items()})
            )
            parts.append("reliability of confidences\n" + self.reliability_frame().to_string(index=False))
            if self.invalid:
                parts.append("answers outside the contract\n" + "\n".join(self.invalid))
            columns = ["family", "severity", "truth", "hidden", "verdict", "said", "credit", "reason"]
            failed = self.cases_frame()[columns] if self.cases else pd.DataFrame()
            failed = failed[failed["credit"] < 1].sort_values(["family", "severity"])
            failed = failed.assign(truth=failed["truth"].map(" + ".join), said=failed["said"].map(" + ".join))
            parts.append(f"failed cases: {len(failed)} of {len(self.cases)}\n" + failed.to_string())
        return "\n\n".join(parts)


def _rows(table):
    return "\n".join(f"  {name:32s} {value:6.3f}  of {n}" for name, (value, n) in sorted(table.items()))
