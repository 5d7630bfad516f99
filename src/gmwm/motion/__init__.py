"""Noise of IMUs in motion, measured from several on one rigid body."""

from gmwm.motion.clocks import Clock as Clock
from gmwm.motion.curves import between as between
from gmwm.motion.mapping import Mounting as Mounting
from gmwm.motion.motion import motion as motion
from gmwm.motion.result import InMotion as InMotion, MotionCurve as MotionCurve
from gmwm.motion.tuning import HORIZON as HORIZON, INTERVAL as INTERVAL, USES as USES
