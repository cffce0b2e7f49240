"""Any case over any of its parameters: a row and a point of a chart each, resumed where it stopped.

    python -m cases sweep hertz --over alpha 0.1 0.2 0.5 1 --over contact microblock unilateral --out out/sweep
    python -m cases sweep size_effect --over beta 0.2 0.5 1 1.5 --given nu=0.2 --out out/beta

Geometry, equations, model, reference, units: those of the case.
Look at    the numbers that the case returns (of its last state, where it has several) over the first parameter, a line for
           each combination of the others; points that fail are left out, and their row says why.
Resuming   DIR/sweep_CASE.jsonl keeps each point as it comes: the same command goes on where an interruption stopped it, and
           other values of --over use what is there, as long as the code of the case and the versions are the same.
"""

import time
from dataclasses import dataclass, fields
from functools import partial
from importlib import import_module
from numbers import Real

from cases.options import command, option
from cases.records import keep, returned
from microblock import plots
from microblock.errors import BadArgument, NotConverged, require_finite
from microblock.study import column, grouped
from microblock.sweeps import sweep

PANELS = 6                   # of the chart, if nothing is chosen
COSTS = ("unknowns", "iterations", "kkt", "seconds", "events")      # shown only where chosen
LOG = 20                     # ratio of the largest to the smallest value from which the axis is logarithmic


@dataclass(frozen=True)
class Parameters:
    of: str = option("hertz", "the case to vary: one that returns numbers, such as strip, hertz, size_effect", str,
                     positional=True, metavar="CASE")
    over: tuple = option(None, "a parameter of the case and its values; once for each parameter", str, nargs="+", action="append",
                         metavar=("NAME", "VALUE"))
    given: tuple = option((), "other parameters of the case", str, nargs="+", metavar="NAME=VALUE")
    show: tuple = option((), f"numbers to draw (without it the first {PANELS} that vary)", str, nargs="+", metavar="NUMBER")
    workers: int | None = option(None, "processes (one a core if not given)", int)
    retry: bool = option(False, "compute failed points again", bool)

    def __post_init__(self):
        if not self.over or any(len(words) < 2 for words in self.over):
            raise BadArgument("over", self.over or "(nothing)", "must name a parameter of the case and at least one value")
        names = [words[0] for words in self.over]
        if len(set(names)) < len(names):
            raise BadArgument("over", names, "must name each parameter once")
        if self.workers is not None and self.workers < 1:
            raise BadArgument("workers", self.workers, "must be at least 1")
        self.axes, self.fixed      # bad names and values are told here

    @property
    def case(self):
        """The module of the case."""
        try:
            module = import_module(f"cases.{self.of}") if self.of.isidentifier() else None
        except ModuleNotFoundError:
            module = None
        if not (hasattr(module, "Parameters") and hasattr(module, "result")) or self.of == "sweep":
            raise BadArgument("case", self.of, "must be a case that returns numbers, such as strip, hertz, size_effect")
        return module

    @property
    def axes(self):
        """{parameter: values} of --over."""
        return {self._known("over", name): [self._value("over", name, word) for word in words] for name, *words in self.over}

    @property
    def fixed(self):
        """{parameter: value} of --given."""
        found = {}
        for name, equals, word in (words.partition("=") for words in self.given):
            if not equals or self._known("given", name) in self.axes:
                raise BadArgument("given", name + equals + word, "must be NAME=VALUE, of a parameter that is not in --over")
            found[self._known("given", name)] = self._value("given", name, word)
        return found

    def _known(self, told, name):
        """The case's own name of a parameter."""
        known = [entry.name for entry in fields(self.case.Parameters)]
        if name.replace("-", "_") not in known:
            raise BadArgument(told, name, f"must be one of {', '.join(known)}")
        return name.replace("-", "_")

    def _value(self, told, name, word):
        """A word as a value of the case's parameter."""
        kind = _types(self.case.Parameters)[self._known(told, name)]
        try:
            value = {"True": True, "False": False}[word] if kind is bool else kind(word)
            if isinstance(value, float):
                require_finite(**{name: value})
            return value
        except BadArgument as failure:
            raise BadArgument(told, f"{name} {word}", failure.allowed) from failure
        except (KeyError, ValueError) as failure:
            raise BadArgument(told, f"{name} {word}", f"is no {kind.__name__}") from failure


