"""Fits from the JSON types that they were stored in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from typing import Any

import numpy as np

from gmwm import checks
from gmwm.errors import InputError
from gmwm.estimate.fit import METHOD_NAMES, Fit
from gmwm.estimate.joint import JointFit
from gmwm.estimate.region import Region
from gmwm.process import model_from_list
from gmwm.variance.pooled import PooledVariance
from gmwm.variance.wavelet import WaveletVariance

_MEND = "give what to_dict of a fit made"


def fit_from_dict(content: Mapping[str, Any]) -> Fit:
    """Inverse of `gmwm.Fit.to_dict`; a `JointFit` if it was one.

    Raises
    ------
    InputError
        If the content is no fit, or a damaged one.
    """
    if not isinstance(content, Mapping):
        raise InputError(f"{checks.shown(content)} is no fit: {_MEND}")
    try:
        return _joint(content) if "parts" in content else _single(content)
    except InputError:
        raise
    except KeyError as error:
        raise InputError(f"the fit is damaged, it has no {error}: {_MEND}") from None
    except (TypeError, ValueError, AttributeError) as error:
        raise InputError(f"the fit is damaged ({error}): {_MEND}") from None


def _single(content: Mapping[str, Any]) -> Fit:
    model = model_from_list(content["model"])
    params = {key: value or 0.0 for key, value in model.params.items()}
    unknown = set(content["keys"]) - set(params)
    if model.is_open or unknown or content["params"] != params:
        raise InputError(f"its model {model!r} and its parameters do not belong together: {_MEND}")
    p = len(content["keys"])
    return Fit(
        model=model,
        wv=WaveletVariance.from_dict(content["wavelet_variance"]),
        keys=tuple(content["keys"]),
        covariance=np.array(content["covariance"], dtype=float).reshape(p, p),
        upper_bounds={
            key: _number(key, bound, float("inf")) for key, bound in content["upper_bounds"].items()
        },
        objective=_number("objective", content["objective"]),
        dof=_number("dof", content["dof"], kind=int),
        discrepancy=_number("discrepancy", content["discrepancy"]),
        p_value=_number("p_value", content["p_value"]),
        method=checks.choice("method", content["method"], tuple(METHOD_NAMES)),
        omega=content["omega"],
        valid=checks.truth("valid", content["valid"]),
        remarks=tuple(map(str, content["remarks"])),
        log_likelihood=_number("log_likelihood", content.get("log_likelihood")),
        trace=tuple(_number("trace", value) for value in content.get("trace", ())),
        slope_dof=_number("slope_dof", content.get("slope_dof"), float("inf")),
        error_growth={
            key: _number(key, power) for key, power in content.get("error_growth", {}).items()
        },
        regions=tuple(Region(**region) for region in content.get("regions", ())),
    )


def _joint(content: Mapping[str, Any]) -> JointFit:
    whole = _single(content)
    parts = tuple(fit_from_dict(part) for part in content["parts"])
    values = {f.name: getattr(whole, f.name) for f in fields(Fit)}
    values["wv"] = PooledVariance.of([part.wv for part in parts])
    return JointFit(
        **values,
        parts=parts,
        equality_p=_number("equality_p", content["equality_p"]),
        curves_p=_number("curves_p", content.get("curves_p")),
        spread={key: _number(key, value) for key, value in content["spread"].items()},
    )


def _number(name: str, value: Any, missing: float = float("nan"), kind: type = float) -> Any:
    """A stored number; what stands for it where it is none."""
    if value is None:
        return missing
    if not checks.is_number(value):
        raise InputError(f"{name} = {checks.shown(value)} is no number: {_MEND}")
    return kind(value)
