"""Error growth of unaided navigation, in closed form."""

from gmwm.budget.budget import (
    FIELD_UNITS as FIELD_UNITS,
    HORIZONTAL as HORIZONTAL,
    QUANTITIES as QUANTITIES,
    ErrorBudget as ErrorBudget,
    ErrorRow as ErrorRow,
    axis as axis,
    per_si as per_si,
    root_sum as root_sum,
)
from gmwm.budget.coasting import (
    TIMES as TIMES,
    error_budget as error_budget,
    is_steep as is_steep,
)
