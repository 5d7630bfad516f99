"""Forms of stored results: what each key must hold, or one sentence about the first that does not.

pydantic checks types, ranges and sizes; what belongs together is checked by the forms themselves.
Keys that a form does not declare pass as they are.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from gmwm._core import checks
from gmwm._core.documents import check_covariance, validation_sentence
from gmwm.errors import InputError, printable
from gmwm.issues import SEVERITIES


class Form(BaseModel):
    """A mapping of declared keys."""

    model_config = ConfigDict(strict=True, extra="allow", allow_inf_nan=False)

    @classmethod
    def checked(cls, content: Mapping[str, Any]) -> dict[str, Any]:
        """The content, with texts on one line.

        Raises InputError with the place of the first thing that cannot be used.
        """
        if not isinstance(content, Mapping):
            raise InputError(f"{checks.shown(content)} has no keys")
        try:
            return cls.model_validate(dict(content)).model_dump()
        except ValidationError as error:
            raise InputError(validation_sentence(error)) from None


Text = Annotated[str, Field(max_length=10_000), AfterValidator(printable)]
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Discrepancy = Annotated[float, Field(ge=0.0, le=1000.0)]
"""Relative; what is off by more has nothing of the model."""
Fraction = Annotated[float, Field(gt=0.0, lt=1.0)]
Samples = Annotated[int, Field(ge=1, le=checks.MOST_SAMPLES)]
Freedom = Annotated[int, Field(ge=-checks.MOST_SAMPLES, le=checks.MOST_SAMPLES)]
"""Degrees of freedom of a fit; negative where it has more parameters than moments."""
Rate = Annotated[float, Field(ge=1.0 / checks.LONGEST_INTERVAL, le=1.0 / checks.SHORTEST_INTERVAL)]
Interval = Annotated[float, Field(ge=checks.SHORTEST_INTERVAL, le=checks.LONGEST_INTERVAL)]
Keys = Annotated[Sequence[Text], Field(max_length=1000)]
Model = Annotated[Sequence[dict[str, Any]], Field(min_length=1, max_length=1000)]
"""Terms as `gmwm.process` writes them, and reads them with checks of its own."""


def _severity(text: str) -> str:
    if text not in SEVERITIES:
        raise ValueError(f"{checks.shown(text)} is no severity")
    return text


class NoticeForm(Form):
    """Of `Notice`."""

    code: Text
    severity: Annotated[str, AfterValidator(_severity)]
    where: Text
    text: Text
    values: dict[Text, bool | int | float | Text | None]
    hint: Text
    source: Text


Notices = Annotated[Sequence[NoticeForm], Field(max_length=100_000)]

covariance = check_covariance
