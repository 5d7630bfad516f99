"""Whether a recording was static, and when."""

from gmwm.diagnosis.motion.motion import Motion, Move, find_motion
from gmwm.diagnosis.motion.notices import motion_notices

__all__ = ["Motion", "Move", "find_motion", "motion_notices"]
