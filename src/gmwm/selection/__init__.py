"""Which model: a ranking of candidates, what ties, what is chosen."""

from gmwm.selection.select import Selection, select
from gmwm.selection.ties import wider_ranges

__all__ = [
    "Selection",
    "select",
    "wider_ranges",
]
