"""How a text is laid out, by its first lines alone."""

import pytest

from gmwm.errors import InputError
from gmwm.readers import tuning
from gmwm.readers.layout import find_layout


def layout(*lines, end="\n"):
    return find_layout("a.csv", (end.join(lines) + end).encode())


@pytest.mark.parametrize(
    ("lines", "delimiter", "decimal", "names", "line"),
    [
        (["t,ax,ay", "0,1,2", "1,2,3"], ",", ".", ("t", "ax", "ay"), 2),
        (["0;1,5;2", "1;2,5;3"], ";", ",", ("", "", ""), 1),
        (["0\t1.5\t2", "1\t2.5\t3"], "\t", ".", ("", "", ""), 1),
        (["t ax [m/s^2] ay", "0 1 2", "1  2 3"], " ", ".", ("t", "ax [m/s^2]", "ay"), 2),
        (["1,5 2,5 4", "2,5 3,5 6"], " ", ",", ("", "", ""), 1),
        (["ax", "1.5", "2.5"], ",", ".", ("ax",), 2),
        (["# a comment", "", "t,ax", "0,1", "1,2"], ",", ".", ("t", "ax"), 4),
        (["# t,ax", "0,1", "1,2"], ",", ".", ("t", "ax"), 2),
        (["# t,ax", "# p,q", "0,1", "1,2"], ",", ".", ("t", "ax"), 3),
        (["% p,q", "0,1", "1,2"], ",", ".", ("p", "q"), 2),
        (["# a,b,c", "0,1", "1,2"], ",", ".", ("", ""), 2),
        (["0,1,2", "5,6,7", "8,9,9"], ",", ".", ("", "", ""), 2),
        (["0,1", "5,6", "8,9"], ",", ".", ("", ""), 1),
        (["t,ax,", "0,1,", "1,2,"], ",", ".", ("t", "ax"), 2),
        (["t,ax,ay", "0,1,", "1,2,"], ",", ".", ("t", "ax", "ay"), 2),
        (["made by me", "t,ax", "0,1", "1,2"], ",", ".", ("t", "ax"), 3),
        (["0,x,2", "1,y,3"], ",", ".", ("", "", ""), 1),
    ],
)
def test_first_lines_say_it_all(lines, delimiter, decimal, names, line):
    for end in ("\r\n", "\r", "\n"):
        found = layout(*lines, end=end)
        assert found.line == line
        assert found.offset == sum(len(each) + len(end) for each in lines[: line - 1])
    data = lines[line - 1 :]
    assert found.names == names and found.width == len(names)
    assert (found.delimiter, found.decimal) == (delimiter, decimal)
    assert found.trailing == (data[0][-1] == "," and len(names) == data[0].count(","))
    assert found.tentative == (line == 1 or lines[line - 2][0] in "#%0")


@pytest.mark.parametrize(
    ("lines", "words"),
    [
        (["t,ax", "0,1,2", "1,2,3"], "line 2 and after: 3 fields where the header .line 1. has 2"),
        (["t,ax"], "holds no numbers|has a header .line 1. but no data"),
        (["t,ax", "p,q"], "holds no numbers"),
        (["# t", "#"], "holds only comments"),
        (["", " "], "is empty"),
        (["\0"], "not a text file"),
        (['t,"ax', "0,1"], "line 1: quotes that do not match"),
    ],
)
def test_what_is_no_table_is_refused(lines, words):
    with pytest.raises(InputError, match=words):
        layout(*lines)


def test_some_lines_are_looked_at():
    lines = ["t,ax", *["0,1"] * (tuning.LINES_OF_LAYOUT - 1), '"']
    assert layout(*lines).names == ("t", "ax")
    del lines[5]
    with pytest.raises(InputError, match=f"line {tuning.LINES_OF_LAYOUT}: quotes"):
        layout(*lines)


def test_notices_name_the_line():
    (found,) = layout("0,1,2", "5,6,7", "8,9,9").notices
    assert (found.code, found.values) == ("column-numbers", {"line": 1})
    (found,) = layout("made by me", "t,ax", "0,1", "1,2").notices
    assert (found.code, found.values) == ("preamble", {"line": 2})
    found = layout("UTC,ax", "2024-01-01T00:00:00Z,1", "2024-01-01T00:00:01Z,2")
    assert found.names == ("UTC time [s]", "ax") and found.dates == {0: True}
    assert [each.code for each in found.notices] == ["dates"]
