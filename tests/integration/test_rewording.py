"""Programs never read English: with every text of a notice changed, no number moves."""

import json

import numpy as np
import pytest

import gmwm
from gmwm import GaussMarkov, RandomWalk, RateRamp, Sinusoid, WhiteNoise
from gmwm.issues import Notice

TRUTH = WhiteNoise(1.0) + RandomWalk(0.01)
UNITS = {"gyro": "rad/s", "accel": "m/s^2"}


def recording():
    """One channel with a shock and a line, one whose best model is ambiguous, one dead."""
    n = 6000
    gyro = TRUTH.simulate(n, 0.01, 1) + Sinusoid(3.0, 7.0).simulate(n, 0.01, 2)
    gyro[3000:3010] += 300.0
    accel = (WhiteNoise(1.0) + GaussMarkov(1.0, 1.0) + GaussMarkov(2.0, 4.0)).simulate(n, 0.01, 3)
    return gmwm.Recording.from_arrays(
        {"gyro_x": gyro, "accel_x": accel, "accel_y": np.ones(n)}, 100.0, UNITS
    )


def numbers(content):
    """A document without the texts of its notices."""
    if isinstance(content, dict):
        return {k: numbers(v) for k, v in content.items() if k not in ("text", "hint")}
    return [numbers(item) for item in content] if isinstance(content, list) else content


def results():
    drifting = (TRUTH + RateRamp(3e-3)).simulate(800, 1.0, 4)
    fits = [
        gmwm.fit(WhiteNoise() + RandomWalk() + RateRamp(), drifting, 1.0, method=method)
        for method in ("gmwm", "mle", "em")
    ]
    fits.append(gmwm.fit(WhiteNoise() + 2 * GaussMarkov(), drifting, 1.0))
    fits.append(gmwm.fit(WhiteNoise() + RandomWalk(), drifting, 1.0, method="allan"))
    documents = [fit.to_dict() | {"reasons": list(fit.reasons)} for fit in fits]
    for truth, seed in ((TRUTH, 5), (WhiteNoise(1.0) + GaussMarkov(0.3, 40.0), 6)):
        documents.append(gmwm.select(truth.simulate(3000, 1.0, seed), 1.0).to_dict())
    documents += [gmwm.calibrate(recording()).to_dict(), gmwm.health(recording()).to_dict()]
    return json.loads(json.dumps(numbers(documents), sort_keys=True))


@pytest.fixture
def reworded(monkeypatch):
    original = Notice.__init__

    def changed(self, code, severity, where, text, *rest, **named):
        original(self, code, severity, where, "Etwas ganz anderes; 3.14 rad/s", *rest, **named)
        object.__setattr__(self, "hint", "" if not self.hint else "anders")

    monkeypatch.setattr(Notice, "__init__", changed)


@pytest.mark.slow
def test_no_number_depends_on_the_words(request):
    before = results()
    request.getfixturevalue("reworded")
    assert results() == before
    fit = gmwm.fit(WhiteNoise() + RandomWalk(), WhiteNoise(1.0).simulate(1000, 1.0, 1), 1.0)
    assert "Etwas ganz anderes" in fit.message
