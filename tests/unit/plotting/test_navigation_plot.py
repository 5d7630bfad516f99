import numpy as np
import pytest

from gmwm.plotting import navigation as navigation_plot

pytestmark = pytest.mark.usefixtures("closed_figures")

RNG = np.random.default_rng(3)


def panel(scale=1.0, n=50):
    time = np.arange(float(n))
    sd = scale * (1.0 + time[:, None] * np.ones(3))
    return time, RNG.standard_normal((n, 3)), sd


def test_errors_have_a_panel_a_component_with_all_filters():
    figure = navigation_plot.errors(
        {str(i): panel() for i in range(4)}, [(10.0, 20.0)], title="run 1"
    )
    figure.canvas.draw()
    assert len(figure.axes) == 3
    assert figure.axes[0].get_title() == "run 1"
    shown = [text.get_text() for text in figure.legends[0].get_texts()]
    assert shown == ["0", "1", "2", "3", "1 sigma predicted"]


def test_a_timid_filter_does_not_hide_the_errors_of_the_others():
    figure = navigation_plot.errors({"usual": panel(), "timid": panel(1e6)})
    assert figure.axes[0].get_ylim()[1] < 1000.0
    rising = np.column_stack([np.arange(10.0)] * 2)
    series = {
        "usual": (np.arange(10.0), rising, rising),
        "timid": (np.arange(10.0), rising, 1e6 * rising),
    }
    ax = navigation_plot.growth({"outage": series}, 7).axes[0]
    low, high = ax.get_ylim()
    assert low == 0.0
    assert 9.0 < high < 30.0
