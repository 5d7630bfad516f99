"""Which model: a ranking of candidates, what ties, what is chosen."""

from gmwm.selection.ranking import penalty as penalty
from gmwm.selection.select import Selection as Selection, select as select
from gmwm.selection.ties import wider_ranges as wider_ranges
