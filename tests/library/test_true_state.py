"""What comes with every result: data, labelled data sets, files and back, pictures; one class of states."""

import json
import pickle

import matplotlib
import matplotlib.pyplot as plt
import numpy as np
import pytest
from test_files import KINDS, SOLID, in_space, on_grid

import microblock as mb

xarray = pytest.importorskip("xarray", reason="labelled data sets need the extra `xarray`")
GROUND, CYLINDER = mb.HalfPlane(SOLID), mb.Cylinder(R=10)
PROBLEM = mb.Contact(GROUND, CYLINDER, mb.Microblock())
RESULTS = {
    **KINDS,
    "path": lambda: PROBLEM.path(load=1.0),
    "functions": lambda: mb.Contact(
        GROUND, lambda x: x**2 / 20, mb.Microblock(psi0=lambda x: 0.01 + 0 * x)
    ).solve(load=1.0),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_comes_back_from_its_file_digit_by_digit(name, tmp_path):
    """Every attribute; what lies between the points is refused by name, never another number."""
    made = RESULTS[name]()
    states = made.states if isinstance(made, mb.History) else [made] * (not isinstance(made, mb.LoadPath))
    assert all(type(state) is mb.State for state in states)
    made.save(tmp_path / "result")
    back = mb.load(tmp_path / "result")
    assert back.to_dict() == made.to_dict() and str(back) == str(made)
    assert back.to_xarray().identical(made.to_xarray())
    back.to_xarray().to_netcdf(tmp_path / "result.nc", engine="scipy")
    for state, other in zip(states, back.states if isinstance(made, mb.History) else [back]):
        for key in {*mb.State.names()} - {"solution", "problem", "body", "obstacle", "law"}:
            assert_same(getattr(other, key), getattr(state, key))
        where = 0.0 if state.zones else np.zeros((1, 2))
        for asked in (lambda: other.pressure_at(where), lambda: other.fields, lambda: other.solution.solver):
            with pytest.raises(mb.BadArgument, match="^file = .what lies between the points"):
                asked()
        assert_same(pickle.loads(pickle.dumps(other)).pressure, state.pressure)
    if name != "depth":  # whose surface is one point
        back.plot(tmp_path / "result.png")
    plt.close("all")


def assert_same(one, other):
    if isinstance(one, np.ndarray):
        assert one.dtype == other.dtype and np.array_equal(one, other)
    elif isinstance(one, dict):
        assert one.keys() == other.keys() and type(one) is type(other)
        for name, own in one.items():
            assert_same(own, other[name])
    else:
        assert one == other and type(one) is type(other)


def test_of_what_is_no_data_a_file_has_the_name(tmp_path):
    RESULTS["functions"]().save(tmp_path / "state.npz")
    back = mb.load(tmp_path / "state.npz")
    assert back.solid == SOLID and "lambda" in repr(back.obstacle)
    with pytest.raises(mb.BadArgument, match="there is no solve"):
        back.problem.solve(load=1.0)
    assert PROBLEM.solve(load=0.5, initial=back).load == 0.5  # passed over, as every other kind


def test_files_that_are_none_of_ours_are_refused(tmp_path):
    names = "os.system", "microblock.model.archive.import_module", "microblock.no.Thing"
    for number, name in enumerate(names):
        kind = list(name.rpartition(".")[::2])
        text = json.dumps({"class": kind, "parts": {"name": "antigravity"}})
        np.savez(tmp_path / f"{number}.npz", text=text)
    (tmp_path / "words").write_text("words")
    for name in ("0.npz", "1.npz", "2.npz", "words", "none"):
        with pytest.raises(mb.BadArgument, match="^file = "):
            mb.load(tmp_path / name)
    with pytest.raises(mb.BadArgument, match="^file = "):
        PROBLEM.path(load=1.0).save(tmp_path / "no" / "folder")


def test_a_missing_extra_is_named(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "xarray", None)
    with pytest.raises(mb.MissingExtra, match=r"microblock\[xarray\]"):
        PROBLEM.solve(load=1.0).to_xarray()


def test_pictures_are_drawn_into_an_axis_that_is_given(tmp_path):
    state, path = PROBLEM.solve(load=1.0), PROBLEM.path(load=1.0)
    history = RESULTS["friction on cells"]()
    for plot in (state.plot, state.plot_blocks, state.plot_below, path.plot, history.plot):
        figure, axis = plt.subplots()
        assert plot(file=tmp_path / "drawn.png", ax=axis) is figure
        assert axis.has_data() and (tmp_path / "drawn.png").stat().st_size
        assert isinstance(plot(), matplotlib.figure.Figure)
        plt.close("all")


def test_states_follow_the_loads():
    states = PROBLEM.states([0.5, 1.0, 0.2], rtol=1e-6)
    assert [state.load for state in states] == [0.5, 1.0, 0.2]
    for state in states:  # each within its own estimate of one that is solved alone
        alone = PROBLEM.solve(load=state.load, rtol=1e-6)
        assert state.half_width == pytest.approx(alone.half_width, rel=1e-5)
    with pytest.raises(mb.BadArgument, match="^load = -1"):
        PROBLEM.states([0.5, -1])
    with pytest.raises(mb.BadArgument, match="^loads = 3"):
        PROBLEM.states(3)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
def test_an_elastic_solid_is_the_classical_one_at_every_size(size):
    """Hertz' half-width and pressure, without a word on blocks: it has no length of its own."""
    solid = mb.Elastic(E=100, nu=0.3)
    load = size
    state = mb.Contact(mb.HalfPlane(solid), mb.Cylinder(R=10 * size), mb.Unilateral()).solve(load, rtol=1e-5)
    a, p = mb.hertz_scales(solid, R=10 * size, P=load)
    assert state.half_width == pytest.approx(a, rel=1e-5) and not state.warnings
    assert state.pressure_at(0.0) == pytest.approx(p, rel=1e-4)  # ten times rtol, for a value at a place
    with pytest.raises(mb.BadArgument, match="^law = "):
        mb.Contact(mb.HalfPlane(solid), CYLINDER, mb.Microblock())


@pytest.mark.parametrize("kind", ["half-space", "mesh"])
def test_pressures_of_three_dimensions_are_known_between_the_points(kind):
    """They are those of the points there, to rounding, the mean of neighbours half way, and 0 far away; what
    only a state of the plane has is refused by name.
    """
    state = on_grid() if kind == "half-space" else in_space()
    close = 1e-12 * state.pressure.max()
    assert state.pressure_at(state.points) == pytest.approx(state.pressure, abs=close)
    for name, own in state.pressures.items():
        assert state.pressure_at(state.points[:, :2], name) == pytest.approx(own, abs=close)
    middle = np.argmax(state.pressure)
    other = np.argsort(np.linalg.norm(state.points - state.points[middle], axis=1))[1]
    half_way = state.points[[middle, other]].mean(axis=0)
    mean = state.pressure[[middle, other]].mean()
    assert state.pressure_at([half_way])[0] == pytest.approx(mean, abs=close)
    assert state.pressure_at([(1e3, 0.0)])[0] == 0 and state.zones is None and state.half_width is None
    for asked in (
        lambda: state.gap_at(next(iter(state.pressures)), 0.0),
        lambda: state.surface(),
        lambda: state.plot_below(),
        lambda: state.plot(window=(-1, 1)),
        lambda: state.pressure_at([0.0]),
    ):
        with pytest.raises(mb.BadArgument):
            asked()


def test_a_material_near_the_largest_coupling_is_written_so_that_it_can_be_read():
    """beta = 2 is excluded, and 1.99999999 in six digits is 2."""
    near = mb.Cosserat(E=1, nu=0.3, ell=1, beta=2 - 1e-8)
    assert "eta=" in repr(near) and "beta=" not in repr(near)
    assert "beta=1.9," in repr(mb.Cosserat(E=1, nu=0.3, ell=1, beta=1.9))
