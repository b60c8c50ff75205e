"""Arithmetic in text, as ``12*E*I/L^3``: parsed and calculated here, never executed."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

from ibsdyn.errors import ExpressionError, nearest

CONSTANTS: Mapping[str, float] = {"pi": math.pi}
FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "asin": math.asin,
    "acos": math.acos,
    "atan": math.atan,
    "exp": math.exp,
    "log": math.log,
    "abs": abs,
}
# Far above what anybody writes by hand, far below what takes time or stack.
MAX_LENGTH = 1000
MAX_DEPTH = 40

_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?)|(?P<name>[^\W\d]\w*)|(?P<sign>\*\*|[-+*/^()]))"
)


@dataclass(frozen=True)
class _Token:
    kind: str
    text: str
    place: int


def evaluate(text: str, parameters: Mapping[str, float] | None = None) -> float:
    """Return the value of an expression.

    Parameters
    ----------
    text : numbers, names of parameters, ``pi``, ``+ - * / ^ **``, parentheses, and sqrt, sin, cos, tan, asin, acos,
        atan (angles in rad), exp, log (natural) and abs. ``^`` and ``**`` bind strongest and from the right: ``-2^2``
        is -4.
    parameters : {name: value}.

    Raises
    ------
    ExpressionError : not such an expression, an unknown name, or no finite real value.
    """
    return _Calculation(text, parameters or {}).value()


def evaluate_all(expressions: Mapping[str, str | float]) -> dict[str, float]:
    """Return the values of parameters that may be expressions of each other, in any order.

    Parameters
    ----------
    expressions : {name: number or expression}.

    Returns
    -------
    {name: value} in the order given.

    Raises
    ------
    ExpressionError : a name that cannot be one, parameters in a circle, or an expression that is wrong.
    """
    for name in expressions:
        _refuse_bad_name(name)
    graph = {
        name: _names(name, value, expressions) if isinstance(value, str) else set()
        for name, value in expressions.items()
    }
    try:
        order = list(TopologicalSorter(graph).static_order())
    except CycleError as error:
        raise ExpressionError(f"parameters depend on each other in a circle: {' -> '.join(error.args[1])}.") from None
    values: dict[str, float] = {}
    for name in order:
        expression = expressions[name]
        try:
            values[name] = evaluate(expression, values) if isinstance(expression, str) else float(expression)
        except ExpressionError as error:
            raise ExpressionError(f"{name}: {error}") from None
    return {name: values[name] for name in expressions}


def _refuse_bad_name(name: str) -> None:
    if name in FUNCTIONS or name in CONSTANTS:
        raise ExpressionError(f"a parameter cannot be called {name!r}; that is what expressions call their own.")
    match = _TOKEN.fullmatch(name)
    if match is None or match.lastgroup != "name" or name != name.strip():
        raise ExpressionError(
            f"a parameter cannot be called {name!r}; a name starts with a letter and has letters, digits and _ only."
        )


def _names(owner: str, text: str, known: Mapping[str, object]) -> set[str]:
    try:
        return {token.text for token in _tokens(text) if token.kind == "name" and token.text in known}
    except ExpressionError as error:
        raise ExpressionError(f"{owner}: {error}") from None


def _tokens(text: str) -> Iterator[_Token]:
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"an expression has at most {MAX_LENGTH} characters, this one {len(text)}.")
    place, end = 0, len(text.rstrip())
    while place < end:
        match = _TOKEN.match(text, place)
        if match is None or match.lastgroup is None:
            wrong = text[place:].lstrip()[0]
            hint = " Decimals are written with a point." if wrong == "," else ""
            raise ExpressionError(f"{text!r}: {wrong!r} is not part of an expression.{hint}")
        yield _Token(match.lastgroup, match[match.lastgroup], match.start(match.lastgroup))
        place = match.end()


class _Calculation:
    """One pass over the tokens: sums of products of powers of numbers, names, calls and parentheses."""

    def __init__(self, text: str, parameters: Mapping[str, float]) -> None:
        self._text = text
        self._parameters = parameters
        self._tokens = list(_tokens(text))
        self._next = 0
        self._depth = 0

    def value(self) -> float:
        try:
            value = self._sum()
        except ZeroDivisionError:
            raise self._error("divides by zero") from None
        except OverflowError:
            raise self._error("is too large a number") from None
        if self._next < len(self._tokens):
            raise self._error(f"{self._tokens[self._next].text!r} follows where the expression could end")
        if not math.isfinite(value):
            raise self._error(f"comes to {value}, which is no finite number")
        return value

    def _sum(self) -> float:
        value = self._product()
        while (sign := self._take("+", "-")) is not None:
            other = self._product()
            value = value + other if sign == "+" else value - other
        return value

    def _product(self) -> float:
        value = self._signed()
        while (sign := self._take("*", "/")) is not None:
            other = self._signed()
            value = value * other if sign == "*" else value / other
        return value

    def _signed(self) -> float:
        factor = 1.0
        while (sign := self._take("+", "-")) is not None:
            factor = -factor if sign == "-" else factor
        return factor * self._power()

    def _power(self) -> float:
        base = self._atom()
        if self._take("^", "**") is None:
            return base
        self._enter()
        exponent = self._signed()
        self._depth -= 1
        value = base**exponent
        if isinstance(value, complex):
            raise self._error(f"takes the power {exponent:g} of {base:g}, which is no real number")
        return float(value)

    def _atom(self) -> float:
        if self._next == len(self._tokens):
            raise self._error("ends where a number or a name should follow" if self._tokens else "is empty")
        token = self._tokens[self._next]
        self._next += 1
        if token.kind == "number":
            return float(token.text)
        if token.kind == "name":
            return self._named(token.text)
        if token.text != "(":
            raise self._error(f"{token.text!r} stands where a number or a name should be")
        return self._parenthesis()

    def _named(self, name: str) -> float:
        if name in FUNCTIONS:
            if self._take("(") is None:
                raise self._error(f"{name} needs its argument in parentheses")
            argument = self._parenthesis()
            try:
                return float(FUNCTIONS[name](argument))
            except ValueError:
                raise self._error(f"{name}({argument:g}) is no real number") from None
        if name in self._parameters:
            return self._parameters[name]
        if name in CONSTANTS:
            return CONSTANTS[name]
        raise self._error(f"{name!r} is not known. {nearest(name, (*self._parameters, *CONSTANTS, *FUNCTIONS))}")

    def _parenthesis(self) -> float:
        self._enter()
        value = self._sum()
        self._depth -= 1
        if self._take(")") is None:
            raise self._error("a parenthesis is not closed")
        return value

    def _enter(self) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise self._error(f"is nested more than {MAX_DEPTH} deep")

    def _take(self, *signs: str) -> str | None:
        if self._next < len(self._tokens) and self._tokens[self._next].text in signs:
            self._next += 1
            return self._tokens[self._next - 1].text
        return None

    def _error(self, words: str) -> ExpressionError:
        shown = self._text if len(self._text) <= 60 else self._text[:57] + "..."
        return ExpressionError(f"{shown!r}: {words.removesuffix('.')}.")
