import matplotlib.pyplot as plt
import numpy as np
import pytest

from gmwm.plotting import navigation as navigation_plot

RNG = np.random.default_rng(3)


@pytest.fixture(autouse=True)
def _closed():
    yield
    plt.close("all")


def panel(scale=1.0, n=50):
    time = np.arange(float(n))
    sd = scale * (1.0 + time[:, None] * np.ones(3))
    return time, RNG.standard_normal((n, 3)), sd


def test_names_are_shown_as_they_are_written():
    names = ["_x", "a$b$c", r"$\foo$", "<b>", "x" * 60, "truth"]
    path = np.column_stack([np.arange(5.0), np.arange(5.0)])
    figure = navigation_plot.track(path, [path], {name: [path] for name in names})
    figure.canvas.draw()
    shown = [text.get_text() for text in figure.axes[1].get_legend().get_texts()]
    assert len(shown) == 1 + len(names)
    assert shown[1] == " _x"
    assert shown[2] == r"a\$b\$c"
    assert len(shown[5]) == 24


@pytest.mark.parametrize("count", [1, 4])
def test_errors_have_three_panels_a_filter_and_three_filters_in_a_row(count):
    figure = navigation_plot.errors({str(i): panel() for i in range(count)}, [(10.0, 20.0)])
    figure.canvas.draw()
    on = [ax for ax in figure.axes if ax.axison]
    assert len(on) == 3 * count
    assert [ax.get_title() for ax in on if ax.get_title()] == [str(i) for i in range(count)]
    assert figure.get_size_inches()[0] <= 11.0


def test_a_timid_filter_does_not_hide_the_errors_of_the_others():
    figure = navigation_plot.errors({"usual": panel(), "timid": panel(1e6)})
    assert figure.axes[0].get_ylim()[1] < 1000.0
    rising = np.column_stack([np.arange(10.0)] * 2)
    series = {
        "usual": (np.arange(10.0), rising, rising),
        "timid": (np.arange(10.0), rising, 1e6 * rising),
    }
    ax = navigation_plot.growth({"outage": series}).axes[0]
    low, high = ax.get_ylim()
    assert low == 0.0
    assert 9.0 < high < 30.0


def test_a_large_error_is_in_view():
    time, error, sd = panel()
    error[30, 0] = 1e4
    figure = navigation_plot.errors({"bold": (time, error, sd)})
    assert figure.axes[0].get_ylim()[1] > 1e4


def test_what_never_was_is_drawn_as_nothing():
    nothing = np.zeros((0, 2))
    path = np.column_stack([np.arange(5.0), np.arange(5.0)])
    navigation_plot.track(path, [path], {"diverged": [nothing]}).canvas.draw()
    empty = np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3))
    navigation_plot.errors({"diverged": empty, "usual": panel()}).canvas.draw()
    navigation_plot.track(path, [], {}).canvas.draw()
    navigation_plot.measured_track(path, path, nothing).canvas.draw()
    navigation_plot.innovations({"position [m]": panel()}).canvas.draw()
