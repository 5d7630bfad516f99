"""How consistent a filter will be with given numbers, and why."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from annotated_types import MaxLen, MinLen

from gmwm._core.documents import Document, NoneIs, NotNegative, Text
from gmwm._core.tables import cell, frame, plain_table
from gmwm._core.text import Printed, bullets, wrapped
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.result import SensorNumbers, shown_unit
from gmwm.issues import Notice

if TYPE_CHECKING:
    import pandas

CONSUMERS = {
    "free": f"Without aiding, after {tuning.SETTLING:g} s of fixes every {tuning.FIX_INTERVAL:g} s",
    "outage": "INS/GNSS filter, at the end of an outage",
    "keyframes": "Relative pose between keyframes",
}
"""Users of the numbers."""

_OrNaN = Annotated[NotNegative, NoneIs(float("nan"))]


@dataclass(frozen=True)
class Check:
    """Predicted error beside the true one.

    consumer: {"free", "outage", "keyframes"}.
    where: The channel, or "horizontal".
    quantity: Of the error.
    time: Without aiding, s.
    true, believed: Standard deviations.
    nees: Normalised error squared per degree of freedom: of all integrals of a channel, or of the
        position.
    """

    consumer: Text
    where: Text
    quantity: Text
    unit: Text
    time: NotNegative
    true: _OrNaN
    believed: _OrNaN
    nees: _OrNaN


@dataclass(frozen=True)
class Cause:
    """A cause of larger numbers of a kind of sensor.

    quantity: {"gyro", "accel", ""}.
    N, K: That dominate with it, for all axes, u/sqrt(Hz) and u/s/sqrt(Hz).
    N_factor, K_factor: Of "error model" and "all together", over the numbers in use; of the others,
        over those of the error model.
    """

    quantity: Text
    name: Text
    N: _OrNaN
    K: _OrNaN
    N_factor: _OrNaN
    K_factor: _OrNaN


@dataclass(frozen=True, repr=False)
class Certificate(Document, Printed):
    """How consistent a filter will be with given numbers, and why.

    Attributes
    ----------
    numbers : SensorNumbers
        In use.
    recommended : SensorNumbers
        With which a filter is never overconfident about the error model.
    checks : tuple of Check
    causes : tuple of Cause
    notices : tuple of Notice
    """

    SCHEMA: ClassVar[str] = "gmwm.certificate"

    numbers: SensorNumbers
    recommended: SensorNumbers
    checks: Annotated[tuple[Check, ...], MinLen(1), MaxLen(10_000)]
    causes: Annotated[tuple[Cause, ...], MaxLen(1000)]
    notices: tuple[Notice, ...] = ()

    def of(self, consumer: str) -> tuple[Check, ...]:
        """The checks of a consumer; see `CONSUMERS`."""
        return tuple(check for check in self.checks if check.consumer == consumer)

    @property
    def worst(self) -> Check:
        """The check with the largest NEES."""
        return max(self.checks, key=lambda check: check.nees)

    def __repr__(self) -> str:
        worst = self.worst
        return (
            f"<Certificate of {self.numbers.source or 'numbers'}: NEES up to {worst.nees:.3g}, "
            f"{worst.where} after {worst.time:g} s>"
        )

    def __str__(self) -> str:
        return self.text()

    def text(self, units: str = "field") -> str:
        """The text of `print`, numbers in data-sheet units or, with ``"si"``, in SI.

        Raises
        ------
        InputError
            If the units are neither.
        """
        lines = [f"Numbers in use: {self.numbers.source or 'given'}"]
        for consumer, title in CONSUMERS.items():
            rows = [
                [
                    c.where,
                    f"{c.quantity} [{c.unit}]",
                    f"{c.time:g}",
                    cell(c.true),
                    cell(c.believed),
                    cell(c.nees, 3),
                ]
                for c in self.of(consumer)
            ]
            if rows:
                heads = ["", "", "time [s]", "true", "believed", "NEES/dof"]
                lines += ["", title, plain_table(heads, rows)]
        for quantity in dict.fromkeys(cause.quantity for cause in self.causes):
            lines += ["", *self._covered(quantity, units)]
        if self.causes:
            time = self.recommended.horizon
            note = (
                f"Each row below the first has N and K for {time:g} s without aiding that are "
                "never overconfident for the error model together with the row's cause. The "
                "factors are over those in use, and over those of the error model alone. Use N "
                "and K as a pair: a factor can be below 1."
            )
            lines += ["", *wrapped(note)]
        lines += bullets(self.notices)
        return "\n".join([*lines, "", "Recommended: " + self.recommended.text(units)])

    def _covered(self, quantity: str, units: str) -> list[str]:
        """The table of causes of a kind of sensor: the first is in use, the second the model."""
        causes = [cause for cause in self.causes if cause.quantity == quantity]
        (N, n_scale), (K, k_scale) = (shown_unit(letter, quantity, units) for letter in "NK")
        rows = [
            [
                cause.name,
                cell(cause.N, scale=n_scale),
                cell(cause.K, scale=k_scale),
                *(
                    cell(value / by if by > 0.0 else float("inf"), 3)
                    for other in causes[:2]
                    for value, by in ((cause.N, other.N), (cause.K, other.K))
                ),
            ]
            for cause in causes
        ]
        over = [f"{letter} over\n{what}" for what in ("in use", "model") for letter in "NK"]
        return [
            f"{quantity or 'axis'}, all axes: N [{N}] and K [{K}] have to cover",
            plain_table(["", "N", "K", *over], rows),
        ]

    def to_frame(self) -> pandas.DataFrame:
        """A table of the checks; needs pandas."""
        return frame((asdict(check) for check in self.checks), tuple(Check.__annotations__))
