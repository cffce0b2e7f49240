"""Pictures of states: corners that touch, fields below, captions, axes that are cut, letters."""

import io

import numpy as np
import pytest
from PIL import Image

import microblock as mb
from microblock.model.summary import Row, Summary, html, intervals, number
from microblock.view import blocks

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW, LINE = mb.Microblock(), mb.Unilateral()


def solved(obstacle=mb.Cylinder(R=10.0), law=LAW, method=None, body=mb.HalfPlane(SOLID), load=1.0, rtol=None):
    return mb.Contact(body, obstacle, law, method).solve(load=load, rtol=rtol)


def on_mesh(block, law=LAW):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom")
    return solved(mb.Cylinder(2.0), law, body=body, load=0.05)


def ink(drawing):
    """Share of a picture that is not white."""
    png = Image.open(io.BytesIO(drawing._repr_png_())).convert("RGB")
    return (np.asarray(png).astype(int).min(axis=2) < 200).mean()


def panel(drawing, name):
    """The axes of a figure of a state that are called so."""
    names = "pressure", "micromoment", "gap", "turn", "zones", "blocks"
    return drawing.axes[names.index(name)]


def told(drawing):
    return " ".join(drawing.get_suptitle().split())


# states


def test_a_corner_touches_in_the_picture_where_its_gap_is_closed():
    """A alone, B alone, both and none are four fills; a shifted contact has shifted blocks."""
    state = solved(law=mb.Microblock(0.002), load=2.0, rtol=1e-10)
    zones, surface = state.zones["contact"], state.surface(blocks.window(SOLID.ell, state.zones["contact"]))
    shown = blocks.blocks(surface, zones)
    squares = state.plot_blocks().axes[0].collections[0]
    fills = [tuple(colour) for colour in squares.get_facecolor()]
    pairs = [tuple(map(bool, closed)) for closed in shown.closed]
    assert len({*zip(pairs, fills, strict=True)}) == len({*pairs}) == len({*fills}) == 4
    for corner in (0, 1):
        tips, centres = shown.squares[:, corner], shown.squares[:, :2].mean(axis=1)
        over = shown.magnification * (tips[:, 0] ** 2 / 20 - state.solution.approach) - tips[:, 1]
        # heights are interpolated between points of the surface: a thousandth of a block is not seen
        expected = shown.magnification * np.interp(centres[:, 0], surface.x, surface.gaps[corner])
        assert over == pytest.approx(expected, abs=1e-3 * SOLID.ell)
        assert np.all(over[shown.closed[:, corner]] < 1e-3 * SOLID.ell)
    shifted = solved(lambda x: (x - 1) ** 2 / 20, mb.Microblock(0.002), load=2.0, rtol=1e-10)
    moved = blocks.blocks(shifted.surface(), shifted.zones["contact"]).squares
    # rounding of abscissae is magnified a little
    assert moved == pytest.approx(blocks.blocks(state.surface(), zones).squares + (1.0, 0.0), abs=1e-9)


def test_pictures_do_not_magnify_rounding(block):
    """Gaps of 1e-17 are nothing: all corners are marked; a law of one corner has no legend of two."""
    state = mb.Contact(on_mesh(block).problem.body, mb.Plane(), LAW).solve(load=0.05)
    shown = blocks.blocks(state.surface(), state.zones["contact"])
    assert shown.closed.all() and shown.magnification == 1.0
    figure = solved(mb.Punch(0.3), LINE).plot()
    assert not panel(figure, "blocks").get_legend()
    shown = panel(figure, "gap").lines[1].get_ydata()
    assert np.all(np.nan_to_num(shown) == 0)


# fields below


@pytest.mark.parametrize("quantity", ["psi", "shear", "s22"])
def test_fields_are_drawn_with_numbers_beside_the_colours_that_keep_apart(block, quantity):
    for state in (on_mesh(block), solved()):
        drawing = state.plot_below(quantity)
        assert ink(drawing) > 0.05  # colours, and not an empty box
        drawing.draw_without_rendering()
        bar = drawing.axes[-1]
        places = np.sort([label.get_window_extent().y0 for label in bar.get_yticklabels()])
        # a letter is as high
        assert len(places) >= 3 and np.diff(places).min() * 72 / drawing.dpi > 6
        # those beyond the colours would be drawn on the number that belongs at their end
        low, high = bar.get_ylim()
        assert all(low - 1e-9 <= tick <= high + 1e-9 for tick in bar.get_yticks())


# what stands in pictures and tables


def test_captions_say_what_is_shown_and_stay_within_their_figures():
    x, levers = np.linspace(-1, 1, 5), mb.Microblock(-0.001234, psi0_in="levers")
    state = solved(mb.Obstacle.from_samples(x, x**2 / 20), levers, load=0.1234, rtol=1e-2)
    assert state.caption.startswith("Samples(x=5 numbers, z=5 numbers), Microblock(psi0=-0.001234, psi0_in=")
    assert "load 0.1234, error " in state.caption and told(state.plot()).startswith(state.caption)
    assert "no error estimate" in solved(method=mb.Panels(order=8)).caption
    drawing = state.plot_below()
    drawing.draw_without_rendering()
    box = drawing._suptitle.get_window_extent()
    assert len(state.caption) > 80 and box.x0 >= 0 and box.x1 <= drawing.bbox.width


@pytest.mark.parametrize(
    "obstacle, law, words",
    [
        (mb.Punch(0.5), LINE, "cut: unbounded at -0.5, 0.5"),
        (mb.Punch(0.5), LAW, "cut: unbounded at -0.542, -0.458, 0.458, 0.542"),
        (mb.Wedge(0.02), LAW, "cut: unbounded at -0.0425, 0.0425"),
        (mb.Cylinder(R=10), LAW, ""),
    ],
)
def test_axes_that_are_cut_say_so_and_where(obstacle, law, words):
    figure = solved(obstacle, law).plot()
    assert [text.get_text() for text in panel(figure, "pressure").texts] == [words] * bool(words)
    moments = [text.get_text() for text in panel(figure, "micromoment").texts]
    assert any("unbounded" in text for text in moments) == (law is LAW and bool(words))


def test_every_corner_has_a_curve_and_a_look_of_its_own():
    """Also in print without colours."""
    state = solved(mb.Cylinder(R=10), LAW)
    figure = state.plot()
    for kind, value in (("pressure", lambda c, x: state.pressure_at(x, c)), ("gap", state.gap_at)):
        for corner in LAW.corners:
            (line,) = (one for one in panel(figure, kind).lines if rf"\rm {corner}}}" in one.get_label())
            x, shown = map(np.asarray, line.get_data())
            inner = np.isfinite(shown) & (np.abs(x) < 0.9 * state.half_width)
            assert inner.sum() > 10
            size = np.abs(shown[inner]).max()  # between its points a pressure is interpolated
            assert np.abs(shown - value(corner, x))[inner].max() < 0.02 * size
    looks = {(line.get_color(), line.get_linestyle()) for line in panel(figure, "pressure").lines[1:]}
    assert len(looks) == 3 and len({style for _, style in looks}) >= 2


def test_tables_take_text_as_text():
    summary = Summary("<b>", "a & b", (Row("<i>", "&ell;", 1 / 3, "m<sup>"),), ("<script>",))
    assert "<script>" not in html(summary) and "&lt;b&gt;" in html(summary) and "0.3333" in html(summary)
    assert number(None) == "-" and number(3) == "3" and intervals([]) == "none"
    assert intervals([(k, k + 0.5) for k in range(6)]) == "6 intervals, 3 together"
