"""Pictures of states: corners that touch, rounding, captions (tests/frozen has curves, ticks and texts)."""

import numpy as np
import pytest

import microblock as mb
from microblock.view import blocks

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.085)
LAW, LINE = mb.Microblock(), mb.Unilateral()


def solved(obstacle=mb.Cylinder(R=10.0), law=LAW, method=None, body=mb.HalfPlane(SOLID), load=1.0, rtol=None):
    return mb.Contact(body, obstacle, law, method).solve(load=load, rtol=rtol)


def on_mesh(block, law=LAW):
    body = mb.Body(block, mb.Cosserat(E=2.6, nu=0.3, beta=1, ell=0.2), order=3, fixed="bottom")
    return solved(mb.Cylinder(2.0), law, body=body, load=0.05)


def panel(drawing, name):
    """The axes of a figure of a state that are called so."""
    names = "pressure", "micromoment", "gap", "turn", "zones", "blocks"
    return drawing.axes[names.index(name)]


def told(drawing):
    return " ".join(drawing.get_suptitle().split())


# states


def test_a_corner_touches_in_the_picture_where_its_gap_is_closed():
    """A alone, B alone, both and none are four fills; a shifted contact has shifted blocks."""
    law, panels = mb.Microblock(0.002), mb.Panels(order=14)  # one order: the same points of the surface
    state = solved(law=law, load=2.0, method=panels)
    window = blocks.window(SOLID.ell, state.zones["contact"])
    surface = state.surface(window)
    shown = blocks.blocks(surface, window)
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
    shifted = solved(lambda x: (x - 1) ** 2 / 20, law, load=2.0, method=panels)
    moved = blocks.blocks(shifted.surface(), blocks.window(SOLID.ell, shifted.zones["contact"])).squares
    # rounding of abscissae is magnified a little
    assert moved == pytest.approx(blocks.blocks(state.surface(), window).squares + (1.0, 0.0), abs=1e-9)


@pytest.mark.parametrize("psi0_in", ["gaps and levers", "levers"])
def test_blocks_of_a_half_space_touch_the_sphere_in_the_row_that_is_shown(psi0_in):
    """Left corners alone, right ones, both and none; the height is that half a block beside the row."""
    state = solved(mb.Sphere(10.0), mb.Microblock((0.0, -0.004), psi0_in), mb.Cells(128), mb.HalfSpace(SOLID))
    surface, contact, where = blocks.section(state)
    shown, x2 = blocks.blocks(surface, blocks.window(SOLID.ell, contact)), float(where.split()[-1])
    assert {*map(tuple, shown.closed.tolist())} == {(a, b) for a in (False, True) for b in (False, True)}
    for corner in (0, 1):
        x, height = shown.squares[:, corner].T
        nearest = ((abs(x2) - SOLID.ell / 2) ** 2 + x**2) / 20  # of the two corners that one stands for
        over = shown.magnification * (nearest - state.approach) - height
        # heights are interpolated between rows of cells that are a ninth of a block wide
        assert np.all(np.abs(over[shown.closed[:, corner]]) < 0.02 * SOLID.ell)
        assert np.all(over[~shown.closed[:, corner]] > -0.02 * SOLID.ell)


def test_a_row_of_blocks_lies_in_one_square():
    """Between squares there are no cells, and what would be drawn there is neither surface nor obstacle."""
    hills = lambda x1, x2: (np.minimum((x1 - 1) ** 2, (x1 + 1) ** 2) + x2**2) / 20  # noqa: E731
    state = solved(hills, LAW, mb.Cells(64), mb.HalfSpace(SOLID), load=0.1)
    row, *_ = blocks.section(state)
    assert len(state.squares) == 2 and any(np.allclose(row.x, square.axes[0]) for square in state.squares)


def test_pictures_do_not_magnify_rounding(block):
    """Gaps of 1e-17 are nothing: all corners are marked; a law of one corner has no legend of two."""
    state = mb.Contact(on_mesh(block).problem.body, mb.Plane(), LAW).solve(load=0.05)
    shown = blocks.blocks(state.surface(), blocks.window(state.solid.ell, state.zones["contact"]))
    assert shown.closed.all() and shown.magnification == 1.0
    figure = solved(mb.Punch(0.3), LINE).plot()
    assert not panel(figure, "blocks").get_legend()
    shown = panel(figure, "gap").lines[1].get_ydata()
    assert not shown[np.isfinite(shown)].any()


# fields below


# what stands in pictures and tables


def test_captions_say_what_is_shown_and_stay_within_their_figures():
    x, levers = np.linspace(-1, 1, 5), mb.Microblock(-0.001234, psi0_in="levers")
    state = solved(mb.Obstacle.from_samples(x, x**2 / 20), levers, load=0.1234, rtol=1e-2)
    assert state.caption.startswith("Samples(5 points), Microblock(psi0=-0.001234, psi0_in=")
    assert "load 0.1234, error " in state.caption and told(state.plot()).startswith(state.caption)
    assert "no error estimate" in solved(method=mb.Panels(order=8)).caption
    drawing = state.plot_below()
    drawing.draw_without_rendering()
    box = drawing._suptitle.get_window_extent()
    assert len(state.caption) > 80 and box.x0 >= 0 and box.x1 <= drawing.bbox.width
    samples = mb.Obstacle.from_samples([-1.0, -0.4, 0.4, 1.0], [0.03, 0.0, 0.0, 0.03])
    drawing = solved(samples, LINE).plot_blocks()
    drawing.draw_without_rendering()  # matplotlib breaks no line itself, which the layout would not know of
    assert drawing._suptitle._get_wrapped_text() == drawing.get_suptitle()


def test_blocks_of_two_bodies_touch_where_they_are_pressed():
    """The obstacle is drawn with what the second body moves, on the surface of the first: to what a sphere
    rises below half a block, 5e-6, and to rounding of gaps; the approach is 0.03.
    """
    solid = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.02)
    ball = mb.Deformable(mb.HalfSpace(solid), mb.Sphere(10.0))
    state = solved(ball, body=mb.HalfSpace(solid), method=mb.Cells(nodes=32))
    surface, _, _ = blocks.section(state)
    pressed = surface.pressures.min(axis=0) > 0
    assert pressed.sum() > 10
    np.testing.assert_allclose((surface.obstacle + surface.displacement)[pressed], 0, atol=2e-5)
