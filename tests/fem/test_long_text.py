"""A text in a file and the same in memory are one to whoever reads it."""

import random

import pytest

import fem_import as fi
from fem_import.readers.long_text import BLOCK, LongText, texts_of


def lines(n_bytes, seed=1):
    chance = random.Random(seed)
    parts = []
    while sum(map(len, parts)) < n_bytes:
        parts.append(b"7" * chance.randint(0, 90) + b"\n")
    return b"".join(parts)


@pytest.fixture(params=["bytes", "file", "part of a file"])
def text(request, tmp_path):
    content = lines(3 * BLOCK)
    if request.param == "bytes":
        return content, LongText(content)
    path = tmp_path / "text"
    if request.param == "file":
        path.write_bytes(content)
        return content, LongText(path)
    path.write_bytes(b"head\n" + content + b"tail")
    return content, LongText(path).between(5, 5 + len(content))


def test_its_bytes_are_those_of_the_source(text):
    content, long = text
    assert len(long) == len(content)
    assert bytes(long) == content
    assert long[:10] == content[:10]
    assert long[-60:] == content[-60:]
    assert long[5:2] == b""
    assert bytes(long.between(100, 300)) == content[100:300]
    assert bytes(long.between(100)) == content[100:]
    assert bytes(long.between(100).between(7, 9)) == content[107:109]


def test_blocks_are_whole_lines_and_all_of_them(text):
    content, long = text
    blocks = list(long.blocks_of_lines())
    assert len(blocks) > 2
    assert b"".join(blocks) == content
    assert all(block.endswith(b"\n") and len(block) <= BLOCK for block in blocks)


def test_lines_are_counted_and_found(text):
    content, long = text
    ends = [place + 1 for place, character in enumerate(content) if character == ord("\n")]
    assert long.count_lines() == len(ends)
    wanted = [0, 1, 1, 2, len(ends) // 2, len(ends)]
    assert long.ends_of_lines(wanted) == [0, *(ends[number - 1] for number in wanted[1:])]
    assert long.ends_of_lines([3, len(ends) + 1]) == [ends[2]]
    assert long.line_at(ends[4]) == content[ends[4] : ends[5]]


def test_the_lines_of_a_long_text_are_estimated_from_samples():
    content = b"".join(b"%d 1 1.5\n" % number for number in range(600_000))  # they grow longer
    assert len(content) > 40 * BLOCK
    estimate = LongText(content).about_lines()
    assert 600_000 < estimate < 1.02 * 600_000
    assert LongText(content[:1000]).about_lines() == content[:1000].count(b"\n")


def test_lines_longer_than_a_block():
    content = b"1" * (5 * BLOCK) + b"\nend"
    assert LongText(content).line_at(0) == content[:-3]
    assert LongText(content).line_at(len(content) - 3) == b"end"
    assert LongText(content).line_at(len(content)) == b""
    assert list(LongText(content).blocks_of_lines()) == []
    assert LongText(b"").count_lines() == 0


def test_what_is_no_file_is_said_by_name(tmp_path):
    with pytest.raises(fi.MissingFileError, match=r"part_K\.mtx does not exist"):
        texts_of(tmp_path / "part_K.mtx")
    with pytest.raises(fi.ExportError, match="is not a file"):
        texts_of(tmp_path)


def test_a_file_that_vanishes_is_an_error_of_ours(tmp_path):
    path = tmp_path / "part_K.mtx"
    path.write_bytes(b"1 1 1.0\n")
    text = LongText(path)
    path.unlink()
    for reading in (text.count_lines, lambda: text[:5], lambda: list(text.blocks_of_lines())):
        with pytest.raises(fi.ExportError, match=r"part_K\.mtx cannot be read"):
            reading()


def test_a_file_that_shrinks_while_it_is_read_ends_there(tmp_path):
    path = tmp_path / "part_K.mtx"
    path.write_bytes(lines(BLOCK))
    text = LongText(path)
    path.write_bytes(b"7\n7\n")
    assert text.count_lines() == 2
    assert list(text.blocks_of_lines()) == [b"7\n7\n"]
    assert text.ends_of_lines([1, 5]) == [2]
    assert text.line_at(2) == b"7\n"


def test_a_long_file_that_is_emptied_has_no_lines(tmp_path):
    path = tmp_path / "part_K.mtx"
    path.write_bytes(b"7\n" * (20 * BLOCK))
    text = LongText(path)
    path.write_bytes(b"")
    assert text.about_lines() == 0
    assert text.ends_of_lines([1]) == []
