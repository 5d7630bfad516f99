"""Logs of messages in topics: bags of ROS, flight logs of PX4 and ArduPilot."""
