"""Samples that are missing, and numbers that stand for them."""

from gmwm.readers.missing.sentinels import without_sentinels as without_sentinels
from gmwm.readers.missing.tally import Missing as Missing, missing_notices as missing_notices