def _types(parameters):
    return {entry.name: entry.metadata["type"] for entry in fields(parameters)}


def observed(parameters, result, **point):
    """The numbers and texts that a case returns at a point, those of its last state with it."""
    many = {entry.name for entry in fields(parameters) if "nargs" in entry.metadata}
    answer = result(parameters(**{name: (value,) if name in many else value for name, value in point.items()}))
    found = {**answer, **(answer["states"][-1] if answer.get("states") else {})}
    return {name: value for name, value in found.items()
            if name not in point and (value is None or isinstance(value, (Real, str)))}


def result(parameters, records=None, quiet=True):
    """The case's object: a row a point."""
    start, case = time.perf_counter(), parameters.case
    rows = sweep(partial(observed, case.Parameters, case.result, **parameters.fixed), parameters.axes, workers=parameters.workers,
                 records=records, retry=parameters.retry, quiet=quiet)
    return returned(parameters, start, rows=rows)


def run(parameters, out=None, quiet=False):
    """Run, print a table, write and draw the records into the folder `out`."""
    answer = result(parameters, out and out/f"sweep_{parameters.of}.jsonl", quiet)
    if all(row["error"] for row in answer["rows"]):
        raise NotConverged(f"no point has a result; the first: {answer['rows'][0]['error']}")
    names = drawn(parameters, answer["rows"])
    if not quiet:
        show(parameters, names, answer["rows"])
    if out:
        records = [{**row, **parameters.fixed, "command": command("sweep", parameters)} for row in answer["rows"]]
        keep(out, f"sweep_{parameters.of}", records, partial(figure, list(parameters.axes), names))
    return answer


def drawn(parameters, rows):
    """Names of the numbers to draw."""
    done = [row for row in rows if not row["error"]]
    numbers = [name for name in done[0] if name not in parameters.axes and any(isinstance(row[name], Real) for row in done)]
    for name in parameters.show:
        if name not in numbers:
            raise BadArgument("show", name, f"must be one of {', '.join(numbers)}")
    varied = [name for name in numbers if name not in COSTS and len({row[name] for row in done}) > 1]
    return list(parameters.show) or varied[:PANELS] or numbers[:1]


def show(parameters, names, rows):
    """A line a point."""
    shown = (*parameters.axes, *names)
    print("  ".join(f"{name:>17}" for name in shown))
    for row in rows:
        print("  ".join(f"{row[name]:17.9g}" if isinstance(row[name], Real) else f"{row[name] or '-':>17}" for name in shown)
              + (f"  {row['error']}" if row["error"] else ""))


def figure(axes, names, rows):
    """Each number over the first parameter, a line for each combination of the others."""
    columns = min(len(names), 3)
    width = min(plots.COLUMN, 2*plots.COLUMN/columns)
    drawing, panels = plots.figure(-(-len(names)//columns), columns, height=2.2, width=width, squeeze=False)
    first, *others = axes
    done = [{**row, "line": ", ".join(f"{name} {row[name]}" for name in others)} for row in rows if not row["error"]]
    for panel, name in zip(panels.flat, names):
        for number, (label, line) in enumerate(grouped(done, "line").items()):
            panel.plot(column(line, first), [float("nan") if row[name] is None else row[name] for row in line],
                       plots.MARKERS[number % len(plots.MARKERS)] + "-", label=label)
        panel.set(xlabel=first, ylabel=name)
        x = column(done, first)
        if all(isinstance(value, Real) and value > 0 for value in x) and max(x) > LOG*min(x):
            panel.set_xscale("log")
    for panel in panels.flat[len(names):]:
        panel.set_visible(False)
    if others:
        drawing.legend(*panels.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawing
