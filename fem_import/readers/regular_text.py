"""Lines of numbers, one like the other, parsed by scipy's fast Matrix Market parser.

That parser works on all cores, but passes over what follows a number on its line: 1.0D0 would be 1 and 1.5-105
would be 1.5. So every byte is looked at on its way there, while the other cores parse what went before, and the
result counts only if the text leaves nothing over. What is not so regular is None here: slower parsers, which say
what is wrong and where, take it.
"""

from __future__ import annotations

import io
from collections.abc import Iterator
from inspect import signature
from typing import IO, Any, TypeAlias, cast

import numpy as np
from numpy.typing import NDArray
from scipy import io as scipy_io
from scipy import sparse

IntArray: TypeAlias = NDArray[np.int32] | NDArray[np.int64]
FloatArray: TypeAlias = NDArray[np.float64]
Bytes: TypeAlias = "bytes | memoryview[int]"

BLOCK = 1 << 17  # bytes; stays in the cache
_NEWLINE = ord("\n")
_FOUR_BYTES = 2**31 - 1

# Which kind of sparse result is asked for: newer SciPy warns where it is left to the default, older has no choice.
_AS_ARRAY: dict[str, Any] = {"spmatrix": False} if "spmatrix" in signature(scipy_io.mmread).parameters else {}

# Bits 0-3 of a class say what may not follow it, bits 4-7 what it may not follow, so that
# (first << 4) & second is zero for every pair that a sequence of numbers can have:
#   0: no sign follows a digit, dot or sign       1: no blank follows a sign or exponent
#   2: no exponent follows a blank, sign, exponent   3: no dot follows a dot or exponent
_BLANK, _DIGIT, _DOT, _SIGN, _EXPONENT, _OTHER = 0x24, 0x01, 0x89, 0x17, 0x4E, 0xFF


def _byte_classes(exponents: bytes) -> bytes:
    classes = np.full(256, _OTHER, np.uint8)
    for characters, kind in (
        (b" \t\r\n", _BLANK),
        (b"0123456789", _DIGIT),
        (b".", _DOT),
        (b"+-", _SIGN),
        (exponents, _EXPONENT),
    ):
        classes[list(characters)] = kind
    return classes.tobytes()


_CLASSES = _byte_classes(b"eE")
_CLASSES_OF_FORTRAN = _byte_classes(b"eEdD")
_FROM_FORTRAN = bytes.maketrans(b"Dd", b"Ee")


def regular_triplets(content: Bytes, largest: int = _FOUR_BYTES) -> tuple[IntArray, IntArray, FloatArray] | None:
    """Return rows and columns (base 0) and values of lines "row column value"; None where they are not regular.

    Indices are 32 bits wide unless `largest` asks for more.
    """
    n_lines = count_lines(content)
    header = f"%%MatrixMarket matrix coordinate real general\n{largest} {largest} {n_lines}\n"
    found = _parsed(header, content, n_lines, 3)
    if found is None:
        return None
    matrix = sparse.coo_array(found)
    return matrix.row, matrix.col, np.asarray(matrix.data, dtype=np.float64)


def regular_column(content: Bytes) -> FloatArray | None:
    """Return the numbers of lines with one number each, Fortran's 1.0D0 too; None where they are not regular."""
    n_lines = count_lines(content)
    header = f"%%MatrixMarket matrix array real general\n{n_lines} 1\n"
    found = _parsed(header, content, n_lines, 1, fortran=b"D" in bytes(content[:1000]).upper())
    return None if found is None else np.asarray(found, dtype=np.float64).ravel()


def count_lines(content: Bytes) -> int:
    """Return the number of line ends."""
    return sum(int(np.count_nonzero(np.frombuffer(block, np.uint8) == _NEWLINE)) for block in blocks_of(content))


def blocks_of(content: Bytes) -> Iterator[memoryview[int]]:
    """Yield a text in blocks that stay in the cache."""
    view = memoryview(content)
    for start in range(0, len(view), BLOCK):
        yield view[start : start + BLOCK]


def _parsed(header: str, content: Bytes, n_lines: int, words_a_line: int, fortran: bool = False) -> Any:
    if n_lines == 0:
        return None  # the parser divides by it
    checked = _CheckedText(header, content, fortran)
    try:
        found = scipy_io.mmread(cast("IO[bytes]", checked), **_AS_ARRAY)
    except (ValueError, OverflowError):
        return None
    return found if checked.is_regular(n_lines, words_a_line) else None


class _CheckedText(io.RawIOBase):
    """A header and a text as one stream that looks at each block as the parser asks for it."""

    def __init__(self, header: str, content: Bytes, fortran: bool) -> None:
        self._header = header.encode()
        self._blocks = blocks_of(content)
        self._classes = np.empty(BLOCK + 1, np.uint8)
        self._classes[0] = _BLANK  # what stands before the first byte, and later the last byte of the block before
        self._pairs = np.empty(BLOCK, np.uint8)
        self._is_blank = np.empty(BLOCK + 1, bool)
        self._flags = np.empty(BLOCK, bool)
        self._n_words = self._n_dots = self._n_exponents = 0
        self._is_clean = True
        self._fortran = fortran

    def readable(self) -> bool:
        return True

    def read(self, size: int = -1) -> bytes:
        # A whole block whatever `size` says, which is 1024: forty thousand calls for a file of 40 MB otherwise.
        if self._header:
            header, self._header = self._header, b""
            return header
        text = bytes(next(self._blocks, b""))
        self._look_at(text)
        if not self._is_clean:
            return b""  # the parser crashes on a zero byte, so it gets nothing that is not clean
        return text.translate(_FROM_FORTRAN) if self._fortran else text

    def is_regular(self, n_lines: int, words_a_line: int) -> bool:
        """Whether these were lines of words of digits, the last of each alike with a dot, an exponent, both or none."""
        return (
            self._is_clean
            and bool(self._classes[0] == _BLANK)
            and self._n_words == words_a_line * n_lines
            and self._n_dots in (0, n_lines)
            and self._n_exponents in (0, n_lines)
        )

    def _look_at(self, text: bytes) -> None:
        n = len(text)
        classes, flags = self._classes[: n + 1], self._flags[:n]
        classes[1:] = np.frombuffer(text.translate(_CLASSES_OF_FORTRAN if self._fortran else _CLASSES), np.uint8)
        pairs = np.multiply(classes[:-1], 16, out=self._pairs[:n])  # shifts of bytes are ten times slower in NumPy
        pairs &= classes[1:]
        self._is_clean = self._is_clean and not pairs.any()
        is_blank = np.equal(classes, _BLANK, out=self._is_blank[: n + 1])
        self._n_words += np.count_nonzero(np.greater(is_blank[:-1], is_blank[1:], out=flags))
        self._n_dots += np.count_nonzero(np.equal(classes[1:], _DOT, out=flags))
        self._n_exponents += np.count_nonzero(np.equal(classes[1:], _EXPONENT, out=flags))
        classes[0] = classes[-1]
