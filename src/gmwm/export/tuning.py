"""Constants of exported files, each with its reason."""

HORIZON = 60.0
"""s without aiding: a tunnel or an underpass for an INS/GNSS filter."""

KEYFRAME = 1.0
"""s between the keyframes or scans that visual and lidar odometry relate to each other."""

OUTLOOK = (10.0, 60.0, 600.0)
"""s: horizons that comments compare."""

OUTAGES = (1.0 / 6.0, 0.5, 1.0)
"""Of the horizon, for which reduced numbers are found: as 10, 30 and 60 s are of 60 s."""
