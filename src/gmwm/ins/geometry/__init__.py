"""The Earth and rotations."""

from gmwm.ins.geometry.earth import (
    ECCENTRICITY_SQUARED as ECCENTRICITY_SQUARED,
    RATE as RATE,
    SEMI_MAJOR_AXIS as SEMI_MAJOR_AXIS,
    STANDARD_GRAVITY as STANDARD_GRAVITY,
    gravity as gravity,
    gravity_at as gravity_at,
    ned_difference as ned_difference,
    offset as offset,
    radii as radii,
    radii_along as radii_along,
    radii_at as radii_at,
)
from gmwm.ins.geometry.rotation import (
    angles as angles,
    matrix_from_rotation_vector as matrix_from_rotation_vector,
    matrix_from_rpy as matrix_from_rpy,
    orthonormalise as orthonormalise,
    rotate as rotate,
    rotation_coefficients as rotation_coefficients,
    rpy_from_matrix as rpy_from_matrix,
    skew as skew,
    turn_body as turn_body,
    turn_navigation as turn_navigation,
)
