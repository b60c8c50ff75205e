"""Whether a text is lines of so many numbers, of which the last has its dot and exponent at one distance from the end.

So most programs print, whatever the other numbers' lengths and the signs. Then counting is a proof: every line has
so many words, one dot and one exponent, the places of the signs account for all signs, and what else there is are
digits.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Places: TypeAlias = NDArray[np.int64]
Characters: TypeAlias = NDArray[np.uint8]

_NEWLINE, _BLANK, _DOT, _PLUS, _MINUS, _ZERO = b"\n .+-0"


@dataclass(frozen=True)
class FixedLayout:
    """What the first line of a text shows.

    Attributes
    ----------
    n_words : in a line.
    blanks : the characters between words.
    dot, exponent : their distances from the end of the last word, 0 where there is none.
    exponent_mark : its letter.
    has_exponent_sign : whether a sign follows it.
    n_after : the characters between the last word and the line's end.
    is_indented : whether blanks stand before the first word.
    """

    n_words: int
    blanks: bytes
    dot: int
    exponent: int
    exponent_mark: int
    has_exponent_sign: bool
    n_after: int
    is_indented: bool

    @classmethod
    def of(cls, line: bytes, n_words: int, blanks: bytes, exponents: bytes) -> FixedLayout | None:
        """Return the layout of a line; None where it is none of this kind."""
        words = line.translate(bytes.maketrans(blanks, b" " * len(blanks))).split()
        if len(words) != n_words:
            return None
        last = words[-1]
        mantissa = last.translate(bytes.maketrans(exponents, b"e" * len(exponents))).split(b"e")[0]
        dot = len(last) - last.find(b".") if b"." in mantissa else 0
        exponent = len(last) - len(mantissa)
        has_sign = exponent > 1 and last[1 - exponent] in (_PLUS, _MINUS)
        if not last[-1:].isdigit() or (exponent and not dot) or (dot and dot - exponent < 2):
            return None  # nothing shows that each line has a digit where one must be
        return cls(
            n_words=n_words,
            blanks=bytes(set(line) & set(blanks) - {_NEWLINE}),
            dot=dot,
            exponent=exponent,
            exponent_mark=last[-exponent] if exponent else 0,
            has_exponent_sign=has_sign,
            n_after=len(line) - len(line.rstrip(blanks)) - 1,
            is_indented=line[0] in blanks,
        )

    def words(self, text: Characters) -> Places | None:
        """Return where the words of each line start, (n_lines, n_words); None where not all lines are like this."""
        n = len(text)
        is_blank = np.empty(n + 1, bool)
        is_blank[0] = True
        np.less_equal(text, _BLANK, out=is_blank[1:])  # and all control characters: only those meant are counted
        n_blanks = 0
        for character in self.blanks:
            flags = text == character
            n_blanks += np.count_nonzero(flags)
            if character > _BLANK:
                is_blank[1:] |= flags
        starts = np.flatnonzero(is_blank[:-1] > is_blank[1:])
        n_lines, rest = divmod(len(starts), self.n_words)
        if rest or not n_lines:
            return None
        words = starts.reshape(n_lines, self.n_words)
        if self.is_indented:
            ends = np.flatnonzero(text == _NEWLINE)
            if len(ends) != n_lines or (words[:, -1] > ends).any() or (words[1:, 0] < ends[:-1]).any():
                return None
        else:
            ends = np.empty(n_lines, np.int64)
            np.subtract(words[1:, 0], 1, out=ends[:-1])
            ends[-1] = n - 1
            if not (text.take(ends) == _NEWLINE).all():
                return None
        # So each line has its words. The last one ends as in the first line:
        ends -= self.n_after
        if self.n_after and not is_blank.take(ends + 1).all():
            return None
        n_marks = self._count_marks(text, np.ascontiguousarray(words[:, -1]), ends)
        if n_marks is None:
            return None
        return words if np.count_nonzero(are_digits(text)) + n_blanks + n_lines + n_marks == n else None

    def _count_marks(self, text: Characters, starts: Places, ends: Places) -> int | None:
        """Return how many characters of the last words are no digits where they have their marks in place."""
        if not are_digits(text.take(ends - 1)).all() or (ends - max(self.dot, 1) < starts).any():
            return None
        # What stands before the digits: signs, as the parser takes nothing else there.
        count = int(np.count_nonzero(text.take(starts) < _ZERO))
        for character, distance in ((_DOT, self.dot), (self.exponent_mark, self.exponent)):
            if distance:
                if not (text.take(ends - distance) == character).all():
                    return None
                count += len(starts)
        if self.has_exponent_sign:
            if ((text.take(ends - (self.exponent - 1)) - _PLUS) & ~np.uint8(_MINUS - _PLUS)).any():
                return None
            count += len(starts)
        return count


def are_digits(characters: Characters) -> NDArray[np.bool_]:
    """Return which characters are digits."""
    # One comparison: what is below "0" wraps round to above 9.
    flags: NDArray[np.bool_] = np.subtract(characters, _ZERO) <= 9
    return flags
