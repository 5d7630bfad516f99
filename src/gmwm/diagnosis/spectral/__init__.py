"""Spectrum of a channel: its lines and resonances."""

from gmwm.diagnosis.spectral.lines import line_notices as line_notices
from gmwm.diagnosis.spectral.peaks import peaks as peaks
from gmwm.diagnosis.spectral.resonances import resonance_notice as resonance_notice
from gmwm.diagnosis.spectral.spectrum import Spectrum as Spectrum, spectrum as spectrum
