"""Formulas in x as functions of an array: parsed by Python, computed term by term, never executed. Length
and depth are bounded, and powers those of doubles.
"""

import ast
import re
import warnings
from collections.abc import Callable

import numpy as np

from ..errors import LARGEST, BadArgument, require_kind
from ..model.types import Array

MOST = 100  # terms within terms
FUNCTIONS = {
    name: getattr(np, name)
    for name in (
        *("abs", "sqrt", "cbrt", "exp", "log", "sin", "cos", "tan", "arcsin", "arccos", "arctan", "sinh"),
        *("cosh", "tanh", "sign", "floor", "ceil", "minimum", "maximum", "hypot", "arctan2", "power"),
        *("where", "clip"),
    )
}
OPERATORS = {
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
    f"allowed are x, numbers, pi, e, inf, + - * / **, parentheses, {', '.join(FUNCTIONS)}, and "
    "a comparison as first argument of where"
)


class _Refused(Exception):
    """The refused term, or number of the character, and why."""


def function_of_x(formula: str, name: str = "formula") -> Callable[[Array], Array]:
    """Returns the function of an array x of a formula such as ``"x**2/20"``; without a value NaN or inf.

    Raises
    ------
    BadArgument
        By `name` and place, if the formula holds what `ALLOWED` does not list, a number above 1e50, more
        than 500 characters or 100 nested terms.

    Examples
    --------
    >>> from microblock.data.expressions import function_of_x
    >>> function_of_x("where(x < 0, -x, x**2/2)")(np.array([-1.0, 2.0])).tolist()
    [1.0, 2.0]
    """
    require_kind(str, "a formula in x, such as 'x**2/20'", **{name: formula})
    formula = formula.strip()

    def function(x):
        places = np.array(x, float, ndmin=1)
        with np.errstate(all="ignore"):  # the caller looks at what is no number
            return np.reshape(_value(tree, places) + np.zeros_like(places), np.shape(x))

    try:
        tree = _tree(formula)
        function(np.zeros(1))  # which visits each term
    except _Refused as refused:
        where, words = refused.args
        start = getattr(where, "col_offset", where)
        part = formula[start : getattr(where, "end_col_offset", start + 1)][:40] or "the end"
        allowed = f"{ascii(part)} at place {start + 1} {words}; {ALLOWED}"
        raise BadArgument(name, formula, allowed) from None
    function.__name__ = formula
    return function


def _tree(formula):
    """Returns the parsed formula, of bounded length and plain characters."""
    # no quotes, brackets, other alphabets, ends of lines, ...
    strange = re.sub(r"[A-Za-z0-9_ .,+*/()<>=!-]{0,500}", "", formula, count=1)
    start = len(formula) - len(strange)
    if strange:
        power = ": write ** for powers" * (strange[0] == "^")
        raise _Refused(start, "is beyond 500 characters" if start == 500 else f"is not allowed{power}")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of numbers that run into words
            return ast.parse(formula, mode="eval").body
    except (SyntaxError, MemoryError, RecursionError) as failure:
        place = getattr(failure, "offset", 0) or len(formula) + 1
        raise _Refused(place - 1, f"cannot stand there ({getattr(failure, 'msg', 'too deep')})") from None


def _value(node, x, depth=0, compared=False):
    """Returns a term at x, array (n,), or a number; `compared`: it must be a comparison."""
    if depth > MOST:
        raise _Refused(node, "has too many terms around it")
    if isinstance(node, ast.Compare) != compared:
        raise _Refused(node, "must be a comparison" if compared else "is a comparison outside of where")
    names = {"x": x, "pi": np.pi, "e": np.e, "inf": np.inf}
    if getattr(node, "id", None) in names:
        return names[node.id]
    if type(getattr(node, "value", None)) in (int, float):
        if node.value > LARGEST:
            raise _Refused(node, f"is above {LARGEST:g}")
        return np.float64(node.value)
    function, parts = _function(node)
    values = [_value(part, x, depth + 1, function is np.where and part is parts[0]) for part in parts]
    return function(*values)


def _function(node):
    """Returns the function of a term, and its arguments."""
    operators = getattr(node, "ops", [getattr(node, "op", None)])
    parts = [part for part in ast.iter_child_nodes(node) if isinstance(part, ast.expr)]
    if len(operators) == 1 and type(operators[0]) in OPERATORS:
        return OPERATORS[type(operators[0])], parts
    if not isinstance(node, ast.Call):
        raise _Refused(node, "is not allowed")
    function = FUNCTIONS.get(getattr(node.func, "id", ""))
    if function is None:
        raise _Refused(node.func, "is no function of the list")
    number = getattr(function, "nin", 3)  # numpy has it of all but `where` and `clip`
    if len(node.args) != number or node.keywords:
        raise _Refused(node, f"must have {number} unnamed argument{'s'[number == 1 :]}")
    return function, node.args
