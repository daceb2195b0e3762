"""Measured quantities, what they should be, and the bands in which they must lie."""

from __future__ import annotations

import dataclasses
import math


@dataclasses.dataclass
class Check:
    """A measured quantity of a case. `low` and `high` are the band; infinite ones only record the value."""

    case: str
    quantity: str
    value: float
    low: float = -math.inf
    high: float = math.inf
    expected: float | None = None

    def __post_init__(self):
        self.value, self.low, self.high = float(self.value), float(self.low), float(self.high)
        self.expected = None if self.expected is None else float(self.expected)

    @property
    def recorded(self) -> bool:
        """Has no band."""
        return self.low == -math.inf and self.high == math.inf

    @property
    def passed(self) -> bool:
        return self.low <= self.value <= self.high  # false for NaN

    @property
    def error(self) -> float | None:
        """Relative to the expected value; the value itself where zero is expected."""
        if self.expected is None:
            return None
        return self.value / self.expected - 1 if self.expected else self.value

    def row(self) -> list[str]:
        expected = "-" if self.expected is None else f"{self.expected:.6g}"
        error = "-" if self.error is None else f"{self.error:+.3%}" if self.expected else f"{self.error:+.1e}"
        band = "-" if self.recorded else f"{self.low:.6g} to {self.high:.6g}"
        verdict = "NO" if not self.passed else "" if self.recorded else "yes"
        return [self.case, self.quantity, f"{self.value:.6g}", expected, error, band, verdict]


def near(case: str, quantity: str, value: float, expected: float, share: float) -> Check:
    """The value must be within a share of the expected one."""
    margin = share * abs(expected)
    return Check(case, quantity, value, expected - margin, expected + margin, expected)


def below(case: str, quantity: str, value: float, limit: float) -> Check:
    """The value, which cannot be negative, must be at most so large."""
    return Check(case, quantity, value, 0.0, limit)


def record(case: str, quantity: str, value: float, expected: float | None = None) -> Check:
    """The value is shown, and no band holds it."""
    return Check(case, quantity, value, expected=expected)


def holds(case: str, quantity: str, statement: bool) -> Check:
    """A statement that must be true: 1."""
    return Check(case, quantity, float(statement), 1.0, 1.0)


def observed_order(sizes: list[float], errors: list[float]) -> float:
    """Slope of log(error) over log(size), by least squares."""
    x, y = [math.log(size) for size in sizes], [math.log(abs(error)) for error in errors]
    mean_x, mean_y = sum(x) / len(x), sum(y) / len(y)
    return (sum((a - mean_x) * (b - mean_y) for a, b in zip(x, y)) / sum((a - mean_x) ** 2 for a in x))
