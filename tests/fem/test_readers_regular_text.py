"""The fast parser of regular text never takes what a strict line-by-line reading does not."""

import random
import re

import numpy as np
import pytest

from fem_import.readers.fixed_layout import FixedLayout
from fem_import.readers.long_text import BLOCK, LongText
from fem_import.readers.regular_text import regular_column, regular_labelled_triplets, regular_triplets

NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?$")
LAYOUTS = ["{} {} {:.6e}", "{} {} {:20.13e}", "{:9d}{:9d} {:24.16E}", "{} {} {!r}", "{}\t{}\t{:.16g}", "{} {} {:.4f}\r"]


def strict(text):
    """Rows, columns and values; None where a line is not two whole numbers and a number."""
    lines = [line.split() for line in text.split(b"\n")[:-1]]
    if any(
        len(words) != 3 or not NUMBER.match(words[2]) or not all(word.lstrip(b"+").isdigit() for word in words[:2])
        for words in lines
    ):
        return None
    return [np.array([float(words[k]) for words in lines]) for k in range(3)]


def written(chance, layout, n_lines):
    triplets = [
        (
            chance.randint(1, 10 ** chance.randint(1, 6)),
            chance.randint(1, 999),
            chance.gauss(0, 10 ** chance.gauss(0, 5)),
        )
        for _ in range(n_lines)
    ]
    return "".join(layout.format(*triplet) + "\n" for triplet in triplets).encode()


