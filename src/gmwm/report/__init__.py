"""The self-contained HTML report of a calibration; opens without a network."""

from gmwm.report.page import write_report

__all__ = ["write_report"]
