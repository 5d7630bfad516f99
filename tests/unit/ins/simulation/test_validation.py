from dataclasses import replace
from types import SimpleNamespace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from gmwm.errors import InputError


def test_a_filter_whose_models_are_not_valid_is_named(made_up):
    found = made_up(runs=2)
    models = replace(found.experiment.filters["bold"], not_valid=("gyro_x",))
    filters = found.experiment.filters | {"bold": models}
    experiment = SimpleNamespace(**(vars(found.experiment) | {"filters": filters}))
    (notice,) = (n for n in replace(found, experiment=experiment).notices if n.source)
    assert (notice.source, notice.where, notice.code) == ("bold", "gyro_x", "fit-not-valid")


def test_filters_are_starred_if_and_only_if_they_misjudge_themselves(made_up):
    text = str(made_up(runs=400))
    nees = text.split("NEES")[1].split("\n\n")[0].splitlines()[2:]
    stars = {name: [line.count("*") for line in nees if line.startswith(name)]
             for name in ("right", "bold", "timid")}  # fmt: skip
    assert stars["bold"] == stars["timid"] == [6, 6, 6]
    assert sum(stars["right"]) <= 4  # of 18 at 5 %


def test_errors_and_predictions_are_those_of_the_runs(made_up):
    found = made_up(runs=1000)
    for name, factor in (("right", 1.0), ("bold", 3.0), ("timid", 0.3)):
        for i, (_, length) in enumerate(((20, 10), (40, 15))):
            sd = 1.0 + 0.2 * length**1.5
            spread = found.spreads(name)[i]["horizontal"]
            assert spread.predicted == pytest.approx(sd * np.sqrt(2.0))
            # The mean square of 2000 components has a relative error of 3.2 %, its root half.
            assert spread.rms == pytest.approx(factor * sd * np.sqrt(2.0), rel=0.08)
    d = found.against_first("bold", "horizontal")
    assert d.significant
    assert d.ratio == pytest.approx(3.0)
    assert (d.ratio_lower, d.ratio_upper) == (pytest.approx(3.0), pytest.approx(3.0))


def test_a_filter_that_diverged_is_named_and_left_out(made_up):
    found = made_up(dead=("right",))
    text = str(found)
    assert found.reached == ("bold", "timid")
    assert "- right: diverged in 40 of 40 runs" in text
    assert "nan" not in text
    for figure in (found.plot_track(), found.plot_growth(), found.plot_errors(0)):
        plt.close(figure)


def test_errors_grow_from_the_start_of_an_outage_to_its_end(made_up):
    figure = made_up(runs=3).plot_growth()
    spans = [ax.lines[0].get_xdata()[[0, -1]].tolist() for ax in figure.axes[:2]]
    assert spans == [[0.0, 10.0], [0.0, 15.0]]
    plt.close(figure)


def test_figures_need_an_outage(made_up):
    found = made_up(outages=())
    plt.close(found.plot_track())
    with pytest.raises(InputError, match="has no outage"):
        found.plot_growth()
    with pytest.raises(InputError, match="has 0 outages"):
        found.plot_errors()
    with pytest.raises(InputError, match="has 2 outages"):
        made_up().plot_errors(2)
