"""Samples that were not measured: they repeat others, or lie between them."""

from gmwm.diagnosis.unmeasured.copies import (
    Copy as Copy,
    copies_notice as copies_notice,
    find_copies as find_copies,
    first_in_common as first_in_common,
)
from gmwm.diagnosis.unmeasured.repeated import (
    held_notice as held_notice,
    held_share as held_share,
    interpolation_notice as interpolation_notice,
    leaves_runs as leaves_runs,
    repetition as repetition,
    repetition_notice as repetition_notice,
    thinned as thinned,
)
