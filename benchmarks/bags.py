"""Reading bags: the time of `gmwm.read` over that of iterating the same messages with rosbags.

Run: python benchmarks/bags.py [--messages 200000] [--repeats 3]

Both are measured in turns in the same run, in seconds of the processor, and the smallest of each
counts.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from rosbags.rosbag1 import Reader as Reader1
from rosbags.rosbag2 import Reader as Reader2

import gmwm

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "tests"))
from bags import ROS1, ROS2, at_rest, imu_topic, write1, write2

KINDS = {
    "ROS 1": (1, {}),
    "ROS 1, lz4": (1, {"compression": "LZ4"}),
    "ROS 2, sqlite3": (2, {"storage": "SQLITE3"}),
    "ROS 2, sqlite3, messages by zstd": (2, {"storage": "SQLITE3", "compression": "MESSAGE"}),
    "ROS 2, MCAP": (2, {"storage": "MCAP"}),
    "ROS 2, MCAP, chunks by zstd": (2, {"storage": "MCAP", "compression": "STORAGE"}),
}


def iterate(reader: type, path: Path) -> int:
    """Only go through the messages."""
    with reader(path) as bag:
        return sum(len(raw) for _, _, raw in bag.messages(bag.connections))


def seconds(work: object, *arguments: object) -> float:
    """Of the processor, for one call."""
    begin = time.process_time()
    work(*arguments)
    return time.process_time() - begin


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--messages", type=int, default=200_000)
    parser.add_argument("--repeats", type=int, default=3)
    given = parser.parse_args()
    samples = np.tile(at_rest(1000), (-(-given.messages // 1000), 1))[: given.messages]
    print(f"{given.messages:,} messages of sensor_msgs/Imu")
    print(f"{'bag':34s} {'rosbags':>9s} {'gmwm':>9s} {'ratio':>6s}")
    with tempfile.TemporaryDirectory() as folder:
        for i, (name, (version, arguments)) in enumerate(KINDS.items()):
            store, write, reader = (
                (ROS1, write1, Reader1) if version == 1 else (ROS2, write2, Reader2)
            )
            topics = {"/imu": imu_topic(store, samples, 400.0)}
            path = write(Path(folder) / f"{i}.bag", topics, **arguments)
            del topics
            gmwm.read(path)
            pairs = [
                (seconds(iterate, reader, path), seconds(gmwm.read, path))
                for _ in range(given.repeats)
            ]
            raw, read = np.min(pairs, axis=0)
            print(f"{name:34s} {raw:7.2f} s {read:7.2f} s {read / raw:6.2f}", flush=True)


if __name__ == "__main__":
    main()
