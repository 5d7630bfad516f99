"""All scenarios by name."""

from __future__ import annotations

from gmwm.study.scenario import FIVE, TABLE_2, TABLE_3, TABLE_4
from gmwm.study.weights import WEIGHTS

SCENARIOS = {s.name: s for s in (TABLE_2, TABLE_3, TABLE_4, FIVE, *WEIGHTS)}
