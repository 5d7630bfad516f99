"""Time stamps: a rate, and the sample number of every row."""

from gmwm.readers.clock.civil_time import (
    is_time_of_day as is_time_of_day,
    seconds_of_day as seconds_of_day,
    without_summer_time as without_summer_time,
)
from gmwm.readers.clock.clock_notices import (
    CLOCK_CODES as CLOCK_CODES,
    change_notice as change_notice,
)
from gmwm.readers.clock.jumps import Jumps as Jumps
from gmwm.readers.clock.stamps import Clock as Clock, repeated_notice as repeated_notice
from gmwm.readers.clock.timing import (
    Timing as Timing,
    agree as agree,
    check_rates as check_rates,
    timing_of as timing_of,
)
from gmwm.readers.clock.unit_of_time import without_unit as without_unit
