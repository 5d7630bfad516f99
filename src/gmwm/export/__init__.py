"""Calibrations in the form that other programs want, one file per consumer."""

from gmwm.export.kalibr import write_kalibr

__all__ = ["write_kalibr"]
