"""The page of the playground: the map as text in an HTML file, and back.

Numbers of two bytes stand for values: pressures linear from 0, psi linear, gaps by their roots. `unpacked`
reads them as the script of the page does (playground.js), so that errors are those of what the page shows.
"""

import base64
import html
import json
import re
from pathlib import Path

import numpy as np

from .playground_map import ALONE, NARROW, PARTS, SAFETY, TIP, WIDTH, Map, Patch
from .playground_states import BOTH, FAR, NODES, Sampled

HERE = Path(__file__).parent
PAPER = "https://doi.org/10.1016/j.ijsolstr.2020.07.001"  # the only address on the page
TOP = 65535  # the largest number of two bytes
PRESSURE, ANGLE, GAP = 2.0, 2.0, 12.0  # the largest pressure, |psi| and root of a gap that can be kept
PLAIN = ("name", "rows_are", "columns_are", "columns")
CURVES = ("rows", "lower", "upper")


def kinds(code):
    """What the two functions of a piece are: (first, second) of "pressure", "angle", "gap"."""
    return ("pressure" if code else "gap"), ("pressure" if code == BOTH else "angle")


def to_numbers(kind, values):
    """Values as numbers from 0 to TOP."""
    share = {
        "pressure": lambda: values / PRESSURE,
        "angle": lambda: values / (2 * ANGLE) + 0.5,
        "gap": lambda: np.sqrt(np.maximum(values, 0.0)) / GAP,
    }[kind]()
    return np.rint(np.clip(share, 0, 1) * TOP).astype("<u2")


def to_values(kind, numbers):
    """What numbers from 0 to TOP stand for."""
    share = numbers / TOP
    return {
        "pressure": lambda: PRESSURE * share,
        "angle": lambda: 2 * ANGLE * (share - 0.5),
        "gap": lambda: (GAP * share) ** 2,
    }[kind]()


def packed(found):
    """A Map as an object for JSON."""
    edges, numbers, patches, alike = [], [], [], []
    for patch in (*found.patches, found.unilateral):
        states = [state for row in patch.states for state in row]
        for state in states:
            edges.append(state.edges)
            numbers += [
                to_numbers(kind, values)
                for code, own in zip(state.closed, state.values)
                for kind, values in zip(kinds(code), own)
            ]
        alike += [state.closed for state in states if state.closed not in alike]
        patches.append(
            {
                **{name: getattr(patch, name) for name in PLAIN},
                **{name: getattr(patch, name).tolist() for name in CURVES},
                "span": list(patch.span),
                "closed": [alike.index(state.closed) for state in states],
                "errors": [] if patch.errors is None else [list(map(_brief, row)) for row in patch.errors],
                "strip": [] if patch.strip is None else list(map(_brief, patch.strip)),
            }
        )
    return {
        "far": FAR,
        "nodes": NODES,
        "tip": TIP,
        "width": WIDTH,
        "parts": PARTS,
        "narrow": NARROW,
        "alone": ALONE,
        "safety": SAFETY,
        "pressure": PRESSURE,
        "angle": ANGLE,
        "gap": GAP,
        "closed": alike,
        "patches": patches,
        "edges": _text(np.concatenate(edges).astype("<f4")),
        "numbers": _text(np.concatenate(numbers)),
    }


def _brief(number):
    return float(f"{number:.2g}")


def _text(array):
    return base64.b64encode(array.tobytes()).decode("ascii")


def unpacked(data):
    """The Map of what `packed` gives."""
    edges, numbers = (
        np.frombuffer(base64.b64decode(data[name]), kind)
        for name, kind in (("edges", "<f4"), ("numbers", "<u2"))
    )
    edges, numbers, patches = edges.astype(float), numbers.reshape(-1, 2, data["nodes"]), []

    def state(code):
        nonlocal edges, numbers
        closed = tuple(data["closed"][code])
        values = [[to_values(*pair) for pair in zip(kinds(one), own)] for one, own in zip(closed, numbers)]
        found = Sampled(edges[: len(closed) - 1], closed, np.array(values))
        edges, numbers = edges[len(closed) - 1 :], numbers[len(closed) :]
        return found

    for one in data["patches"]:
        states = [state(code) for code in one["closed"]]
        rows = [states[i : i + one["columns"]] for i in range(0, len(states), one["columns"])]
        curves = {name: np.array(one[name]) for name in CURVES}
        patch = Patch(**{name: one[name] for name in PLAIN}, **curves, span=tuple(one["span"]), states=rows)
        patch.errors = np.array(one["errors"]).reshape(patch.cells) if one["errors"] else None
        patch.strip = np.array(one["strip"]) if one["strip"] else None
        patches.append(patch)
    return Map(patches[:-1], patches[-1])


def written(table, facts):
    """The page as text, of what `packed` gives.

    facts : {name: number or text} that the page tells of itself, in places of its template called {{name}}
    """
    parts = {suffix: (HERE / f"playground.{suffix}").read_text() for suffix in ("html", "css", "js")}
    data = json.dumps(table, allow_nan=False, separators=(",", ":"))
    told = {name: html.escape(str(fact)) for name, fact in facts.items()}
    filled = {**told, "paper": PAPER, "style": parts["css"], "script": parts["js"], "data": data}
    return re.sub(r"\{\{(\w+)\}\}", lambda place: filled[place[1]], parts["html"])


def read(page):
    """The Map that a page holds."""
    return unpacked(
        json.loads(re.search(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)[1])
    )
