"""Sliders as their user sees them: states, pictures, what is offered, and what is refused."""

import numpy as np
import pytest

import microblock as mb
from microblock.view import plots, state_figure

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW, CYLINDER = mb.Microblock(0.001), mb.Cylinder(10.0)
PLANE = mb.HalfPlane(SOLID)


class Sliders:
    """The widgets of a box by their labels, and what it shows."""

    def __init__(self, problem, load, rtol=None):
        pytest.importorskip("ipywidgets", reason="sliders need the extra `notebook`")
        left, right = mb.explore(problem, load, rtol).children
        *controls, self.failed, self.table = left.children
        self.controls = {widget.description: widget for widget in controls}
        (self.picture, self.below) = right.children


def curves(drawing):
    """The numbers of all lines of a figure, as bytes."""
    return b"".join(line.get_xydata().tobytes() for axis in drawing.axes for line in axis.lines)


@pytest.fixture
def as_curves(monkeypatch):
    """Pictures are the numbers of their lines: layout and image take a second each."""
    monkeypatch.setattr(plots.Drawing, "png", curves)


def on_mesh(block):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom")
    return mb.Contact(body, mb.Cylinder(2.0), LAW)


KINDS = {  # problem of a mesh, load, rtol, sliders
    "panels": (lambda block: mb.Contact(PLANE, CYLINDER, LAW), 1.0, None, "load R ell psi0 law below"),
    "no radius": (lambda block: mb.Contact(PLANE, mb.Wedge(0.02), LAW), 1.0, 1e-2, "load ell psi0 law below"),
    "a function": (
        lambda block: mb.Contact(PLANE, CYLINDER, mb.Microblock(lambda x: 0.01 * x)),
        1.0,
        None,
        "load R ell law below",
    ),
    "no blocks": (
        lambda block: mb.Contact(mb.HalfPlane(mb.Elastic(100, 0.3)), CYLINDER, mb.Unilateral()),
        1e-9,
        None,
        "load R law below",
    ),
    "body": (on_mesh, 0.05, None, "load R ell psi0 law below"),
    "half-space": (
        lambda block: mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(10.0), LAW, mb.Cells(nodes=32)),
        0.1,
        None,
        "load R ell psi0 law below",
    ),
}


@pytest.mark.parametrize("kind", KINDS)
def test_each_slider_shows_the_state_of_the_problem_asked_afresh(kind, block, monkeypatch):
    if kind != "half-space":  # of the others the curves: layout and image take a second each
        monkeypatch.setattr(plots.Drawing, "png", curves)
    make, load, rtol, names = KINDS[kind]
    problem, sliders = make(block), Sliders(make(block), load, rtol)
    assert [*sliders.controls] == names.split()
    shares = {"load": 1.5, "R": 0.8, "ell": 1.4}
    values = {name: share * sliders.controls[name].value for name, share in shares.items() if name in names}
    for name, value in values.items():
        picture = sliders.picture.value
        sliders.controls[name].value = value
        assert sliders.picture.value != picture and not sliders.failed.value
    shape = mb.Sphere if kind == "half-space" else mb.Cylinder
    changes = {"obstacle": shape(values["R"])} if "R" in values else {}
    if "ell" in values:
        changes["solid"] = mb.Cosserat(E=problem.solid.E, nu=0.3, beta=1, ell=values["ell"])
    state = problem.with_(**changes).solve(load=values["load"], rtol=rtol)
    contact = sliders.table.value.partition("contact ")[2].partition(", error")[0]
    assert contact == repr(state).partition("contact ")[2].partition(", error")[0]  # in four digits


def test_the_law_and_the_field_below_are_chosen_from_lists():
    sliders = Sliders(mb.Contact(PLANE, CYLINDER, LAW), 1.0)
    assert not sliders.below.value
    sliders.controls["below"].value = "s22"
    below = bytes(sliders.below.value)
    assert below.startswith(b"\x89PNG")
    sliders.controls["psi0"].value = 0.01
    assert bytes(sliders.below.value) != below
    turned = mb.Contact(PLANE, CYLINDER, mb.Microblock(0.01)).solve(load=1.0)
    assert repr(turned).partition(", error")[0][1:] in sliders.table.value
    sliders.controls["law"].value = mb.Unilateral()
    plain = mb.Contact(PLANE, CYLINDER, mb.Unilateral()).solve(load=1.0)
    assert repr(plain).partition(", error")[0][1:] in sliders.table.value


