"""Blocks of whole lines, wherever the bytes are cut."""

import gzip

import pytest

from gmwm.errors import InputError
from gmwm.readers.csv_table import blocks, content_size, count_lines


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("last", ["", "END", "END END", "END \tEND"])
def test_lines_are_whole_and_numbered_wherever_a_block_ends(tmp_path, end, last):
    lines = ["1,2,3", "", "4", "", "", "5,6", "77777,8"]
    text = (end.join(lines) + last.replace("END", end)).encode()
    path = tmp_path / "a.csv"
    path.write_bytes(text)
    for size in (1, 2, 3, 5, 7, 64, 1000):
        found = list(blocks(path, size=size))
        whole = b"".join(block for _, block in found)
        assert whole.rstrip() == text.rstrip() and text.startswith(whole)
        assert len(whole) <= len(text.rstrip()) + len(end)
        number = 1
        for k, (line, block) in enumerate(found):
            assert line == number
            assert k == len(found) - 1 or block.endswith(end.encode())
            if end == "\r\n":
                assert not block.endswith(b"\r") and not block.startswith(b"\n")
            number += block.decode().count(end)
        offset = len(lines[0] + end)
        rest = list(blocks(path, offset=offset, line=2, size=size))
        assert b"".join(block for _, block in rest) == whole[offset:]
        assert rest[0][0] == 2


def test_line_ends_are_of_three_kinds():
    assert count_lines(b"a\nb\r\nc\rd") == 3
    assert count_lines(b"\r\n\r\n\n\r") == 4


def test_a_size_is_that_of_the_content(tmp_path):
    plain, packed, short = (tmp_path / name for name in ("a.csv", "a.csv.gz", "b.csv"))
    plain.write_bytes(b"x" * 3000)
    packed.write_bytes(gzip.compress(b"x" * 3000))
    short.write_bytes(b"x")
    assert [content_size(path) for path in (plain, packed, short)] == [3000, 3000, 1]


def test_a_line_of_more_than_a_megabyte_is_refused(tmp_path):
    path = tmp_path / "a.csv"
    for size in ((1 << 20) - 1, 1 << 20):
        path.write_bytes(b"1\n" + b"x" * size + b"\n1\n")
        assert b"".join(block for _, block in blocks(path, size=1 << 18)) == path.read_bytes()
    path.write_bytes(b"1\n" + b"x" * ((1 << 20) + (1 << 18)))
    with pytest.raises(InputError, match="line 2: longer than 1 MB"):
        list(blocks(path, size=1 << 18))
