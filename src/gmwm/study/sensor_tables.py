"""Sensor models of the paper, Stebler et al. (2012), Tables V and VI."""

from __future__ import annotations

from gmwm.ins.spec import sensor_models

TABLE_5 = sensor_models(
    {
        "gyro": {"N": "720 deg/h/sqrt(Hz)", "GM": [["180 deg/h", 1000.0]]},
        "accel": {"N": "100000 ug/sqrt(Hz)", "GM": [["40000 ug", 100.0]]},
    },
    "Table V",
)
"""What the paper's filter was tuned to by hand."""

TABLE_6 = sensor_models(
    {
        "gyro": {
            "N": "140 deg/h/sqrt(Hz)",
            "GM": [["113 deg/h", 2000.0], ["65 deg/h", 20.0], ["206 deg/h", 0.1]],
        },
        "accel": {"N": "140 ug/sqrt(Hz)", "GM": [["5 ug", 25.0], ["13 ug", 500.0]]},
    },
    "Table VI",
)
"""What the paper's GMWM found in an XSens MTi-G, read as plain standard deviations."""
