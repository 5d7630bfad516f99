"""Inertial navigation: trajectories, emulated IMUs, strapdown mechanization."""
