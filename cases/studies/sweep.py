"""Any case over any of its parameters: a row and a point of a chart each, resumed where it stopped.

    python -m cases sweep hertz --over alpha 0.1 0.2 1 --over contact microblock unilateral --out out/sweep
    python -m cases sweep size_effect --over beta 0.2 0.5 1 1.5 --given nu=0.2 --out out/beta

Geometry, equations, model, reference, units: those of the case.
Look at    the numbers that the case returns (of its last state, where it has several) over the first
           parameter, a line for each combination of the others; points that fail are left out, and their row
           says why.
Resuming   DIR/sweep_CASE.jsonl keeps each point as it comes: the same command goes on where an interruption
           stopped it, and other values of --over use what is there, as long as the code of the case and the
           versions are the same.
"""

import time
from dataclasses import dataclass, fields
from functools import partial
from numbers import Real

import microblock as mb
from microblock.data.records import column, grouped
from microblock.errors import require_finite

from ..common.catalog import case, headlines
from ..common.options import Checked, command, did_you_mean, option
from ..common.records import keep, returned

PANELS = 6  # of the chart, if nothing is chosen
COSTS = ("unknowns", "iterations", "kkt", "seconds", "events")  # shown only where chosen
LOG = 20  # ratio of the largest to the smallest value from which the axis is logarithmic


@dataclass(frozen=True)
class Parameters(Checked):
    of: str = option(
        "hertz",
        "the case to vary: one that returns numbers, such as strip, hertz, size_effect",
        str,
        positional=True,
        metavar="CASE",
    )
    over: tuple = option(
        None,
        "a parameter of the case and its values; once for each parameter",
        str,
        nargs="+",
        action="append",
        metavar=("NAME", "VALUE"),
    )
    given: tuple = option((), "other parameters of the case", str, nargs="+", metavar="NAME=VALUE")
    show: tuple = option(
        (), f"numbers to draw (without it the first {PANELS} that vary)", str, nargs="+", metavar="NUMBER"
    )
    workers: int | None = option(None, "processes (one a core if not given)", int, at_least=1)
    retry: bool = option(False, "compute failed points again", bool)

    def relate(self):
        short = next((" ".join(words) for words in self.over or () if len(words) < 2), None)
        if not self.over or short is not None:
            raise mb.BadArgument(
                "over", short or "(nothing)", "must name a parameter of the case and at least one value"
            )
        varied = [words[0] for words in self.over]
        if len(set(varied)) < len(varied):
            raise mb.BadArgument("over", varied, "must name each parameter once")
        self.axes, self.fixed  # bad names and values raise an error here

    @property
    def case(self):
        """The module of the case."""
        module = case(self.of)
        if not (hasattr(module, "Parameters") and hasattr(module, "result")) or self.of == "sweep":
            raise mb.BadArgument(
                "case",
                self.of,
                "must be a case that returns numbers, such as strip, hertz, size_effect"
                + did_you_mean(self.of.lower(), headlines()),
            )
        return module

    @property
    def axes(self):
        """{parameter: values} of --over."""
        return {
            self._known("over", name): [self._value("over", name, word) for word in words]
            for name, *words in self.over
        }

    @property
    def fixed(self):
        """{parameter: value} of --given."""
        found = {}
        for name, equals, word in (words.partition("=") for words in self.given):
            if not equals or self._known("given", name) in self.axes:
                raise mb.BadArgument(
                    "given", name + equals + word, "must be NAME=VALUE, of a parameter that is not in --over"
                )
            found[self._known("given", name)] = self._value("given", name, word)
        return found

    def _known(self, option, name):
        """The case's own name of a parameter."""
        known = [entry.name for entry in fields(self.case.Parameters)]
        if name.replace("-", "_") not in known:
            raise mb.BadArgument(option, name, f"must be one of {', '.join(known)}")
        return name.replace("-", "_")

    def _value(self, option, name, word):
        """A word as a value of the case's parameter."""
        kind = _types(self.case.Parameters)[self._known(option, name)]
        try:
            value = {"True": True, "False": False}[word] if kind is bool else kind(word)
            if isinstance(value, float):
                require_finite(**{name: value})
            return value
        except mb.BadArgument as failure:
            raise mb.BadArgument(option, f"{name} {word}", failure.allowed) from failure
        except (KeyError, ValueError) as failure:
            raise mb.BadArgument(option, f"{name} {word}", f"is no {kind.__name__}") from failure


