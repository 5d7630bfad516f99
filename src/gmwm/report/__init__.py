"""The self-contained HTML report of a calibration; opens without a network."""

from gmwm.report.calibration import fragment, write_report
from gmwm.report.datasheet import read_datasheet
from gmwm.report.navigated import write_comparison_report, write_navigated_report
from gmwm.report.several.compared import write_sensor_comparison_report
from gmwm.report.several.fleet import fleet_fragment, write_fleet_report
from gmwm.report.text import duration_text
from gmwm.report.validation import write_validation_report

__all__ = [
    "duration_text",
    "fleet_fragment",
    "fragment",
    "read_datasheet",
    "write_comparison_report",
    "write_fleet_report",
    "write_navigated_report",
    "write_report",
    "write_sensor_comparison_report",
    "write_validation_report",
]
