"""Notices; see `gmwm.issues`."""

from gmwm.issues import (
    SEVERITIES as SEVERITIES,
    Notice as Notice,
    Severity as Severity,
    worst_first as worst_first,
)
