"""Medians, quartiles and tests of significance of the experiments' rows."""

from collections.abc import Iterable, Sequence

import numpy as np
from scipy.stats import mannwhitneyu, wilcoxon

from gcs.experiments.experiment import Cell, Row


def select(rows: Iterable[Row], **values: Cell) -> list[Row]:
    """Rows with these values."""
    return [row for row in rows if all(row[column] == value for column, value in values.items())]


def numbers(rows: Iterable[Row], column: str) -> list[float]:
    """Values of a column, where there are any."""
    return [float(cell) for row in rows if isinstance(cell := row[column], int | float)]


def share(rows: Sequence[Row], column: str) -> float:
    """Share of rows in which a column is true."""
    return sum(row[column] is True for row in rows) / len(rows)


def quartiles(values: Sequence[float]) -> tuple[float, float, float]:
    """First quartile, median and third quartile."""
    low, middle, high = np.quantile(values, (0.25, 0.5, 0.75))
    return float(low), float(middle), float(high)


def spread(values: Sequence[float], form: str = ".1f") -> str:
    """Median and quartiles as text, each in such a format; a dash where there is nothing."""
    if not values:
        return "–"
    low, middle, high = quartiles(values)
    return f"{middle:{form}} [{low:{form}}, {high:{form}}]"


def rank_sum_p(one: Sequence[float], other: Sequence[float]) -> float | None:
    """p-value of Wilcoxon's rank-sum test, two-sided: None where there are too few values to tell anything.

    Equal seeds of two algorithms have nothing in common, so the samples are independent, not paired.
    """
    if min(len(one), len(other)) < 2:
        return None
    if len(set(one) | set(other)) == 1:
        return 1.0
    return float(mannwhitneyu(one, other, alternative="two-sided").pvalue)


def signed_rank_p(one: Sequence[float], other: Sequence[float]) -> float | None:
    """p-value of Wilcoxon's signed-rank test of pairs, two-sided: None where there are too few to tell anything."""
    differences = np.subtract(one, other)
    if np.count_nonzero(differences) < 2:
        return None
    return float(wilcoxon(differences, alternative="two-sided").pvalue)


def significance(p: float | None) -> str:
    """A p-value as text."""
    if p is None:
        return "–"
    return "< 0.001" if p < 0.001 else f"{p:.3f}"