@pytest.mark.parametrize("layout", LAYOUTS)
def test_whole_texts_are_taken_as_they_are(layout):
    text = written(random.Random(1), layout, 3000)
    assert len(text) > BLOCK / 3
    text = text * (1 + BLOCK // len(text)) * 2  # several blocks, cut at any place of a line
    found = regular_triplets(LongText(text))
    assert found is not None
    for ours, theirs, first in zip(found, strict(text), (1, 1, 0), strict=True):
        np.testing.assert_array_equal(ours, theirs - first)


@pytest.mark.parametrize("layout", LAYOUTS)
def test_damaged_texts_are_none_or_what_a_strict_reading_gives(layout):
    taken = 0
    for seed in range(400):
        chance = random.Random(seed)
        text = bytearray(written(chance, layout, chance.randint(1, 30)))
        for _ in range(chance.randint(1, 3)):
            at, kind = chance.randrange(len(text)), chance.randrange(5)
            if kind == 0:
                text[at : at + 1] = bytes([chance.choice(b"0123456789+-.eE \n\r\t\x00D,")])
            elif kind == 1:
                del text[at : at + chance.randint(1, 9)]
            elif kind == 2:
                text[at:at] = bytes(chance.choice(b"0123456789+-.eE \n") for _ in range(chance.randint(1, 4)))
            elif kind == 3:
                text[at:at] = text[at : at + chance.randint(1, 20)]
            else:
                text[at:at] = text[max(at - 30, 0) : at]
            text = text or bytearray(b"\n")
        regular_column(LongText(bytes(text)))
        found = regular_triplets(LongText(bytes(text)))
        if found is None:
            continue
        taken += 1
        expected = strict(bytes(text))
        assert expected is not None, bytes(text)
        for ours, theirs, first in zip(found, expected, (1, 1, 0), strict=True):
            np.testing.assert_array_equal(ours, theirs - first)
    assert taken > 20  # some damage leaves numbers


@pytest.mark.parametrize("layout", ["{:.16e}", "{:25.15E}", "{!r}", "{:.17g}", "{: .15e}", "{:.20e}", "{:.8e}"])
@pytest.mark.parametrize("mark", ["e", "D"])
def test_every_value_is_that_of_float_bit_for_bit(layout, mark):
    """But for -0.0, of which the parser of columns makes 0.0; both are left out of a sparse matrix."""
    chance = random.Random(7)
    bits = np.array([chance.getrandbits(64) for _ in range(5000)], np.uint64).view(np.float64)
    edges = [0.0, 5e-324, -2.2250738585072014e-308, 1.7976931348623157e308, 2.0**53 + 2, 1e22, 1e23]
    ordinary = [chance.gauss(0, 10 ** chance.uniform(-20, 20)) for _ in range(5000)]
    words = [layout.format(value) for value in [*bits[np.isfinite(bits)].tolist(), *edges, *ordinary]]
    expected = np.array([float(word) for word in words])
    finite = np.isfinite(expected)  # few digits round the largest up to infinity
    text = "".join(word + "\n" for word, kept in zip(words, finite, strict=True) if kept)
    found = regular_column(LongText(text.replace("e", mark).replace("E", mark).encode()))
    np.testing.assert_array_equal(found.view(np.int64), expected[finite].view(np.int64))


def layout_of(text, n_words=3):
    return FixedLayout.of(text[: text.index(b"\n") + 1], n_words, b" \t\r\n", b"eE")


def characters(text):
    return np.frombuffer(text, np.uint8)


@pytest.mark.parametrize(
    "layout",
    ["{} {} {:.15E}", "{} {} {:20.13e}", "{:9d}{:9d} {:24.16E}", "{}\t{} {: .15e}", "{} {} {:.4f}\r", "{} {} {:.0f}"],
)
def test_numbers_that_end_alike_are_accounted_for_by_counting(layout):
    text = written(random.Random(2), layout, 500)
    words = layout_of(text).words(characters(text))
    assert words.shape == (500, 3)
    lines = text.split(b"\n")[:-1]
    starts = np.cumsum([0, *(len(line) + 1 for line in lines[:-1])])
    for line, start, found in zip(lines, starts.tolist(), words.tolist(), strict=True):
        expected = [match.start() + start for match in re.finditer(rb"\S+", line)]
        assert found == expected


@pytest.mark.parametrize(
    "line",
    [
        b"12 34 1.5e+5",  # another length
        b"12 3.4 1.50e+05",
        b"12 34.5678 8901234e+05",
        b"12 3 4 1.50e+05",
        b"12 1.50e+05",
        b"12 -3 1.50e+05",
        b"12 34 1.50e 05",
        b"12 34 1.50e+ 5",
        b"12 34 1.50e+0-",
        b"12 34 1.5.e+05",
        b"12 34 1.5ee+05",
        b"12 34 1-50e+05",
        b"12 34 --.50e+05",
        b"12 34 1.50e+05 ",
        b" 12 34 1.50D+05",
        b"12 34 1 .50e+05",
        b"12\x00 34 1.50e+05",
        b"",
    ],
)
def test_no_other_line_among_numbers_that_end_alike_is_accounted_for(line):
    """Also where as many other lines make up for what is missing in this one."""
    usual = b"7 8 9.25e-03\n"
    for other in (b"", b"12 34\n", b"12 34 1.50e+05 6\n", b"12 34 150e+05\n", b"12 34 1..50e+05\n", b"12 3434 1.50e\n"):
        text = usual + line + b"\n" + usual + other + usual
        assert layout_of(text).words(characters(text)) is None


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("share", [0.5, 0.999, 1.0, 1.01, 2.0])
def test_a_wrong_estimate_of_the_lines_changes_nothing(monkeypatch, layout, share):
    content = written(random.Random(4), layout, 3000) * 5
    expected = regular_triplets(LongText(content))
    assert len(expected[0]) == 15000
    monkeypatch.setattr(LongText, "about_lines", lambda text: int(share * text.count_lines()))
    for ours, theirs in zip(regular_triplets(LongText(content)), expected, strict=True):
        np.testing.assert_array_equal(ours, theirs)
    column = b"".join(b"%d\n" % number for number in range(40000))
    np.testing.assert_array_equal(regular_column(LongText(column)), np.arange(40000))
    # A line of another kind stays one, wherever the estimate ends.
    assert regular_triplets(LongText(content + b"1 1 1.5 7\n")) is None
    assert regular_triplets(LongText(content + b" " * (2 * BLOCK) + b"1 1 1.5\n")) is None


@pytest.mark.parametrize("separators", [",  , ", "     ", ", ,,, "])
def test_pairs_of_node_and_dof(separators):
    chance = random.Random(3)
    rows = [
        (chance.randint(1, 10**8), chance.randint(1, 6), chance.randint(1, 99), 3, chance.gauss(0, 1))
        for _ in range(9999)
    ]
    a, b, c = separators[:1], separators[1:-1] if separators.strip() else "   ", " "
    text = "".join(f"{i}{a}{d}{b}{j}{a}{e}{c}{v:.16e}\n" for i, d, j, e, v in rows).encode()
    found = regular_labelled_triplets(LongText(text))
    expected = np.array(rows)
    np.testing.assert_array_equal(found[0], 100 * expected[:, 0] + expected[:, 1])
    np.testing.assert_array_equal(found[1], 100 * expected[:, 2] + expected[:, 3])
    np.testing.assert_array_equal(found[2], expected[:, 4])


@pytest.mark.parametrize(
    "line",
    [
        "1,11, 2,1, 1.5",
        "1,01, 2,1, 1.5",
        "1, 1, 2,1, 1.5",
        "-1,1, 2,1, 1.5",
        "1,1, 2,1",
        "1,1, 2,1, 1.5, 2",
        "1\n1 2 1 1.5",
    ],
)
def test_other_pairs_are_left_to_the_slower_parser(line):
    text = f"1,1, 1,1, 2.5\n{line}\n3,1, 3,1, 1.5\n".encode()
    assert regular_labelled_triplets(LongText(text)) is None


@pytest.mark.parametrize("wrong", [-1, 0, 1, 2, 4, 1000, 10**14])
def test_a_wrong_number_of_lines_is_not_believed_nor_memory_taken_for_it(wrong):
    found = regular_triplets(LongText(b"1 1 1.5\n2 1 2.5\n2 2 3.5\n"), wrong)
    assert [part.tolist() for part in found] == [[0, 1, 1], [0, 0, 1], [1.5, 2.5, 3.5]]


def test_texts_that_crash_the_parser_never_reach_it():
    """A zero byte and an empty array end scipy's parser, and with it Python."""
    for text in (
        b"",
        b"\n",
        b"1 1 1.0\x00\n2 2 2.0\n",
        b"1 1 1.0",
        b" \n \n",
        b"1 1 1.0\n" + b"1" * (2 * BLOCK) + b"\n",
    ):
        assert regular_triplets(LongText(text)) is None
        assert regular_column(LongText(text)) is None
