"""Error growth of unaided navigation, in closed form."""

from gmwm.budget.budget import (
    FIELD_UNITS,
    HORIZONTAL,
    QUANTITIES,
    ErrorBudget,
    ErrorRow,
    axis,
    per_si,
    root_sum,
    short,
)
from gmwm.budget.coasting import TIMES, error_budget

__all__ = [
    "FIELD_UNITS",
    "HORIZONTAL",
    "QUANTITIES",
    "TIMES",
    "ErrorBudget",
    "ErrorRow",
    "axis",
    "error_budget",
    "per_si",
    "root_sum",
    "short",
]
