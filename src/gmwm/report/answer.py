"""The answer in words: whether the recording is healthy, and which axes are usable."""

from __future__ import annotations

from gmwm._core.pages import page_of
from gmwm._core.text import brief, per_cent
from gmwm.calibration import AMBIGUITY, Calibration
from gmwm.diagnosis import gathered
from gmwm.estimate import Fit
from gmwm.report.health import counted, findings
from gmwm.report.page import units_of


@page_of(Calibration, "verdict")
def verdict(calibration: Calibration) -> dict[str, str]:
    """The health of sensor and recording in one line."""
    found = findings(calibration)
    is_severe = any(n.severity == "bad" for n in gathered(calibration.notices))
    removed = dict.fromkeys(n.where for n in found if n.values.get("removed"))
    causes: dict[str, list[str]] = {}  # why fits are not valid -> their channels
    for name, fit in calibration.items():
        if not fit.valid:
            causes.setdefault(trust(name, fit, calibration)[1], []).append(name)
    parts = [f"{', '.join(names)} not valid: {cause}" for cause, names in causes.items()]
    parts += [f"{', '.join(calibration.skipped)} have no model"] if calibration.skipped else []
    parts += [counted(found, severity) for severity in ("bad", "warning")]
    if removed:
        parts.append(f"departures from noise subtracted ({', '.join(removed)})")
    text = "; ".join(filter(None, parts))
    if is_severe or causes or calibration.skipped:
        all_out = not any(fit.valid for fit in calibration.values())
        state, word = ("bad", "Not healthy") if all_out or is_severe else ("care", "Usable in part")
        return {"state": state, "word": word, "text": text}
    if not calibration.is_examined:
        return {"state": "care", "word": "Not examined", "text": "the fits are valid"}
    if text:
        return {"state": "care", "word": "Healthy, with care", "text": text}
    return {"state": "good", "word": "Healthy", "text": "no defect found"}


def trust(name: str, fit: Fit, calibration: Calibration) -> tuple[bool, str]:
    """Whether the numbers of a channel can be used, and why, in about five words."""
    bad = [notice.issue for notice in fit.notices if notice.severity == "bad"]
    if bad:
        # A departure from noise is why the model misses levels too.
        issue = next((each for each in bad if each.topic == "departure"), bad[0])
        return False, issue.reason or issue.code.replace("-", " ")
    at = fit.goodness
    fits = "fits the data"
    if at.worst is not None:
        share = per_cent(abs(at.worst[0]))
        fits = f"within {share} of the data up to {brief(at.known_to, 2)} s"
    tied = next((n for n in calibration.notices if n.code == AMBIGUITY and n.where == name), None)
    return (
        True,
        f"{fits}, {tied.values.get('models', 2):g} models fit equally well" if tied else fits,
    )


def quantity_text(value: float, unit: str, fit: Fit) -> dict[str, str]:
    """A value in the field's first unit and in SI."""
    field, scale, si = units_of(unit, fit.wv)
    return {"field": f"{brief(value * scale, 3)} {field}", "si": f"{value:.3g} {si}"}
