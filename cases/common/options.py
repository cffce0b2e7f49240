"""Parameters of a case, declared once: a frozen dataclass whose fields become the command's options, and say
what is allowed.
"""

import argparse
import re
import shlex
from collections.abc import Callable
from dataclasses import MISSING, dataclass, field, fields
from difflib import get_close_matches
from numbers import Integral

from microblock.errors import BadArgument, require_finite, require_size, shortened, shown

from .catalog import PROGRAM


@dataclass(frozen=True)
class Rule:
    """What is allowed of a parameter, of each of its values where it has several.

    Parameters
    ----------
    above, at_least, below, at_most : ends of the range, without the end itself and with it
    besides : a number that is allowed beyond the range
    known : the names that are allowed, or a function that gives them
    fewest : how many different values there must be at least
    order : "ascending" or "descending", into which values are brought
    not_with : {another parameter: why the two do not go together}
    only_with : {another parameter: the value, or tuple of values, of it that this parameter belongs to}
    """

    above: float | None = None
    at_least: float | None = None
    below: float | None = None
    at_most: float | None = None
    besides: float | None = None
    known: tuple | Callable = ()
    fewest: int = 0
    order: str | None = None
    not_with: dict = field(default_factory=dict)
    only_with: dict = field(default_factory=dict)

    def allows(self, value):
        """Whether a number lies in the range."""
        return value == self.besides or (
            (self.above is None or value > self.above)
            and (self.at_least is None or value >= self.at_least)
            and (self.below is None or value < self.below)
            and (self.at_most is None or value <= self.at_most)
        )

    def words(self, name):
        """The range as an order to the user."""
        low, high = (self.above, self.at_least), (self.below, self.at_most)
        besides = "" if self.besides is None else f", or be {self.besides:g}"
        if self.at_least is not None and self.at_most is not None:
            return f"must lie between {_plain(self.at_least)} and {_plain(self.at_most)}{besides}"
        if high == (None, None):
            if self.above == 0:
                return "must be positive"
            if self.above is not None:
                return f"must be larger than {_plain(self.above)}"
            least = f"must be at least {_plain(self.at_least)}"
            return "must not be negative" if self.at_least == 0 else least
        left = ""
        if low != (None, None):
            left = f"{_plain(self.above)} < " if self.at_least is None else f"{_plain(self.at_least)} <= "
        right = f" < {_plain(self.below)}" if self.at_most is None else f" <= {_plain(self.at_most)}"
        return f"must satisfy {left}{name}{right}{besides}"


RULES = {entry.name for entry in fields(Rule)}


def _plain(number):
    return str(number) if isinstance(number, int) else f"{number:g}"


def option(default, text, kind=float, **more):
    """A dataclass field with help text and type; `more` are entries of `Rule`, and argparse's `choices`,
    `nargs` or `action`.

    `positional`: on the command line it stands without its name.
    """
    rule = Rule(**{name: value for name, value in more.items() if name in RULES})
    settings = {name: value for name, value in more.items() if name not in RULES}
    return field(default=default, metadata={"help": text, "type": kind, "rule": rule, **settings})


def poisson():
    """Poisson's ratio, within what (13) admits."""
    return option(0.3, "Poisson's ratio, -1 < nu < 1/2", above=-1, below=0.5)


def coupling():
    """The coupling number, within what (13) admits."""
    return option(1.0, "coupling number 2 eta/(1 + eta), 0 < beta < 2", above=0, below=2)


def rotation():
    """psi0 of blocks, as far as rotations are small."""
    return option(
        0.0,
        "initial rotation of the blocks in degrees, counterclockwise",
        at_least=-45,
        at_most=45,
        only_with={"contact": "microblock"},
    )


def names(text, known):
    """Words out of those that are known; none if nothing is said."""
    return option((), text, str, nargs="+", metavar="NAME", known=known)


class Checked:
    """Parameters that are checked, and brought into one form, when they are made."""

    def __post_init__(self):
        check(self)
        self.relate()

    def relate(self):
        """Raise BadArgument for fields that do not go together, beyond what they declare."""


def check(parameters):
    """Raise BadArgument for the first field whose value its declaration does not allow; values become tuples
    of its type.
    """
    for entry in fields(parameters):
        value, kind = getattr(parameters, entry.name), entry.metadata["type"]
        nothing = value is None and entry.default in (None, MISSING)
        if nothing or kind is bool or entry.metadata.get("action"):
            continue
        several = "nargs" in entry.metadata
        values = tuple(value) if isinstance(value, (tuple, list)) else (value,)
        for one in values:
            _check_value(entry, one)
        if several:
            object.__setattr__(parameters, entry.name, _ordered(entry, tuple(map(kind, values))))
        _check_company(parameters, entry)


