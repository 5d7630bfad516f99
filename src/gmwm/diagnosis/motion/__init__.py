"""Whether a recording was static, and when."""

from gmwm.diagnosis.motion.motion import (
    Motion as Motion,
    Move as Move,
    find_motion as find_motion,
    is_moved_with as is_moved_with,
    remembered as remembered,
)
from gmwm.diagnosis.motion.notices import motion_notices as motion_notices
