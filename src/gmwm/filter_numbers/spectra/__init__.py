"""Spectra that lie above others at every frequency."""
