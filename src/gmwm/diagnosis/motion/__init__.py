"""Whether a recording was static, and when."""

from gmwm.diagnosis.motion.motion import Motion, Move, find_motion, is_moved_with
from gmwm.diagnosis.motion.notices import motion_notices

__all__ = ["Motion", "Move", "find_motion", "is_moved_with", "motion_notices"]
