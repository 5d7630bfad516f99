"""Spectrum of a channel: its lines and resonances."""

from gmwm.diagnosis.spectral.lines import line_notices
from gmwm.diagnosis.spectral.peaks import peaks
from gmwm.diagnosis.spectral.resonances import resonance_notice
from gmwm.diagnosis.spectral.spectrum import Spectrum, spectrum

__all__ = ["Spectrum", "line_notices", "peaks", "resonance_notice", "spectrum"]
