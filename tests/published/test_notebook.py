"""The notebook, as a script: every cell runs, and its numbers are those of its sensor."""

import importlib.util

import pytest

from places import REPOSITORY

pytest.importorskip("marimo", reason="marimo runs the notebook")


@pytest.mark.filterwarnings("default")  # of marimo's own
def test_every_cell_runs():
    path = REPOSITORY / "examples" / "notebook.py"
    spec = importlib.util.spec_from_file_location("notebook", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    _, names = module.app.run()
    fit, truth = names["fit"], names["truth"]
    assert fit.valid
    for key, error in names["limit"].stderr.items():
        # No estimate is better than the bound; five of its errors are far off.
        assert abs(fit.params[key] - truth.params[key]) < 5.0 * error
    found, ideal = (names[name].K for name in ("numbers", "ideal"))
    assert abs(found / ideal - 1.0) < 0.5
