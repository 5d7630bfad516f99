"""Damaged inputs of every kind are used or refused in one sentence; see `fuzz`."""

import subprocess
import sys
from pathlib import Path

import pytest

import fuzz
from marks import slow

SOME = {"npy": 150, "odd": 2, "document": 10, "study": 6, "field": 12, "fleet": 1}
SOME |= {"gzip": 40, "datasheet": 60}
SOME |= {"mat": 2, "mat73": 5, "hdf5": 2}  # each is first tried in a process of its own


@pytest.mark.parametrize("name", sorted(fuzz.KINDS))
def test_some_inputs(name, tmp_path):
    outcomes = [fuzz.attempt(name, 0, case, tmp_path) for case in range(SOME.get(name, 12))]
    assert any(outcome is None for outcome in outcomes)


# What the generator found: kind, seed, case.
FOUND = [
    ("text", 0, 60),  # every chosen channel was auxiliary
    ("odd", 0, 2),  # 1e-200
    slow("odd", 0, 4),  # alternating values
    slow("odd", 0, 13),  # a square wave
    ("odd", 0, 29),  # a spike of 1e100
    ("records", 2, 30),  # numbers beyond all in the unit of the layout
    ("datasheet", 2, 46),  # a boolean that is none
    ("records", 1, 1),  # a number beyond 1e150 that is not infinite
    ("sqlite3", 1, 56),  # messages that the index counts and are not there
    slow("odd", 2, 2),  # a term that the others explain
    ("feather", 1, 268),  # a name that is no text
    ("fleet", 1, 50),  # a list in place of a mapping
    slow("odd", 1, 12),  # a ramp without any noise
    ("document", 1, 3381),  # a variance of 1e308
    slow("odd", 0, 136),  # half of the record without any error of prediction
    slow("odd", 11, 7),  # noise without slow parts, which leaves no drift
    slow("odd", 12, 52),  # a variance below the smallest number
    ("odd", 12, 92),  # an upper bound below zero
    slow("odd", 5, 172),  # integrals of which one is exactly known
    slow("odd", 5, 183),  # a density below the smallest number
    slow("odd", 6, 214),  # the same, of which an amplitude has no information
    ("odd", 5, 305),  # a level of negative variance, across gaps
    ("odd", 5, 485),  # nearly no noise beside what is looked for
    ("hdf5", 13, 218),  # a unit of 3.9 GB
    ("hdf5", 77, 537),  # free space in a heap that ends before it: the library read on for ever
    ("mat", 77, 255),  # numbers of a type that there is none of: scipy ended the process
    ("npz", 2512, 1311),  # a column of time without a step
    ("ardupilot", 2513, 1600),  # steps of 1e3 and 1e44 in one clock
    ("document", 2513, 7855),  # a discrepancy whose square overflows
    ("odd", 2514, 85),  # a channel that no block of a log that moves has samples of
    slow("odd", 42, 147),  # a deviation that may be none
    ("document", 41, 1335),  # an efficiency of next to nothing
    ("document", 4320, 1668),  # a certificate whose axes have checks at other times
    ("document", 88001, 4693),  # a notice with a count of more digits than a number has
    ("document", 92001, 42166),  # a bin of next to no ordinates
    ("document", 92001, 5979),  # a parameter that its own steps do not move
    ("document", 41, 4884),  # more degrees of freedom than numbers have digits
]


@pytest.mark.parametrize(("name", "seed", "case"), FOUND)
def test_what_was_found(name, seed, case, tmp_path):
    fuzz.attempt(name, seed, case, tmp_path)


def test_what_needs_too_much_memory_is_a_failure(monkeypatch):
    monkeypatch.setattr(fuzz, "BYTES", -1)
    assert fuzz.run(["npy"], 2, 0)["npy"].failures == 2


@pytest.mark.slow
def test_seventy_thousand_inputs():
    program = Path(fuzz.__file__)
    subprocess.run([sys.executable, program, "--cases", "70000", "--seed", "1"], check=True)
