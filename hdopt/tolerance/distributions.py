"""Distributions of one input, each truncated where bounds are given; NumPy arrays in, NumPy arrays out.

A draw is `quantile(u)` of a number u in (0, 1), so that any point set of the unit cube becomes a sample. Truncation is
exact: u runs over the probability that the untruncated distribution puts between the bounds.

The functions are scipy.special's. scipy.stats on top of them is 1.5 to 5 times as slow, as right where its upper tail
is used (its triangle is not) and lost beyond 8 standard deviations where its distribution function is; OpenTURNS is 2
to 170 times as slow and has no truncation out there: `python -m tests.benchmarks.distributions`.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from hdopt.arrays import Array
from hdopt.errors import HdoptError, shown
from hdopt.files import DECIMAL_COMMA, read_text
from hdopt.keywords import names_keywords

INFINITY = math.inf
DIGITS = tuple("0123456789+-.,")
"""How a line begins that is no header but a number, if a spoilt one."""


class Distribution(Protocol):
    """What a sampler needs of an input: where it can lie, and its inverse distribution function."""

    @property
    def name(self) -> str: ...

    @property
    def support(self) -> tuple[float, float]:
        """Smallest and largest value, infinite where there is no bound."""

    def quantile(self, u: ArrayLike) -> Array:
        """Inverse distribution function at `u` in (0, 1), same shape."""


def _above(x: float) -> float:
    """P(X > `x`) of a standard normal number. For one number scipy.special, a tenth of a second to import, is not
    asked."""
    return 0.5 * math.erfc(x / math.sqrt(2))


def require(condition: bool, message: str) -> None:
    """Raise `HdoptError` with `message` unless `condition` holds."""
    if not condition:
        raise HdoptError(message)


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Truncated:
    """Base of the families: keeps what lies in [lower, upper] of an untruncated distribution.

    A family gives `natural` (its untruncated support), `_tail(x)` = P(X > x) and its inverse `_inverse_tail(q)`:
    working with the upper tail keeps full precision far out, where tolerances are decided.
    """

    lower: float = -INFINITY
    upper: float = INFINITY
    name = "truncated"

    def __post_init__(self) -> None:
        self.check()
        low, high = self.natural
        where = f"truncation of the {self.name} distribution"
        require(
            not (math.isnan(self.lower) or math.isnan(self.upper)) and self.lower < self.upper,
            f"{where} is inconsistent: lower {self.lower:g}, upper {self.upper:g}; lower must be below upper",
        )
        require(
            self.upper > low and self.lower < high,
            f"{where} is inconsistent: [{self.lower:g}, {self.upper:g}] misses everything the distribution can be, "
            f"[{low:g}, {high:g}]; move the bounds into it",
        )
        require(
            self._mass > 1e-300,
            f"{where} is inconsistent: no probability is left in [{self.lower:g}, {self.upper:g}]; widen the bounds",
        )

    @property
    def natural(self) -> tuple[float, float]:
        """Where the untruncated distribution lies."""
        return -INFINITY, INFINITY

    def check(self) -> None:
        """Raise `HdoptError` for parameters the family does not allow."""

    @property
    def support(self) -> tuple[float, float]:
        return max(self.lower, self.natural[0]), min(self.upper, self.natural[1])

    @cached_property
    def tails(self) -> tuple[float, float]:
        """P(X > lower) and P(X > upper) before truncation."""
        lower, upper = self.support
        above_lower = 1.0 if lower <= self.natural[0] else float(self._tail(lower))
        above_upper = 0.0 if upper >= self.natural[1] else float(self._tail(upper))
        return above_lower, above_upper

    @cached_property
    def _mass(self) -> float:
        return self.tails[0] - self.tails[1]

    def quantile(self, u: ArrayLike) -> Array:
        above_lower, above_upper = self.tails
        tail = above_lower - np.asarray(u, float) * (above_lower - above_upper)
        lower, upper = self.support
        return np.clip(self._inverse_tail(tail), lower, upper)

    def _tail(self, x: float) -> float:
        raise NotImplementedError

    def _inverse_tail(self, q: Array) -> Array:
        raise NotImplementedError


def _check_positive(family: str, **parameters: float) -> None:
    for name, value in parameters.items():
        require(
            math.isfinite(value) and value > 0,
            f"{name} of the {family} distribution is {value!r}; it must be a finite number above 0",
        )


def _check_finite(family: str, **parameters: float) -> None:
    for name, value in parameters.items():
        require(math.isfinite(value), f"{name} of the {family} distribution is {value!r}; it must be a finite number")


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Normal(Truncated):
    """Normal distribution of `mean` and `std` (before truncation)."""

    mean: float = 0.0
    std: float
    name = "normal"

    def check(self) -> None:
        _check_finite(self.name, mean=self.mean)
        _check_positive(self.name, std=self.std)

    @cached_property
    def _mass(self) -> float:
        low, high = ((bound - self.mean) / self.std for bound in self.support)
        if high < 0:
            return _above(-high) - _above(-low)
        return _above(low) - _above(high)

    def quantile(self, u: ArrayLike) -> Array:
        from scipy import special

        low, high = ((bound - self.mean) / self.std for bound in self.support)
        u = np.asarray(u, float)
        if low > 0:
            standard = -special.ndtri(special.ndtr(-low) - u * (special.ndtr(-low) - special.ndtr(-high)))
        else:
            standard = special.ndtri(special.ndtr(low) + u * (special.ndtr(high) - special.ndtr(low)))
        return np.clip(self.mean + self.std * standard, *self.support)


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Uniform(Truncated):
    """Every value between `lower` and `upper` alike."""

    name = "uniform"

    def check(self) -> None:
        _check_finite(self.name, lower=self.lower, upper=self.upper)

    def _tail(self, x: float) -> float:
        return (self.upper - x) / (self.upper - self.lower)

    def quantile(self, u: ArrayLike) -> Array:
        return self.lower + (self.upper - self.lower) * np.asarray(u, float)


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Triangular(Truncated):
    """Triangle from `minimum` over its peak `mode` to `maximum`."""

    minimum: float
    mode: float
    maximum: float
    name = "triangular"

    def check(self) -> None:
        _check_finite(self.name, minimum=self.minimum, mode=self.mode, maximum=self.maximum)
        require(
            self.minimum <= self.mode <= self.maximum and self.minimum < self.maximum,
            f"the triangular distribution has minimum {self.minimum:g}, mode {self.mode:g}, maximum {self.maximum:g}; "
            "they must come in this order",
        )

    @property
    def natural(self) -> tuple[float, float]:
        return self.minimum, self.maximum

    def _tail(self, x: float) -> float:
        width = self.maximum - self.minimum
        if x < self.mode:
            return 1 - (x - self.minimum) ** 2 / (width * max(self.mode - self.minimum, 1e-300))
        return (self.maximum - x) ** 2 / (width * max(self.maximum - self.mode, 1e-300))

    def _inverse_tail(self, q: Array) -> Array:
        width = self.maximum - self.minimum
        rising = self.minimum + np.sqrt(np.maximum(1 - q, 0) * width * (self.mode - self.minimum))
        falling = self.maximum - np.sqrt(q * width * (self.maximum - self.mode))
        return np.where(q > (self.maximum - self.mode) / width, rising, falling)


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Rayleigh(Truncated):
    """Length of a plane vector whose two components are normal with standard deviation `scale` about zero."""

    scale: float
    name = "rayleigh"
    natural = (0.0, INFINITY)

    def check(self) -> None:
        _check_positive(self.name, scale=self.scale)

    def _tail(self, x: float) -> float:
        return float(np.exp(-0.5 * (x / self.scale) ** 2))

    def _inverse_tail(self, q: Array) -> Array:
        length: Array = self.scale * np.sqrt(np.maximum(-2 * np.log(q), 0))
        return length


@names_keywords
@dataclass(frozen=True, kw_only=True)
class HalfNormal(Truncated):
    """Magnitude of a normal number of standard deviation `scale` about zero."""

    scale: float
    name = "half_normal"
    natural = (0.0, INFINITY)

    def check(self) -> None:
        _check_positive(self.name, scale=self.scale)

    def _tail(self, x: float) -> float:
        return 2 * _above(x / self.scale)

    def _inverse_tail(self, q: Array) -> Array:
        from scipy import special

        return -self.scale * special.ndtri(q / 2)


@names_keywords
@dataclass(frozen=True, kw_only=True)
class LogNormal(Truncated):
    """exp of a normal number: `median` of the value, `log_std` the standard deviation of its natural logarithm."""

    median: float
    log_std: float
    name = "lognormal"
    natural = (0.0, INFINITY)

    def check(self) -> None:
        _check_positive(self.name, median=self.median, log_std=self.log_std)

    def _tail(self, x: float) -> float:
        return _above((math.log(x) - math.log(self.median)) / self.log_std) if x > 0 else 1.0

    def _inverse_tail(self, q: Array) -> Array:
        from scipy import special

        return self.median * np.exp(-self.log_std * special.ndtri(q))


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Beta(Truncated):
    """Beta distribution of shapes `a`, `b`, stretched from [0, 1] to [`minimum`, `maximum`]."""

    a: float
    b: float
    minimum: float = 0.0
    maximum: float = 1.0
    name = "beta"

    def check(self) -> None:
        _check_positive(self.name, a=self.a, b=self.b)
        _check_finite(self.name, minimum=self.minimum, maximum=self.maximum)
        require(
            self.minimum < self.maximum,
            f"the beta distribution has minimum {self.minimum:g} and maximum {self.maximum:g}; "
            "minimum must be below maximum",
        )

    @property
    def natural(self) -> tuple[float, float]:
        return self.minimum, self.maximum

    def _tail(self, x: float) -> float:
        from scipy import special

        return float(special.betaincc(self.a, self.b, (x - self.minimum) / (self.maximum - self.minimum)))

    def _inverse_tail(self, q: Array) -> Array:
        from scipy import special

        share = np.asarray(special.betainccinv(self.a, self.b, q), float)
        return self.minimum + (self.maximum - self.minimum) * share


@names_keywords
@dataclass(frozen=True, kw_only=True)
class MeasuredSample(Truncated):
    """The values that were measured, drawn along the straight line between neighbours of the sorted sample.

    `values` of shape (n,), n >= 2; truncation drops the values outside the bounds.
    """

    values: ArrayLike = field(repr=False)
    source: str = "array"
    name = "measured sample"

    def check(self) -> None:
        values = np.asarray(self.values, float).ravel()
        require(
            bool(np.all(np.isfinite(values))),
            f"measured sample {self.source} holds a value that is not finite; remove it",
        )
        kept = np.sort(values[(values >= self.lower) & (values <= self.upper)])
        require(
            len(kept) >= 2 and kept[0] < kept[-1],
            f"measured sample {self.source} has {len(kept)} values in [{self.lower:g}, {self.upper:g}]; "
            "at least two different ones are needed",
        )
        object.__setattr__(self, "values", kept)

    @classmethod
    def from_csv(cls, path: str | Path, lower: float = -INFINITY, upper: float = INFINITY) -> MeasuredSample:
        """Read one number a line, with a decimal point or comma (a header line is allowed, `#` starts a comment)."""
        path = Path(path)
        try:
            lines = read_text(path, "a CSV text file", foreign=True).splitlines()
        except HdoptError as error:
            raise HdoptError(f"measured sample {path}: cannot be read ({error})") from error
        values: list[float] = []
        header_allowed = True
        for number, line in enumerate(lines, 1):
            cell = line.split("#")[0].strip().rstrip(",;\t ")
            if not cell:
                continue
            try:
                values.append(float(cell.replace(",", ".") if DECIMAL_COMMA.fullmatch(cell) else cell))
            except ValueError:
                require(
                    header_allowed and not cell.startswith(DIGITS),
                    f"measured sample {path}, line {number}: {shown(line)}; each line must hold one number",
                )
            header_allowed = False
        return cls(values=values, source=str(path), lower=lower, upper=upper)

    @cached_property
    def _kept(self) -> Array:
        """The values within the bounds, sorted, which `check` puts in place of those given."""
        return np.asarray(self.values, float)

    @property
    def natural(self) -> tuple[float, float]:
        return float(self._kept[0]), float(self._kept[-1])

    @cached_property
    def _mass(self) -> float:
        return 1.0

    def quantile(self, u: ArrayLike) -> Array:
        place = np.asarray(u, float) * (len(self._kept) - 1)
        return np.asarray(np.interp(place, np.arange(len(self._kept)), self._kept))


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Fixed:
    """An input that does not vary."""

    value: float
    name = "fixed"

    @property
    def support(self) -> tuple[float, float]:
        return self.value, self.value

    def quantile(self, u: ArrayLike) -> Array:
        return np.full(np.shape(u), float(self.value))


@names_keywords
@dataclass(frozen=True, kw_only=True)
class Scaled:
    """Another distribution, shrunk or stretched by `factor` about `centre`: what a changed tolerance does."""

    base: Distribution
    factor: float
    centre: float = 0.0

    @property
    def name(self) -> str:
        return self.base.name

    @property
    def support(self) -> tuple[float, float]:
        lower, upper = self.base.support
        return self.centre + self.factor * (lower - self.centre), self.centre + self.factor * (upper - self.centre)

    def quantile(self, u: ArrayLike) -> Array:
        return self.centre + self.factor * (self.base.quantile(u) - self.centre)


FAMILIES: dict[str, type] = {
    "normal": Normal,
    "uniform": Uniform,
    "triangular": Triangular,
    "rayleigh": Rayleigh,
    "half_normal": HalfNormal,
    "lognormal": LogNormal,
    "beta": Beta,
    "measured": MeasuredSample,
}
"""The families by the name a study file uses."""


def moments_of(distribution: Distribution, absolute: bool = False, points: int = 4096) -> tuple[float, float]:
    """Mean and standard deviation of the `distribution`, or of its `absolute` value, by the midpoint rule in
    probability with so many `points`.

    The rule's own error is about 1e-4 of the standard deviation for unbounded tails, less for bounded ones.
    """
    values = distribution.quantile((np.arange(points) + 0.5) / points)
    values = np.abs(values) if absolute else values
    return float(np.mean(values)), float(np.std(values))
