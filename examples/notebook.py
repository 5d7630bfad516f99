"""From a sensor to the numbers of a filter, by sliders: simulate, look, fit, bound.

Run: marimo run examples/notebook.py     (an app; pip install 'gmwm[notebook]')
     marimo edit examples/notebook.py    (a notebook)
     python examples/notebook.py         (a script, with the values that the sliders start at)
"""

import marimo

app = marimo.App(width="medium")


@app.cell
def _():
    import marimo as mo
    import numpy as np

    import gmwm
    from gmwm import GaussMarkov, WhiteNoise

    mo.md("# What should my filter believe?")
    return GaussMarkov, WhiteNoise, gmwm, mo, np


@app.cell
def _(mo):
    white = mo.ui.slider(0.05, 1.0, 0.05, 0.2, label="N [deg/sqrt(h)]", show_value=True)
    sigma = mo.ui.slider(5, 100, 5, 25, label="sigma of the bias [deg/h]", show_value=True)
    tau = mo.ui.slider(5, 300, 5, 20, label="its correlation time [s]", show_value=True)
    hours = mo.ui.slider(0.25, 4.0, 0.25, 1.0, label="length of the record [h]", show_value=True)
    horizon = mo.ui.slider(1, 120, 1, 60, label="time without aiding [s]", show_value=True)
    seed = mo.ui.number(0, 1000, 1, 1, label="seed")
    mo.vstack([white, sigma, tau, hours, seed, horizon])
    return horizon, hours, seed, sigma, tau, white


@app.cell
def _(GaussMarkov, WhiteNoise, gmwm, hours, np, seed, sigma, tau, white):
    # The sensor, and what it records at rest.
    rate = 10.0
    truth = WhiteNoise(np.radians(white.value) / 60.0) + GaussMarkov(
        np.radians(sigma.value) / 3600.0, float(tau.value)
    )
    samples = gmwm.simulate(truth, round(3600 * hours.value * rate), rate=rate, seed=seed.value)
    recording = gmwm.Recording.from_arrays({"gyro_x": samples}, rate, {"gyro": "rad/s"})
    return recording, truth


@app.cell
def _(gmwm, mo, recording):
    # The Allan curve, and the model that it shows.
    curve = gmwm.wavelet_variance(recording["gyro_x"])
    best = gmwm.select(curve)
    fit = best.fit
    mo.vstack([mo.hstack([best.plot().figure, fit], widths=[3, 2]), best])
    return (fit,)


@app.cell
def _(fit, gmwm, mo, truth):
    # How well could anybody know the sensor from this record?
    limit = gmwm.cramer_rao(truth, fit.wv.n, fit.wv.dt)
    mo.plain_text(str(limit))
    return (limit,)


@app.cell
def _(fit, gmwm, horizon, mo, truth):
    # The numbers of a filter with white noise and a walking bias, of the fit and of the truth.
    numbers = gmwm.bound(fit, "N+K", horizon=float(horizon.value))
    ideal = gmwm.bound(truth, "N+K", horizon=float(horizon.value), dt=fit.wv.dt)
    mo.hstack(
        [
            mo.vstack([mo.md("**of the record**"), mo.plain_text(str(numbers))]),
            mo.vstack([mo.md("**of the true sensor**"), mo.plain_text(str(ideal))]),
        ]
    )
    return ideal, numbers


if __name__ == "__main__":
    app.run()
