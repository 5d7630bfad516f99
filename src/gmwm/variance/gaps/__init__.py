"""Missing samples: runs between them, which of them are filled at which level, and its effects."""

from gmwm.variance.gaps.effects import GapEffects, Runs

__all__ = ["GapEffects", "Runs"]
