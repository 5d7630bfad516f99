from .calibration import (
    error_model as error_model,
    fragment as fragment,
    write_report as write_report,
)
from .fleet import (
    write_fleet_report as write_fleet_report,
    write_sensor_comparison_report as write_sensor_comparison_report,
)
from .health import verdict as verdict
from .navigation import (
    write_comparison_report as write_comparison_report,
    write_motion_report as write_motion_report,
    write_navigated_report as write_navigated_report,
    write_validation_report as write_validation_report,
)
from .numbers import write_sheet_report as write_sheet_report
from .page import duration_text as duration_text
from .summary import filter_key as filter_key, summary_text as summary_text