def _types(parameters):
    return {entry.name: entry.metadata["type"] for entry in fields(parameters)}


def observed(parameters, result, **point):
    """The numbers and texts that a case returns at a point, those of its last state with it."""
    many = {entry.name for entry in fields(parameters) if "nargs" in entry.metadata}
    answer = result(
        parameters(**{name: (value,) if name in many else value for name, value in point.items()})
    )
    found = {**answer, **(answer["states"][-1] if answer.get("states") else {})}
    return {
        name: value
        for name, value in found.items()
        if name not in point and (value is None or isinstance(value, (Real, str)))
    }


def result(parameters, records=None, quiet=True):
    """The case's object: a row a point."""
    start, case = time.perf_counter(), parameters.case
    function = partial(observed, case.Parameters, case.result, **parameters.fixed)
    rows = mb.sweep(
        function,
        parameters.axes,
        workers=parameters.workers,
        records=records,
        retry=parameters.retry,
        quiet=quiet,
    )
    return returned(parameters, start, rows=rows)


def run(parameters, out=None, quiet=False):
    """Run, print a table, write and draw the records into the folder `out`."""
    answer = result(parameters, out and out / f"sweep_{parameters.of}.jsonl", quiet)
    if all(row["error"] for row in answer["rows"]):
        raise mb.NotConverged(f"no point has a result; the first: {answer['rows'][0]['error']}")
    names = drawn(parameters, answer["rows"])
    if not quiet:
        show(parameters, names, answer["rows"])
    if out:
        records = [
            {**row, **parameters.fixed, "command": command("sweep", parameters)} for row in answer["rows"]
        ]
        keep(out, f"sweep_{parameters.of}", records, partial(figure, list(parameters.axes), names))
    return answer


def drawn(parameters, rows):
    """Names of the numbers to draw."""
    done = [row for row in rows if not row["error"]]
    numbers = [
        name
        for name in done[0]
        if name not in parameters.axes and any(isinstance(row[name], Real) for row in done)
    ]
    for name in parameters.show:
        if name not in numbers:
            raise mb.BadArgument("show", name, f"must be one of {', '.join(numbers)}")
    varied = [name for name in numbers if name not in COSTS and len({row[name] for row in done}) > 1]
    return list(parameters.show) or varied[:PANELS] or numbers[:1]


def show(parameters, names, rows):
    """A line a point."""
    shown = (*parameters.axes, *names)
    print("  ".join(f"{name:>17}" for name in shown))
    for row in rows:
        print(
            "  ".join(
                f"{row[name]:17.9g}" if isinstance(row[name], Real) else f"{row[name] or '-':>17}"
                for name in shown
            )
            + (f"  {row['error']}" if row["error"] else "")
        )


def figure(axes, names, rows):
    """Each number over the first parameter, a line for each combination of the others."""
    from microblock.view import plots

    columns = min(len(names), 3)
    width = min(columns, 2) * plots.COLUMN
    drawing, panels = plots.figure(-(-len(names) // columns), columns, height=2.2, width=width, squeeze=False)
    first, *others = axes
    done = [
        {**row, "line": ", ".join(f"{name} {row[name]}" for name in others)}
        for row in rows
        if not row["error"]
    ]
    for panel, name in zip(panels.flat, names):
        for number, (label, line) in enumerate(grouped(done, "line").items()):
            panel.plot(
                column(line, first),
                [float("nan") if row[name] is None else row[name] for row in line],
                plots.MARKERS[number % len(plots.MARKERS)] + "-",
                label=label,
            )
        panel.set(xlabel=first, ylabel=name)
        x = column(done, first)
        if all(isinstance(value, Real) and value > 0 for value in x) and max(x) > LOG * min(x):
            panel.set_xscale("log")
    for panel in panels.flat[len(names) :]:
        panel.set_visible(False)
    if others:
        drawing.legend(*panels.flat[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
    return drawing
