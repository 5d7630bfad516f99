"""What a stored selection holds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from gmwm._core.forms import Form, Freedom, Model, NotNegative


class CandidateForm(Form):
    """Of `Candidate`."""

    model: Model
    criterion: float
    objective: NotNegative
    chi_square: NotNegative
    n_parameters: Annotated[int, Field(ge=1, le=1_000_000)]
    dof: Freedom
    compared_only: bool = False


class SelectionForm(Form):
    """Of `Selection`; the fit has a form of its own."""

    ranking: Annotated[Sequence[CandidateForm], Field(min_length=1, max_length=10_000)]
    chosen: Annotated[int, Field(ge=0)]
    fit: dict[str, Any]

    @model_validator(mode="after")
    def _together(self) -> Self:
        if self.chosen >= len(self.ranking):
            raise ValueError("the chosen model is not in the ranking")
        return self
