"""Recordings of three units, of which one differs, and one fleet of them for every test."""

import numpy as np
import pytest

import gmwm
from fleets import QUICK
from gmwm import WhiteNoise


@pytest.fixture(scope="session")
def record():
    """Write a recording of white noise."""

    def _record(path, seed=0, N=1e-3, channels=("gyro_x", "gyro_y"), n=400):
        path.parent.mkdir(parents=True, exist_ok=True)
        rng = np.random.default_rng(seed)
        np.savez(path, **{name: WhiteNoise(N).simulate(n, 1.0, rng) for name in channels})
        return str(path)

    return _record


@pytest.fixture(scope="session")
def lot(record, tmp_path_factory):
    """Three recordings and one that is damaged."""
    folder = tmp_path_factory.mktemp("lot")
    paths = [record(folder / f"unit {i}.npz", seed=i) for i in range(2)]
    paths.append(record(folder / "third.npz", seed=2, N=2e-3, channels=("gyro_x",)))
    (folder / "<b>damaged.npz").write_text("nothing")
    return [*paths, str(folder / "<b>damaged.npz")]


@pytest.fixture(scope="session")
def outputs(lot, tmp_path_factory):
    folder = tmp_path_factory.mktemp("outputs") / "out"
    return folder, gmwm.fleet(lot, folder=folder, **QUICK)
