"""Expressions against Python's own arithmetic, and what they refuse."""

import contextlib
import math
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

import ibsdyn as ibs
from ibsdyn.expressions import MAX_LENGTH, evaluate, evaluate_all


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        (" .5e-3 ", 0.5e-3),
        ("2 + 3*4", 14.0),
        ("2 - 3 - 4", -5.0),
        ("12/3/2", 2.0),
        ("2^3^2", 512.0),
        ("-2^2", -4.0),
        ("2**-1", 0.5),
        ("--2", 2.0),
        ("(1 + 2) * (3 - 5)", -6.0),
        ("sqrt(2)^2", math.sqrt(2) ** 2),
        ("sin(pi/6) + cos(0)", math.sin(math.pi / 6) + 1),
        ("exp(log(7))", math.exp(math.log(7))),
        ("12*E*I/L^3", 12 * 113e9 * 1.6e-12 / 0.02**3),
        ("µ_1 * 2", 6.0),
    ],
)
def test_values(text, value):
    assert evaluate(text, {"E": 113e9, "I": 1.6e-12, "L": 0.02, "µ_1": 3.0}) == value


# A tree of operations is written out with all parentheses and calculated by Python beside it.
_leaves = st.floats(0.1, 10.0).map(lambda v: (repr(v), v))


def _joined(parts):
    return st.tuples(parts, st.sampled_from("+-*/"), parts).map(
        lambda p: (
            f"({p[0][0]}{p[1]}{p[2][0]})",
            {
                "+": lambda a, b: a + b,
                "-": lambda a, b: a - b,
                "*": lambda a, b: a * b,
                "/": lambda a, b: a / b if b else math.nan,
            }[p[1]](p[0][1], p[2][1]),
        )
    )


@given(st.recursive(_leaves, _joined, max_leaves=20))
def test_any_tree_agrees_with_python(tree):
    text, value = tree
    if math.isfinite(value):
        assert evaluate(text) == value
    else:
        with pytest.raises(ibs.ExpressionError):
            evaluate(text)


@given(st.text(alphabet="0123456789.eEx_+-*/^() sinqrtp,=[]'\"", max_size=40))
def test_any_text_gives_a_finite_number_or_an_error_in_words(text):
    with contextlib.suppress(ibs.ExpressionError):
        assert math.isfinite(evaluate(text, {"x": 2.0}))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "is empty"),
        ("E*I/L^", "ends where a number"),
        ("2(3)", r"'\(' follows where"),
        ("2 x", "'x' follows where"),
        ("0,5", "written with a point"),
        ("(1", "not closed"),
        ("sqrt 2", "sqrt needs its argument"),
        ("*2", r"'\*' stands where"),
        ("1/(2-2)", "divides by zero"),
        ("0^-1", "divides by zero"),
        ("(-8)^(1/3)", "no real number"),
        ("sqrt(-1)", r"sqrt\(-1\) is no real number"),
        ("log(0)", r"log\(0\) is no real number"),
        ("9^9^9^9^9", "too large"),
        ("1e999", "no finite number"),
        ("exp(1000)", "too large"),
        ("__import__('os').system('true')", "'__import__' is not known|is not part of an expression"),
        ("E.__class__", "'.' is not part"),
        ("Len", "Did you mean 'L"),
        ("lambda: 1", "':' is not part"),
        ("[1][0]", r"'\[' is not part"),
    ],
)
def test_what_is_no_expression_is_refused_in_words(text, words):
    with pytest.raises(ibs.ExpressionError, match=words):
        evaluate(text, {"E": 1.0, "I": 1.0, "L": 1.0})


@pytest.mark.parametrize(
    "text", ["(" * 900, "2^" * 499 + "2", "sin(" * 200 + "1" + ")" * 200, "-" * 999 + "1", "9" * 999]
)
def test_long_and_deep_ones_take_no_time_and_no_stack(text):
    start = time.perf_counter()
    with contextlib.suppress(ibs.ExpressionError):
        evaluate(text)
    assert time.perf_counter() - start < 5.0
    with pytest.raises(ibs.ExpressionError, match=f"at most {MAX_LENGTH} characters"):
        evaluate(text + " " * MAX_LENGTH + "1")


def test_parameters_of_parameters_in_any_order():
    values = evaluate_all({"k": "12*E*I/L^3", "I": "b*h^3/12", "E": 113e9, "b": 0.035, "h": 3e-4, "L": 0.02})
    assert list(values) == ["k", "I", "E", "b", "h", "L"]
    assert values["k"] == 12 * 113e9 * (0.035 * 3e-4**3.0 / 12) / 0.02**3.0


def test_a_circle_of_parameters_is_shown():
    with pytest.raises(ibs.ExpressionError, match=r"in a circle: [abc] -> [abc] -> [abc]"):
        evaluate_all({"a": "b + 1", "b": "2*c", "c": "a"})
    with pytest.raises(ibs.ExpressionError, match="in a circle: a -> a"):
        evaluate_all({"a": "a"})


@pytest.mark.parametrize("name", ["pi", "sqrt", "2x", "a b", "a.b", "", " a"])
def test_names_that_cannot_be_parameters(name):
    with pytest.raises(ibs.ExpressionError, match="cannot be called"):
        evaluate_all({name: 1.0})


def test_a_long_chain_of_parameters_needs_no_stack():
    chain = {"p0": 1.0} | {f"p{i}": f"p{i - 1} + 1" for i in range(1, 5000)}
    assert evaluate_all(dict(reversed(chain.items())))["p4999"] == 5000.0
