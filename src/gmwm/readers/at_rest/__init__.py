"""What sensors at rest read, and what belies it."""

from gmwm.readers.at_rest.in_turns import turn_notices as turn_notices
from gmwm.readers.at_rest.rotation import (
    TurningGravity as TurningGravity,
    block_means as block_means,
    steady_turn as steady_turn,
    turning_gravity as turning_gravity,
)
from gmwm.readers.at_rest.sensors import rest_notices as rest_notices
