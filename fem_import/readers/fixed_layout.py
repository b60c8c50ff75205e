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

_NEWLINE, _DOT, _PLUS, _MINUS, _ZERO = b"\n.+-0"


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
        is_newline = text == _NEWLINE
        n_lines = np.count_nonzero(is_newline)
        is_blank = np.empty(n + 1, bool)
        is_blank[0] = True
        is_blank[1:] = is_newline
        for character in self.blanks:
            is_blank[1:] |= text == character
        is_start = is_blank[:-1] > is_blank[1:]
        if np.count_nonzero(is_start) != n_lines * self.n_words:
            return None
        starts = np.flatnonzero(is_start).reshape(n_lines, self.n_words)
        if self.is_indented:
            ends = np.flatnonzero(is_newline)
            if np.any(starts[:, -1] > ends) or np.any(starts[1:, 0] < ends[:-1]):
                return None
        else:
            ends = np.append(starts[1:, 0], n) - 1
            if not np.all(is_newline.take(ends)):
                return None
        # Each line has its words. The last word ends as in the first line:
        ends -= self.n_after
        if self.n_after and not np.all(is_blank.take(ends + 1)):
            return None
        n_blanks = np.count_nonzero(is_blank) - 1
        return starts if self._accounts_for_all(text, np.ascontiguousarray(starts[:, -1]), ends, n_blanks) else None

    def _accounts_for_all(self, text: Characters, starts: Places, ends: Places, n_blanks: int) -> bool:
        """Whether all but the last words, which are there, are digits, and the last are numbers."""
        n_lines = len(starts)
        if not np.all(are_digits(text.take(ends - 1))) or np.any(ends - max(self.dot, 1) < starts):
            return False
        firsts = text.take(starts)
        n_signs = np.count_nonzero(firsts == _MINUS) + np.count_nonzero(firsts == _PLUS)
        n_others = n_blanks
        for character, distance in ((_DOT, self.dot), (self.exponent_mark, self.exponent)):
            if distance:
                if not np.all(text.take(ends - distance) == character) or _count(text, character) != n_lines:
                    return False
                n_others += n_lines
        if self.has_exponent_sign:
            signs = text.take(ends - (self.exponent - 1))
            if not np.all((signs == _PLUS) | (signs == _MINUS)):
                return False
            n_signs += n_lines
        if _count(text, _MINUS) + _count(text, _PLUS) != n_signs:
            return False
        return np.count_nonzero(are_digits(text)) + n_others + n_signs == len(text)


def are_digits(characters: Characters) -> NDArray[np.bool_]:
    """Return which characters are digits."""
    return (characters - np.uint8(_ZERO)) <= 9


def _count(text: Characters, character: int) -> int:
    return int(np.count_nonzero(text == character))
