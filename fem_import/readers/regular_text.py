"""Lines of numbers, one like the other, parsed by scipy's fast Matrix Market parser.

That parser works on all cores, but passes over what follows a number on its line: 1.0D0 would be 1 and 1.5-105
would be 1.5. So every byte is accounted for on its way there, while the other cores parse what went before, and the
result counts only if the text leaves nothing over: by counting where numbers end alike (fixed_layout), else mark by
mark. What is not so regular is None here: slower parsers, which say what is wrong and where, take it.
"""

from __future__ import annotations

import io
from inspect import signature
from typing import IO, Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from scipy import io as scipy_io

from fem_import.readers.fixed_layout import FixedLayout, Places, are_digits
from fem_import.readers.long_text import LongText

IntArray: TypeAlias = NDArray[np.signedinteger[Any]]
FloatArray: TypeAlias = NDArray[np.float64]

_NEWLINE = ord("\n")
_LARGEST_INDEX = 2**31 - 1  # so indices take 32 bits; beyond it the slower parsers do the work
_LARGEST_PAIR = 10**17

# Which kind of sparse result is asked for: newer SciPy warns where it is left to the default, older has no choice.
_AS_ARRAY: dict[str, Any] = {"spmatrix": False} if "spmatrix" in signature(scipy_io.mmread).parameters else {}

# Bits 0-3 of a class say what may not follow it, bits 4-7 what it may not follow, so that
# (first << 4) & second is zero for every pair that a sequence of numbers can have:
#   0: no sign follows a digit, dot or sign          1: no blank follows a sign or exponent
#   2: no exponent follows a blank, sign, exponent   3: no dot follows a dot or exponent
_BLANK, _DIGIT, _DOT, _SIGN, _EXPONENT, _OTHER = 0x24, 0x01, 0x89, 0x17, 0x4E, 0xFF


def _byte_classes(exponents: bytes = b"eE", blanks: bytes = b" \t\r\n") -> bytes:
    classes = np.full(256, _OTHER, np.uint8)
    for characters, kind in (
        (blanks, _BLANK),
        (b"0123456789", _DIGIT),
        (b".", _DOT),
        (b"+-", _SIGN),
        (exponents, _EXPONENT),
    ):
        classes[list(characters)] = kind
    return classes.tobytes()


def regular_triplets(text: LongText, n_lines: int | None = None) -> tuple[IntArray, IntArray, FloatArray] | None:
    """Return rows and columns (base 0) and values of lines "row column value"; None where they are not regular.

    n_lines : how many there should be, if that is known; it is not believed.
    """
    return _coordinates(text, n_lines, _LARGEST_INDEX, 3, _CheckedText)


def regular_labelled_triplets(text: LongText) -> tuple[IntArray, IntArray, FloatArray] | None:
    """Return rows, columns and values of lines "node, dof, node, dof, value"; None where they are not regular.

    Rows and columns are 100 node + dof, dof 1..6. One comma or blank parts a pair, any number of them what
    lies between.
    """
    found = _coordinates(text, None, _LARGEST_INDEX, 5, _PairedText)
    if found is None:  # perhaps only as a label is above 21 million, which takes 64 bits
        found = _coordinates(text, None, _LARGEST_PAIR, 5, _PairedText)
    if found is None:
        return None
    rows, columns, values = found
    rows += 1
    columns += 1
    return rows, columns, values


def regular_column(text: LongText) -> FloatArray | None:
    """Return the numbers of lines with one number each, Fortran's 1.0D0 too; None where they are not regular."""
    has_d = b"D" in text[:1000].upper()
    found = _parsed("array real general\n{} 1", text, None, 1, _FortranText if has_d else _CheckedText)
    return None if found is None else np.asarray(found[0], dtype=np.float64).ravel()[: found[1]]


def _coordinates(
    text: LongText, n_lines: int | None, largest: int, words_a_line: int, kind: type[_CheckedText]
) -> tuple[IntArray, IntArray, FloatArray] | None:
    header = f"coordinate real general\n{largest} {largest} {{}}"
    found = _parsed(header, text, n_lines, words_a_line, kind)
    if found is None:
        return None
    entries, count = found
    values = np.asarray(entries.data, dtype=np.float64)
    return np.asarray(entries.row)[:count], np.asarray(entries.col)[:count], values[:count]


def _parsed(
    header: str, text: LongText, n_lines: int | None, words_a_line: int, kind: type[_CheckedText]
) -> tuple[Any, int] | None:
    """Return what the parser makes of the text, and how many lines it has; more may follow in what is returned.

    n_lines : how many there should be; they are estimated if that is None or cannot be. {} stands for them in the
    header.
    """
    most = len(text) // (2 * words_a_line)  # the parser takes memory for as many as are announced
    room = n_lines if n_lines is not None and 0 < n_lines <= most else text.about_lines()
    if not 0 < room <= most or text[-1:] != b"\n":
        return None  # the parser divides by the number of lines
    checked = kind(f"%%MatrixMarket matrix {header.format(room)}\n", text, words_a_line, room)
    try:
        found = scipy_io.mmread(cast("IO[bytes]", checked), **_AS_ARRAY)
    except (ValueError, OverflowError):
        found = None
    if checked.is_overfull:
        return _parsed(header, text, text.count_lines(), words_a_line, kind)
    return (found, checked.n_lines) if found is not None and checked.is_regular else None


