"""Pictures: what is drawn where, under which name and in which unit."""

import matplotlib

matplotlib.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
import pytest

import gmwm
from gmwm import RandomWalk, WhiteNoise, plotting as plot

pytestmark = pytest.mark.usefixtures("closed_figures")


@pytest.fixture(scope="module")
def fit():
    truth = WhiteNoise(0.2) + RandomWalk(0.02)
    series = gmwm.Channel("gyro_x", truth.simulate(4000, 0.1, 1), 0.1, "gyro", "rad/s")
    return gmwm.fit(truth.opened(), series)


TAU = np.array([0.1, 1.0, 10.0])
VALUE = np.array([3.0, 1.0, 2.0])


def drawn_deviation(**options):
    return plot.deviation(TAU, VALUE, 0.5 * VALUE, 3.0 * VALUE, unit="m/s^2", **options)


def test_an_interval_beside_its_value_does_no_harm():
    axes = plot.deviation(TAU, VALUE, 1.1 * VALUE, 1.2 * VALUE, unit="u")
    axes.figure.canvas.draw()
    (bars,) = axes.containers[0].lines[2]
    assert min(segment[:, 1].min() for segment in bars.get_segments()) >= VALUE.min()


def test_results_draw_into_given_axes(fit):
    _, (first, second) = plt.subplots(1, 2)
    assert fit.plot(ax=first) is first
    assert fit.wv.plot(ax=second) is second
    assert first.get_ylabel() == second.get_ylabel() == "Allan deviation [deg/h]"
    assert first.get_title() == second.get_title() == "gyro_x"


def test_legend_names_data_model_and_components(fit):
    axes = fit.plot()
    texts = [text.get_text() for text in axes.get_legend().get_texts()]
    assert sorted(texts) == sorted(
        ["data, 95 % interval", "95 % band", "white noise", "random walk", "model"]
    )
    lines = {line.get_label(): line for line in axes.lines}
    tau = lines["white noise"].get_xdata()
    assert tau.size > 4 * fit.wv.tau.size  # between octaves too
    per_si = 180.0 / np.pi * 3600.0
    shown = dict(zip(tau.tolist(), lines["model"].get_ydata(), strict=True))
    at_octaves = [shown[float(each)] for each in fit.wv.tau]
    np.testing.assert_allclose(at_octaves, per_si * np.sqrt(2.0 * fit.implied))
    np.testing.assert_allclose(
        lines["white noise"].get_ydata(), per_si * fit.params["N"] / np.sqrt(tau)
    )
    # Components add up to the model in variance, and each is told apart by its colour.
    parts = [lines[label].get_ydata() ** 2 for label in ("white noise", "random walk")]
    np.testing.assert_allclose(sum(parts), lines["model"].get_ydata() ** 2)
    curves = ("white noise", "random walk", "model")
    assert len({lines[label].get_color() for label in curves}) == 3


def test_units_of_the_field_or_si(fit):
    field, si = fit.plot(), fit.plot(units="si")
    assert si.get_ylabel() == "Allan deviation [rad/s]"
    ratio = field.containers[0].lines[0].get_ydata() / si.containers[0].lines[0].get_ydata()
    np.testing.assert_allclose(ratio, 180.0 / np.pi * 3600.0)
    for result in (fit, fit.wv):
        with pytest.raises(gmwm.InputError, match="'imperial': give 'field' or 'si'"):
            result.plot(units="imperial")


def test_a_kind_has_one_colour_whatever_is_drawn_with_it():
    first = dict(zip(labels := ["white noise", "Gauss-Markov"], plot.styles(labels), strict=True))
    labels = ["Gauss-Markov 1", "own process", "Gauss-Markov 2", "random walk", "white noise"]
    second = dict(zip(labels, plot.styles(labels), strict=True))
    assert second["white noise"] == first["white noise"]
    assert second["Gauss-Markov 1"] == first["Gauss-Markov"] == (second["Gauss-Markov 2"][0], 0)
    assert second["Gauss-Markov 2"][1] == 1  # another dash
    assert len({colour for colour, _ in second.values()}) == 4
    axes = drawn_deviation()
    plot.curves(axes, TAU, VALUE, dict.fromkeys(labels, VALUE), band=(0.9 * VALUE, 1.1 * VALUE))
    drawn = {line.get_label(): line for line in axes.lines}
    dashes = {drawn[label].get_linestyle() for label in ("Gauss-Markov 1", "Gauss-Markov 2")}
    assert len(dashes) == 2
    plot.curves(drawn_deviation(), TAU, VALUE, {str(i): VALUE for i in range(12)})  # and repeat


def test_sensor_numbers_are_read_at_one_and_three_seconds():
    lines = plot.sensor_lines({"N": ("N = 2", 2.0), "B": ("B = 3", 3.0), "K": ("K <= 4", 4.0)}, 8.0)
    axes = drawn_deviation()
    plot.straight_lines(axes, lines)
    points = {each.get_label(): each for each in axes.lines if each.get_marker() == "D"}
    at = {label: (line.get_xdata()[0], line.get_ydata()[0]) for label, line in points.items()}
    assert at["N = 2"] == (1.0, 2.0)
    assert at["B = 3"] == pytest.approx((8.0, 0.664 * 3.0), rel=1e-3)
    assert at["K <= 4"] == pytest.approx((3.0, 4.0))
    low, high = axes.get_ylim()
    assert all(low < y < high for _, y in at.values())
    assert {text.get_text() for text in axes.texts} == {"N", "B", "K"}
    assert plot.sensor_lines({"N": ("", 0.0), "K": ("", np.inf)}, 8.0) == {}


def test_data_stay_in_view_where_the_model_misses_them():
    fitted = gmwm.fit(RandomWalk(), WhiteNoise(1.0).simulate(4000, 1.0, 2), dt=1.0)
    deviation = fitted.wv.allan_deviation
    assert deviation.max() > 5.0 * np.sqrt(2.0 * fitted.implied.max())  # it does miss them
    bottom, top = fitted.plot().get_ylim()
    assert bottom < deviation.min()
    assert deviation.max() < top
