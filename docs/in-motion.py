"""Draw deviations in motion and at rest, rms over IMUs and axes, of saved results of `motion`.

    python docs/in-motion.py 'flights 1-7.json' ...     # writes docs/img/in-motion.svg

The results are those of ``python benchmarks/motion.py sessions FOLDER --static FILE --save .``.
"""

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import gmwm

SCALES = {"gyro": (np.degrees(1.0), "deg/s"), "accel": (1e3 / 9.80665, "mg")}


def main() -> None:
    """Draw the files of the command line."""
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.2), layout="constrained")
    for place, path in enumerate(map(Path, sys.argv[1:])):
        found = gmwm.load(path)
        for ax, sensor in zip(axes, found.sensors, strict=True):
            own = [each for each in found.curves if each.quantity == sensor]
            (scale, unit), tau = SCALES[sensor], own[0].tau
            rms = scale * np.sqrt(np.mean([each.variance for each in own], axis=0))
            ax.loglog(tau, rms, "o-", markersize=4, label=f"in motion, {path.stem}")
            ax.set(xlabel="averaging time [s]", ylabel=f"Allan deviation [{unit}]", title=sensor)
            if place == 0:
                rest = scale * np.sqrt(np.mean([each.static for each in own], axis=0))
                ax.loglog(tau, rest, "k.--", label="at rest")
                for time, top, low in zip(tau[::2], rms[::2], rest[::2], strict=True):
                    ratio = f"x{top / low:.{1 if top < 10.0 * low else 0}f}"
                    ax.annotate(ratio, (time, np.sqrt(top * low)), ha="center")
    axes[0].legend(fontsize="small")
    figure.savefig(Path(__file__).parent / "img" / "in-motion.svg")


if __name__ == "__main__":
    main()
