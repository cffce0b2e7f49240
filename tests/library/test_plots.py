"""The style of figures: what is read at 9 cm, and words beside curves."""

import numpy as np
import pytest
from matplotlib.font_manager import FontProperties
from matplotlib.mathtext import MathTextParser
from matplotlib.text import Text

from microblock.view import plots


def test_figures_are_one_column_wide_whatever_their_panels():
    for rows, columns in ((1, 1), (2, 1), (3, 2)):
        drawing, _ = plots.figure(rows, columns, height=1.5)
        assert drawing.get_size_inches() == pytest.approx([9 / 2.54, 1.5 * rows], abs=0.01)  # 3.54 inches


def test_letters_are_no_smaller_than_seven_points(tmp_path):
    def drawing(_):
        found, axis = plots.figure(height=4)
        axis.plot([1, 2], [1, 2], label="curve")
        axis.set(xlabel="$x_1$", ylabel="$p$", title="title")
        plots.legend_below(axis, title="title of the legend")
        plots.label(axis, 1, 1, "beside")
        plots.label_ends(axis, [(2, "at the end", "k")])
        sizes.extend(text.get_fontsize() for text in found.findobj(Text))
        return found

    sizes = []
    plots.draw(drawing, None, tmp_path, "a")
    assert min(sizes) >= plots.SMALLEST == 7


def test_indices_and_exponents_are_read_at_nine_centimetres():
    """Those of ticks have 6.5 points, and figures that are not ours keep theirs."""

    def smallest(words, size):
        glyphs = MathTextParser("path").parse(words, 72, FontProperties(size=size)).glyphs
        return min(glyph[1] for glyph in glyphs)

    with plots.styled():
        assert smallest("$10^{-7}$", plots.STYLE["xtick.labelsize"]) >= 6.5
        assert smallest(r"$a_\mathrm{mid}$", plots.SMALLEST) >= 6
    assert smallest("$10^{-8}$", 10) == pytest.approx(7)


@pytest.mark.parametrize("colour", [*plots.COLOURS, *plots.shades(7)])
def test_words_in_the_colour_of_a_curve_have_contrast_with_white(colour):
    rgb = np.array(plots.legible(colour))
    assert plots._contrast(rgb) >= 4.5  # level AA for text
    assert plots._contrast(np.array([0.0, 0, 0])) == pytest.approx(21)  # the largest there is, by definition


def test_shades_run_from_dark_to_light():
    light = [np.dot(colour[:3], (0.2126, 0.7152, 0.0722)) for colour in plots.shades(6)]
    assert light == sorted(light) and len(set(light)) == 6


@pytest.mark.parametrize(
    "places, expected",
    [
        ([0.1, 0.9, 0.5], [0.1, 0.9, 0.5]),
        ([0.5, 0.5], [0.45, 0.55]),  # moved alike, in the order in which they come
        ([0.5, 0.52, 0.48], [0.5, 0.6, 0.4]),
        ([0.0, 0.05, 0.12, 0.9], [-0.043333, 0.056667, 0.156667, 0.9]),  # mean of three, kept
        ([], []),
    ],
)
def test_words_at_the_ends_of_curves_keep_apart_and_move_little(places, expected):
    assert plots._apart(np.array(places, float), 0.1) == pytest.approx(expected, abs=1e-5)


def test_words_at_ends_stand_at_the_heights_of_logarithmic_axes():
    _, axis = plots.figure()
    axis.set(yscale="log", ylim=(1e-4, 1))
    plots.label_ends(axis, [(1e-2, "middle", "k"), (1e-4, "bottom", "k")])
    assert [text.xy for text in axis.texts] == [(1, pytest.approx(0.5)), (1, pytest.approx(0))]


def test_a_key_has_the_marks_of_the_curves():
    drawing, _ = plots.figure()
    plots.key(drawing, ["one", "two"], plots.shades(2), plots.MARKERS)
    plots.key(drawing, ["line"], plots.shades(1))
    marks, plain = ([handle.get_marker() for handle in one.legend_handles] for one in drawing.legends)
    assert marks == ["o", "s"] and plain in (["None"], [None])


@pytest.mark.parametrize("right", [-4, 4])
def test_a_label_stands_beside_its_point(right):
    drawing, axis = plots.figure(height=4)
    text = plots.label(axis, 0.5, 0.5, "some words", shift=(right, 0))
    drawing.draw_without_rendering()
    place, extent = axis.transData.transform((0.5, 0.5))[0], Text.get_window_extent(text)
    assert extent.x0 > place if right > 0 else extent.x1 < place
