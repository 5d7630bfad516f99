"""How consistent a filter will be with given numbers, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, ClassVar, Self

from gmwm._core.documents import Document
from gmwm._core.frames import frame
from gmwm._core.notices import Notice
from gmwm._core.text import Printed, bullets, wrapped
from gmwm.filter_numbers import tuning
from gmwm.filter_numbers.result import SensorNumbers, restored, stored
from gmwm.filter_numbers.table import shown_unit

if TYPE_CHECKING:
    import pandas

    from gmwm._core.forms import Form

CONSUMERS = {
    "free": f"Without aiding, after {tuning.SETTLING:g} s of fixes every {tuning.FIX_INTERVAL:g} s",
    "outage": "INS/GNSS filter, at the end of an outage",
    "keyframes": "Relative pose between keyframes",
}
"""Who uses the numbers."""


@dataclass(frozen=True)
class Check:
    """Error that a filter believes beside the true one.

    consumer: {"free", "outage", "keyframes"}.
    where: The channel, or "horizontal".
    quantity: What is in error.
    time: Without aiding, s.
    true, believed: Standard deviations.
    nees: Normalised error squared per degree of freedom: of all integrals of a channel, or of the
        position.
    """

    consumer: str
    where: str
    quantity: str
    unit: str
    time: float
    true: float
    believed: float
    nees: float


@dataclass(frozen=True)
class Cause:
    """What makes the numbers of a kind of sensor larger.

    quantity: {"gyro", "accel", ""}.
    N, K: That dominate with it, for all axes, u/sqrt(Hz) and u/s/sqrt(Hz).
    N_factor, K_factor: Of "error model" and "all together", over the numbers in use; of the others,
        over those of the error model.
    """

    quantity: str
    name: str
    N: float
    K: float
    N_factor: float
    K_factor: float


@dataclass(frozen=True, repr=False)
class Certificate(Document, Printed):
    """How consistent a filter will be with given numbers, and why.

    Attributes
    ----------
    numbers : SensorNumbers
        In use.
    recommended : SensorNumbers
        With which a filter is never too optimistic about the error model.
    checks : tuple of Check
    causes : tuple of Cause
    notices : tuple of Notice
    """

    SCHEMA: ClassVar[str] = "gmwm.certificate"

    numbers: SensorNumbers
    recommended: SensorNumbers
    checks: tuple[Check, ...]
    causes: tuple[Cause, ...]
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
        """What `print` shows, numbers in the units of the field or, with ``"si"``, in SI.

        Raises
        ------
        InputError
            If the units are neither.
        """
        lines = [f"Numbers in use: {self.numbers.source or 'given'}"]
        for consumer, title in CONSUMERS.items():
            checks = self.of(consumer)
            if not checks:
                continue
            head = f"{'true':>11} {'believed':>11} {'NEES/dof':>9}"
            lines += ["", title, f"{'':<12}{'':<22}{'time [s]':>9} {head}"]
            for check in checks:
                what = f"{check.quantity} [{check.unit}]"
                lines.append(
                    f"{check.where:<12}{what:<22}{check.time:>9g} {check.true:>11.4g} "
                    f"{check.believed:>11.4g} {check.nees:>9.3g}"
                )
        for quantity in dict.fromkeys(cause.quantity for cause in self.causes):
            lines += ["", *self._covered(quantity, units)]
        if self.causes:
            time = self.recommended.horizon
            lines += ["", *wrapped(
                f"Each row below the first has N and K for {time:g} s without aiding that are "
                "never too optimistic for the error model together with what the row names, and "
                "their factors over those in use and over those of the error model alone. N and K "
                "belong together: a larger one pays for a smaller other, whose factor can be below "
                "1."
            )]  # fmt: skip
        lines += bullets(self.notices)
        return "\n".join([*lines, "", "Recommended: " + self.recommended.text(units)])

    def _covered(self, quantity: str, units: str) -> list[str]:
        """The table of causes of a kind of sensor: the first is in use, the second the model."""
        rows = [cause for cause in self.causes if cause.quantity == quantity]
        (N, n_scale), (K, k_scale) = (shown_unit(letter, quantity, units) for letter in "NK")
        lines = [
            f"{quantity or 'axis'}, all axes: what N [{N}] and K [{K}] have to cover",
            f"{'':<48}{'over in use':>16}{'over model':>16}",
            f"{'':<28}{'N':>10}{'K':>10}{'N':>8}{'K':>8}{'N':>8}{'K':>8}",
        ]
        for cause in rows:
            factors = [
                f"{_ratio(value, by):>8.3g}"
                for other in rows[:2]
                for value, by in ((cause.N, other.N), (cause.K, other.K))
            ]
            values = f"{cause.N * n_scale:>10.4g}{cause.K * k_scale:>10.4g}"
            lines.append(f"{cause.name:<28}{values}{''.join(factors)}")
        return lines

    def to_frame(self) -> pandas.DataFrame:
        """A table of the checks; needs pandas."""
        return frame((asdict(check) for check in self.checks), tuple(Check.__annotations__))

    # -- files ------------------------------------------------------------------------------------

    def content(self) -> dict[str, Any]:
        return {
            "numbers": self.numbers.to_dict(),
            "recommended": self.recommended.to_dict(),
            "checks": [stored(check) for check in self.checks],
            "causes": [stored(cause) for cause in self.causes],
            "notices": [notice.to_dict() for notice in self.notices],
        }

    @classmethod
    def document_form(cls) -> type[Form]:
        from gmwm.filter_numbers.form import CertificateForm

        return CertificateForm

    @classmethod
    def from_content(cls, content: Mapping[str, Any]) -> Self:
        return cls(
            numbers=SensorNumbers.from_dict(content["numbers"]),
            recommended=SensorNumbers.from_dict(content["recommended"]),
            checks=tuple(Check(**restored(each)) for each in content["checks"]),
            causes=tuple(Cause(**restored(each)) for each in content["causes"]),
            notices=tuple(map(Notice.from_dict, content["notices"])),
        )


def _ratio(value: float, by: float) -> float:
    return value / by if by > 0.0 else float("inf")