class _CheckedText(io.RawIOBase):
    """A header and a text as one stream that looks at each block as the parser asks for it."""

    blanks = b" \t\r\n"
    exponents = b"eE"
    classes_of_bytes = _byte_classes()

    def __init__(self, header: str, text: LongText, words_a_line: int, room: int) -> None:
        self._header = header.encode()
        self._room = room
        self._nothing = b"0\n" if words_a_line == 1 else b"1 1 0\n"
        self._blocks, self._left = text.blocks_of_lines(), len(text)
        self._words_a_line = words_a_line
        self._layout: FixedLayout | None = None
        self._words: Places = np.empty((0, words_a_line), np.int64)
        self.n_lines = 0
        self.is_clean = True

    def rewritten(self, text: bytes) -> bytes:
        """Return a clean block as the parser shall have it."""
        return text

    def readable(self) -> bool:
        """Whether this can be read, as the parser asks."""
        return True

    def read(self, size: int = -1) -> bytes:
        """Return a whole block whatever `size` says, which is 1024: forty thousand calls for 40 MB otherwise."""
        if self._header:
            header, self._header = self._header, b""
            return header
        text = next(self._blocks, b"")
        if not text:
            # The parser wants as many as announced.
            filling, self._nothing = self._nothing * (self._room - self.n_lines), b""
            return filling if self.is_clean else b""
        self._left -= len(text)
        self.is_clean = self.is_clean and self._is_clean(text)
        # The parser crashes on a zero byte, so it gets nothing that is not clean.
        return self.rewritten(text) if self.is_clean and not self.is_overfull else b""

    @property
    def is_overfull(self) -> bool:
        """Whether there are more lines than announced."""
        return self.n_lines > self._room

    @property
    def is_regular(self) -> bool:
        """Whether all of the text has been looked at and leaves nothing over."""
        return self._left == 0 and self.is_clean and not self.is_overfull

    def _is_clean(self, text: bytes) -> bool:
        """Whether these are lines of so many numbers, of which only the last may have a dot and an exponent."""
        if self._layout is None and not self.n_lines:
            line = text[: text.index(b"\n") + 1]
            self._layout = FixedLayout.of(line, self._words_a_line, self.blanks, self.exponents)
        words = self._layout.words(np.frombuffer(text, np.uint8)) if self._layout is not None else None
        if words is None:
            words = self._words_line_by_line(text)
        if words is None:
            return False
        self.n_lines += len(words)
        self._words = words
        return True

    def _words_line_by_line(self, text: bytes) -> Places | None:
        """Return where the words start, (n_lines, n_words), if lines of any layout are numbers; None if not."""
        n = len(text)
        classes = np.empty(n + 1, np.uint8)
        classes[0] = _BLANK  # stands before the block
        classes[1:] = np.frombuffer(text.translate(self.classes_of_bytes), np.uint8)
        pairs = classes[:-1] * np.uint8(16)  # shifts of bytes are ten times slower in NumPy
        pairs &= classes[1:]
        if pairs.any():
            return None
        is_blank = classes == _BLANK
        starts = np.flatnonzero(is_blank[:-1] > is_blank[1:])
        ends = np.flatnonzero(np.frombuffer(text, np.uint8) == _NEWLINE)
        if len(starts) != self._words_a_line * len(ends):
            return None
        words = starts.reshape(len(ends), self._words_a_line)
        if np.any(words[:, -1] > ends) or np.any(words[1:, 0] < ends[:-1]):
            return None
        places = []
        for kind in (_DOT, _EXPONENT):
            marks = np.flatnonzero(classes[1:] == kind)
            lines = np.searchsorted(ends, marks)
            if np.any(np.diff(lines) == 0) or np.any(marks < words[lines, -1]):
                return None
            place = np.full(len(ends), n if kind == _EXPONENT else -1)
            place[lines] = marks
            places.append(place)
        return words if np.all(places[0] < places[1]) else None


class _FortranText(_CheckedText):
    """Numbers such as 1.0D0."""

    exponents = b"eEdD"
    classes_of_bytes = _byte_classes(exponents=exponents)

    def rewritten(self, text: bytes) -> bytes:
        """Return the block with exponents as the parser knows them."""
        return text.translate(bytes.maketrans(b"Dd", b"Ee"))


class _PairedText(_CheckedText):
    """Lines "node, dof, node, dof, value" rewritten as three numbers: the pair 12,3 becomes 1203."""

    blanks = b" \t\r\n,"
    classes_of_bytes = _byte_classes(blanks=blanks)

    def rewritten(self, text: bytes) -> bytes:
        """Return the block with a zero for the blank or comma within each pair."""
        if not text:
            return b""
        result: NDArray[np.uint8] = np.frombuffer(text, np.uint8).copy()
        is_comma = result == ord(",")
        if is_comma.any():
            result -= is_comma.view(np.uint8) * np.uint8(ord(",") - ord(" "))
        for column in (1, 3):
            dofs = np.ascontiguousarray(self._words[:, column])
            # One character parts each pair, on one line, and the second of it is a displacement or a rotation.
            is_pair = are_digits(result.take(dofs - 2)) & ~are_digits(result.take(dofs + 1))
            is_pair &= result.take(dofs - 1) != _NEWLINE
            is_pair &= result.take(dofs) - ord("1") <= 5  # what is below "1" wraps round
            if not is_pair.all():
                self.is_clean = False
                return b""
            result[dofs - 1] = ord("0")
        return result.tobytes()
