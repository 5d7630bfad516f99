"""What sensors at rest read, and what belies it."""

from gmwm.readers.at_rest.rotation import (
    TurningGravity,
    block_means,
    steady_turn,
    turning_gravity,
)
from gmwm.readers.at_rest.sensors import rest_notices

__all__ = ["TurningGravity", "block_means", "rest_notices", "steady_turn", "turning_gravity"]
