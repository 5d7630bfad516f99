"""Numbers and durations as people write them."""

from __future__ import annotations

from gmwm._core.units import field_units, si_parameter_unit
from gmwm.process import Model

_DAY, _YEAR = 86400.0, 365.25 * 86400.0
_DAYS, _YEARS = 5.0, 2.0  # from which on durations are given so
_MANY_YEARS = 100.0


def duration_text(seconds: float) -> str:
    """A duration as people say it: ``40 s``, ``35 min``, ``2 h 46 min``, ``12 days``."""
    if seconds > _MANY_YEARS * _YEAR:
        return "centuries"
    if seconds >= _YEARS * _YEAR:
        return f"{seconds / _YEAR:.2g} years"
    if seconds >= _DAYS * _DAY:
        return f"{seconds / _DAY:.3g} days"
    if seconds < 120.0:
        return f"{seconds:.3g} s"
    minutes = round(seconds / 60.0)
    parts = zip(divmod(minutes, 60), ("h", "min"), strict=True)
    return " ".join(f"{count} {unit}" for count, unit in parts if count)


def model_text(model: Model, quantity: str) -> str:
    """A model's terms with their parameters, in the first unit of the field where there is one."""
    terms: dict[int, list[str]] = {}
    for item in model.parameters:
        unit, value = item.parameter.unit, float(item.value or 0.0)
        found = field_units(unit, quantity)
        shown, scale = (
            (found[0].unit, found[0].per_si) if found else (si_parameter_unit(unit, quantity), 1.0)
        )
        text = f"{item.parameter.name} {value * scale:.4g} {shown}".rstrip()
        terms.setdefault(item.term, []).append(text)
    labels = model.term_labels()
    return "; ".join(f"{labels[i]} {', '.join(texts)}" for i, texts in terms.items())


def needed(seconds: float | None, duration: float) -> str:
    """Length of record that a parameter needs, in words; empty if it was not estimated."""
    if seconds is None:
        return ""
    if seconds <= duration:
        return "long enough"
    if seconds == float("inf"):
        return "not identified"
    text = duration_text(seconds)
    return text if text == "centuries" else f"needs {text}"
