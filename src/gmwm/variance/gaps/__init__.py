"""Missing samples: runs between them, which of them are filled at which level, and its effects."""

from gmwm.variance.gaps.effects import GapEffects as GapEffects, Runs as Runs
