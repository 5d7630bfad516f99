"""Weights and wavelets compared, on the scenarios of Tables II to IV."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gmwm.study.scenario import TABLE_2, TABLE_3, TABLE_4, Scenario

_METHODS: Mapping[str, Mapping[str, Any]] = {
    "model": {},
    "diagonal": {"omega": "diagonal"},
    "identity": {"omega": "identity"},
    "data": {"omega": "data"},
    "db2": {"wavelet": "db2"},
    "db2 data": {"wavelet": "db2", "omega": "data"},
    "robust": {"robust": True},
}

_NOTES = (
    "model, diagonal, identity, data: weights of Haar wavelet variances; model is the default. "
    "db2: the same as model and data with the Daubechies filter of four taps. robust: model "
    "weights of robust Haar variances (efficiency 0.6).",
)


def _compared(scenario: Scenario, number: int, runs: int) -> Scenario:
    title = scenario.title.split(": ", 1)[1]
    return replace(
        scenario,
        name=f"weights{number}",
        title=f"Weights and wavelets, Table {'I' * number if number < 4 else 'IV'}: {title}",
        runs=runs,
        methods=_METHODS,
        notes=_NOTES,
    )


WEIGHTS = (
    _compared(TABLE_2, 2, 200),
    _compared(TABLE_3, 3, 200),
    _compared(TABLE_4, 4, 50),
)
