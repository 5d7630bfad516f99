"""A fit in JSON types, and back."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from gmwm._core.notices import Notice
from gmwm.errors import InputError
from gmwm.estimate.result.region import Region
from gmwm.process import model_from_list
from gmwm.variance import WaveletVariance


def fit_content(fit: Any) -> dict[str, Any]:
    """What a fit cannot be rebuilt without."""
    return {
        "model": [term.to_dict() for term in fit.model.terms],
        "keys": list(fit.keys),
        "covariance": fit.covariance.tolist(),
        "upper_bounds": {key: plain(bound) for key, bound in fit.upper_bounds.items()},
        "objective": fit.objective,
        "chi_square": plain(fit.chi_square),
        "chi_square_allowed": plain(fit.chi_square_allowed),
        "dof": fit.dof,
        "discrepancy": fit.discrepancy,
        "method": fit.method,
        "weights": fit.weights,
        "notices": [notice.to_dict() for notice in fit.notices],
        "log_likelihood": plain(fit.log_likelihood),
        "trace": list(fit.trace),
        "slope_dof": plain(fit.slope_dof),
        "regions": [asdict(region) for region in fit.regions],
        "wavelet_variance": fit.wv.to_dict(),
    }


def plain(value: float) -> float | None:
    """A number for JSON, which knows no infinity and no NaN."""
    return value if np.isfinite(value) else None


def fields_of(content: Mapping[str, Any]) -> dict[str, Any]:
    """The fields of a fit, from what `fit_content` made and `FitForm` checked.

    Raises InputError if parts of it do not belong together.
    """
    model = model_from_list(content["model"])
    params = {key: value or 0.0 for key, value in model.params.items()}
    unknown = set(content["keys"]) - set(params)
    if model.is_open or unknown or content["params"] != params:
        raise InputError(f"its model {model!r} and its parameters do not belong together")
    p = len(content["keys"])
    infinity = float("inf")
    return {
        "model": model,
        "wv": WaveletVariance.from_dict(content["wavelet_variance"]),
        "keys": tuple(content["keys"]),
        "covariance": np.array(content["covariance"], dtype=float).reshape(p, p),
        "upper_bounds": {
            key: or_nan(bound, infinity) for key, bound in content["upper_bounds"].items()
        },
        "objective": or_nan(content["objective"]),
        "chi_square": or_nan(content["chi_square"]),
        "chi_square_allowed": or_nan(content["chi_square_allowed"]),
        "dof": content["dof"],
        "discrepancy": content["discrepancy"],
        "method": content["method"],
        "weights": content["weights"],
        "notices": tuple(map(Notice.from_dict, content["notices"])),
        "log_likelihood": or_nan(content["log_likelihood"]),
        "trace": tuple(content["trace"]),
        "slope_dof": or_nan(content["slope_dof"], infinity),
        "regions": tuple(Region(**region) for region in content["regions"]),
    }


def or_nan(value: float | None, missing: float = float("nan")) -> float:
    """A stored number, or what stands for it where there is none."""
    return missing if value is None else value
