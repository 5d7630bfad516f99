"""The Earth and rotations."""

from gmwm.ins.geometry.earth import (
    ECCENTRICITY_SQUARED,
    RATE,
    SEMI_MAJOR_AXIS,
    STANDARD_GRAVITY,
    gravity,
    gravity_at,
    ned_difference,
    offset,
    radii,
    radii_along,
    radii_at,
)
from gmwm.ins.geometry.rotation import (
    angles,
    matrix_from_rotation_vector,
    matrix_from_rpy,
    orthonormalise,
    rotate,
    rotation_coefficients,
    rpy_from_matrix,
    turn_body,
    turn_navigation,
)

__all__ = [
    "ECCENTRICITY_SQUARED",
    "RATE",
    "SEMI_MAJOR_AXIS",
    "STANDARD_GRAVITY",
    "angles",
    "gravity",
    "gravity_at",
    "matrix_from_rotation_vector",
    "matrix_from_rpy",
    "ned_difference",
    "offset",
    "orthonormalise",
    "radii",
    "radii_along",
    "radii_at",
    "rotate",
    "rotation_coefficients",
    "rpy_from_matrix",
    "turn_body",
    "turn_navigation",
]
