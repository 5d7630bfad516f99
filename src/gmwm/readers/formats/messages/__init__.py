"""Logs of messages in topics: bags of ROS, flight logs of PX4 and ArduPilot."""

from gmwm.readers.formats.messages.ardupilot import open_ardupilot as open_ardupilot
from gmwm.readers.formats.messages.rosbag import open_bag as open_bag
from gmwm.readers.formats.messages.topics import Wanted as Wanted
from gmwm.readers.formats.messages.ulog import open_ulog as open_ulog