def heights(drawing):
    """The numbers of all lines of a figure."""
    return np.concatenate([line.get_ydata() for axis in drawing.axes for line in axis.lines])


def test_a_figure_drawn_anew_is_that_of_its_state():
    """Limits, labels and legends are not those of the state before, of a law with two corners."""
    contact = mb.Contact(PLANE, CYLINDER, LAW)
    drawing = state_figure.draw(contact.solve(load=1.0, rtol=1e-2))
    state = contact.with_(law=mb.Microclamped()).solve(load=0.5, rtol=1e-2)
    assert state_figure.draw(state, drawing) is drawing
    fresh = state_figure.draw(state)
    np.testing.assert_allclose(*map(heights, (drawing, fresh)), rtol=1e-9, atol=1e-12)  # of psi = 0
    for axis, fresh_axis in zip(drawing.axes, fresh.axes, strict=True):
        assert axis.get_xlim() == pytest.approx(fresh_axis.get_xlim(), rel=1e-9)
        assert axis.get_ylim() == pytest.approx(fresh_axis.get_ylim(), rel=1e-9)
        assert [*map(type, axis.get_children())] == [*map(type, fresh_axis.get_children())]
        assert axis.get_ylabel() == fresh_axis.get_ylabel()


def lined(drawing, highest, title="a state", legend=False):
    """A drawing with a line up to a height, whose numbers take room, and a title."""
    drawing.empty()
    axis = drawing.axes[0]
    axis.plot([0, highest], label="p")
    drawing.suptitle(title)
    if legend:
        axis.legend()
    return drawing


@pytest.mark.parametrize(
    "then, has_room",
    [
        ({"highest": 0.002}, True),
        ({"highest": 5}, True),  # its numbers are shorter
        ({"highest": 0.0002}, False),
        ({"highest": 0.001, "title": "two\nlines"}, False),
        ({"highest": 0.001, "legend": True}, False),
    ],
)
def test_a_layout_stays_where_there_is_room(then, has_room):
    drawing = lined(plots.figure(height=1.0, width=1.5)[0], 0.001)
    assert not drawing.has_room()
    drawing.lay_out()
    assert lined(drawing, **then).has_room() == has_room


def test_an_rtol_holds_for_each_state(as_curves):
    """On a mesh, which is refined for it."""
    sliders = Sliders(mb.Contact(mb.Block(SOLID, 18.0), CYLINDER, LAW), 1.0, 1e-2)
    for load in (1.0, 1.2):
        sliders.controls["load"].value = load
        assert float(sliders.table.value.partition("estimate ")[2].partition("&")[0]) <= 1e-2


def test_a_state_that_is_not_found_is_told_and_the_picture_stays(as_curves):
    small = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=1e-8))
    sliders = Sliders(mb.Contact(small, CYLINDER, mb.Unilateral(), mb.Panels()), 1.0)
    before = sliders.picture.value, sliders.table.value
    sliders.controls["law"].value = mb.Microblock()  # whose blocks are too many
    assert "take a larger ell" in sliders.failed.value
    assert (sliders.picture.value, sliders.table.value) == before
    sliders.controls["law"].value = mb.Unilateral()
    assert not sliders.failed.value
    sliders.controls["load"].value = 1.5


def test_cells_that_answer_for_panels_have_their_own_fields_below(as_curves):
    """Blocks are too many for panels: the picture of the state before must not stay."""
    # at an ell of 1e-8 rounding decides whether coarse cells converge: 2 s or 12 s
    small = mb.HalfPlane(mb.Cosserat(E=100, nu=0.3, beta=1, ell=3e-8))
    sliders = Sliders(mb.Contact(small, CYLINDER, mb.Unilateral()), 1.0, 0.1)
    sliders.controls["below"].value = "psi"
    below = bytes(sliders.below.value)
    assert below and not sliders.failed.value
    sliders.controls["law"].value = mb.Microblock()
    assert bytes(sliders.below.value) not in (b"", below) and not sliders.failed.value