def _check_value(entry, value):
    name, kind, rule = entry.name, entry.metadata["type"], entry.metadata["rule"]
    if kind is str:
        choices = entry.metadata.get("choices")
        if choices and value not in choices:
            raise BadArgument(name, value, f"must be one of {', '.join(choices)}")
        known = rule.known() if callable(rule.known) else rule.known
        if known and value not in known:
            raise BadArgument(
                name, value, f"is not known{did_you_mean(value, known)}; must be one of {', '.join(known)}"
            )
        return
    if kind is int and (not isinstance(value, Integral) or isinstance(value, bool)):
        raise BadArgument(name, value, "must be a whole number")
    require_finite(**{name: value})
    if kind is float and value:
        require_size(**{name: value})
    if not rule.allows(value):
        raise BadArgument(name, value, rule.words(name))


def _ordered(entry, values):
    rule = entry.metadata["rule"]
    fewest = rule.fewest or (1 if entry.default else 0)
    if len(values) < fewest or (rule.fewest and len(set(values)) < len(values)):
        raise BadArgument(
            entry.name,
            values,
            f"must be {fewest} different values or more" if rule.fewest else "must be at least one",
        )
    return tuple(sorted(values, reverse=rule.order == "descending")) if rule.order else values


def _check_company(parameters, entry):
    """Whether a field that was given goes with the others."""
    value, rule = getattr(parameters, entry.name), entry.metadata["rule"]
    if value == entry.default:
        return
    given = {
        other.name: getattr(parameters, other.name)
        for other in fields(parameters)
        if getattr(parameters, other.name) != other.default
    }
    for other, why in rule.not_with.items():
        if other in given:
            raise BadArgument(entry.name, value, f"does not go together with {flag(other)}: {why}")
    for other, wanted in rule.only_with.items():
        wanted = wanted if isinstance(wanted, tuple) else (wanted,)
        if getattr(parameters, other) not in wanted:
            raise BadArgument(entry.name, value, f"belongs to {flag(other)} {' or '.join(wanted)}")


def add_options(parser, parameters):
    """Give an argparse parser one --option for each field of the dataclass `parameters`."""
    for entry in fields(parameters):
        settings = {name: value for name, value in entry.metadata.items() if name != "rule"}
        settings["help"] = (settings["help"] + _default(entry)).replace("%", "%%")
        if entry.type in (bool, "bool"):
            settings = {"help": entry.metadata["help"], "action": "store_true"}
        if settings.pop("positional", False):
            parser.add_argument(entry.name, **settings)
            continue
        parser.add_argument(flag(entry.name), dest=entry.name, default=entry.default, **settings)


def _default(entry):
    """What the help says of a parameter's default: nothing where it has none or must be given."""
    if entry.default in (None, (), MISSING) or entry.metadata.get("positional"):
        return ""
    words = entry.default if isinstance(entry.default, tuple) else (entry.default,)
    return f" (default {' '.join(map(str, words))})"


def flag(name):
    """The command-line option of a parameter."""
    return "--" + name.replace("_", "-")


def command(case, parameters):
    """The command line that repeats a run with these parameters."""
    words = [f"{PROGRAM} {case}"]
    for entry in fields(parameters):
        value = getattr(parameters, entry.name)
        if entry.metadata.get("positional"):
            words.append(str(value))
            continue
        if entry.metadata.get("action") == "append":
            words += [f"{flag(entry.name)} {' '.join(one)}" for one in value or ()]
            continue
        if isinstance(value, bool):
            words += [flag(entry.name)] * value
            continue
        several = value if isinstance(value, (tuple, list)) else () if value is None else (value,)
        if several:
            between = "=" if isinstance(value, str) and value.startswith("-") else " "  # as argparse wants it
            words.append(flag(entry.name) + between + " ".join(shlex.quote(str(one)) for one in several))
    return " ".join(words)


class OneLineParser(argparse.ArgumentParser):
    """A parser whose errors are one line on standard error, and exit status 2; it knows what a misspelt word
    may mean.
    """

    def error(self, message):
        wrong = re.match(r"argument [^:]*: invalid choice: '?([^' ]*)'? \(choose from (.*)\)", message)
        if wrong:
            message += did_you_mean(wrong[1], re.findall(r"[^', ]+", wrong[2]))
        if message.endswith("expected one argument"):
            message += "; a value that begins with - is written --NAME=VALUE"
        if "are required" in message:
            message += f"; {self.prog} --help explains them"
        self.exit(2, f"{self.prog}: {message}\n")


def did_you_mean(word, known):
    """The question after an unknown word, empty if nothing that is known is near to it."""
    near = get_close_matches(word, list(known), n=1)
    return f": did you mean {near[0]}?" if near else ""


def complaint(failure: BadArgument, parameters):
    """A BadArgument in the words of the command line."""
    known = {entry.name for entry in fields(parameters)} | {"json", "out"}
    name = flag(failure.name) if failure.name in known else failure.name
    value = shortened(failure.value) if isinstance(failure.value, str) else shown(failure.value)
    return f"{name} {value}: {failure.allowed}"
