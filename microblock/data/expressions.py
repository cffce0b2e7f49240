"""Formulas in x as functions of an array: parsed by Python, computed term by term, never executed. Length
and depth are bounded, and powers those of doubles.
"""

import ast
import re
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import LARGEST, BadArgument, require_kind
from ..model.types import Array

LONGEST = 500  # characters
DEEPEST = 100  # terms within terms
FUNCTIONS: dict[str, Any] = {
    name: getattr(np, name)
    for name in (
        *("abs", "sqrt", "cbrt", "exp", "log", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "sinh"),
        *("cosh", "tanh", "sign", "floor", "ceil", "minimum", "maximum", "hypot", "arctan2", "power"),
        *("where", "clip"),
    )
}
OPERATORS: dict[type[ast.AST], np.ufunc] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Pow: np.power,
    ast.USub: np.negative,
    ast.UAdd: np.positive,
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}
ALLOWED = (
    f"allowed are x, numbers up to {LARGEST:g}, pi, e, inf, + - * /, ** for powers, comparisons, "
    f"parentheses, {', '.join(FUNCTIONS)}, in up to {LONGEST} characters and {DEEPEST} nested terms"
)


class _Refused(Exception):
    """The place of what is refused: its first character and the one after it."""

    def __init__(self, start: int, end: int) -> None:
        super().__init__(start, end)
        self.start = start
        self.end = end


def function_of_x(formula: str, name: str = "formula") -> Callable[[ArrayLike], Array]:
    """Returns the function of an array x of a formula such as ``"x**2/20"``; without a value NaN or inf.

    Raises
    ------
    BadArgument
        By `name` and place, if the formula holds what `ALLOWED` does not list.

    Examples
    --------
    >>> from microblock.data.expressions import function_of_x
    >>> function_of_x("where(x < 0, -x, x**2/2)")(np.array([-1.0, 2.0])).tolist()
    [1.0, 2.0]
    """
    require_kind(str, "a formula in x, such as 'x**2/20'", **{name: formula})
    formula = formula.strip()

    def function(x: ArrayLike) -> Array:
        places = np.array(x, float, ndmin=1)
        with np.errstate(all="ignore"):  # the caller looks at what is no number
            return np.reshape(_value(tree, places) + np.zeros_like(places), np.shape(x))

    try:
        tree = _tree(formula)
        function(np.zeros(1))  # which visits each term
    except _Refused as refused:
        part = formula[refused.start : refused.end][:40] or "the end"
        words = f"{ascii(part)} at place {refused.start + 1} cannot stand there; {ALLOWED}"
        raise BadArgument(name, formula, words) from None
    function.__name__ = formula
    return function


def _tree(formula: str) -> ast.expr:
    """Returns the parsed formula, of bounded length and plain characters."""
    # no quotes, brackets, other alphabets, ends of lines, ...
    rest = re.sub(rf"^[A-Za-z0-9_ .,+*/()<>=!-]{{0,{LONGEST}}}", "", formula)
    if rest:
        plain = len(formula) - len(rest)
        raise _Refused(plain, plain + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that run into words
            return ast.parse(formula, mode="eval").body
    except SyntaxError as failure:
        place = (failure.offset or len(formula) + 1) - 1
        raise _Refused(place, place + 1) from None
    except (MemoryError, RecursionError):
        raise _Refused(len(formula), len(formula)) from None


def _value(node: ast.expr, x: Array, depth: int = 0) -> Any:
    """Returns a term at x, array (n,), or a number; a comparison is 1 where it holds, else 0."""
    match node:
        case ast.Name(id="x"):
            return x
        case ast.Name(id="pi" | "e" | "inf" as constant):
            return getattr(np, constant)
        case ast.Constant(value=int() | float() as number) if number <= LARGEST and number is not True:
            return np.float64(number)
        case ast.UnaryOp(op=operator) | ast.BinOp(op=operator) | ast.Compare(ops=[operator]):
            function = OPERATORS.get(type(operator))
            parts = [part for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
        case ast.Call(func=ast.Name(id=called), args=parts, keywords=[]):
            function = FUNCTIONS.get(called)
        case _:
            parts = []
            function = None
    # numpy has the number of arguments of all but `where` and `clip`
    if function is None or depth > DEEPEST or len(parts) != getattr(function, "nin", 3):
        raise _Refused(node.col_offset, node.end_col_offset or node.col_offset + 1)
    return np.multiply(1.0, function(*(_value(part, x, depth + 1) for part in parts)))
