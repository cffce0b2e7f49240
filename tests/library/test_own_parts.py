"""Bodies, methods and laws of a user's own: what they may leave out, what is refused by name, what agrees."""

import pickle
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from microblock.contact_solvers.compliance import Compliance
from microblock.contact_solvers.frictional_contact import FrictionalContact
from microblock.contact_solvers.nodal import NodalSolver
from microblock.errors import shown
from microblock.model.corner_geometry import Blocks
from microblock.model.law import Law, tangents
from microblock.model.methods import GivenCompliance
from microblock.model.obstacles import RigidObstacle, as_obstacle
from microblock.model.solution import PlaneSolution
from microblock.model.solver import Solver
from tests.parts import CYLINDER, SOLID, UNILATERAL


class Springs:
    """Independent springs, of which what the protocol does not ask for is left out."""

    methods = (GivenCompliance,)
    solid, x = SOLID, np.linspace(-1.0, 1.0, 81)

    def compliance(self, clamped=False):
        count = len(self.x)
        matrix = np.diag(np.repeat((0.1, 0.0 if clamped else 1.0), count))
        points = np.column_stack((self.x, 0 * self.x))
        normals = np.tile([0.0, 1.0], (count, 1))
        return Compliance(points, normals, np.full(count, 0.025), self.changed(matrix), SOLID.ell)

    def changed(self, matrix):
        return matrix


def pressed(body, load=1.0, obstacle=CYLINDER, law=UNILATERAL):
    return mb.Contact(body, obstacle, law).solve(load=load)


def test_a_body_is_a_solid_and_methods():
    state = pressed(Springs())
    assert "Springs" in repr(state.problem)
    assert state.method == "givencompliance" and not state.warnings
    with pytest.raises(mb.BadArgument, match="^solid = .*no of"):
        state.problem.with_(solid=mb.Cosserat(E=1, nu=0.3, beta=1, ell=0.1))
    assert state.problem.with_(solid=SOLID) == state.problem
    for lacking, nothing in (("solid", property()), ("methods", property()), ("methods", ())):
        body = type("Half", (), {"solid": SOLID, "methods": (GivenCompliance,), lacking: nothing})()
        with pytest.raises(mb.BadArgument, match=f"^body = .*it has no {lacking}"):
            pressed(body)


def test_a_method_check_does_not_put_a_body_into_space():
    """It was asked for heights over a surface, and the law taken for one there."""

    class Checked(Springs):
        def check(self):
            raise RuntimeError("of its own")

    assert pressed(Checked()).pressure == pytest.approx(pressed(Springs()).pressure, rel=0, abs=0)


class Named:
    solver = type("Solver", (NodalSolver,), {})


def test_a_method_is_a_solver_and_gives_its_name():
    body = type("Mine", (Springs,), {"methods": (Named,)})()
    assert pressed(body).method == "named"
    body = type("Mine", (Springs,), {"methods": (type("Empty", (), {}),)})()
    with pytest.raises(mb.BadArgument, match="^method = .*no attribute `solver`"):
        pressed(body)


def test_a_method_of_ones_own_on_a_half_plane_stands_beside_panels_and_cells():
    """It has no usual rtol, predicts nothing and knows no picture: a TypeError and an AttributeError."""
    kind = type("Longer_Than_Others", (), {"solver": type("Formula", (Solver,), {})})
    body = type("Mine", (mb.HalfPlane,), {"methods": (kind, mb.Panels, mb.Cells)})(SOLID)
    for rtol in (None, 1e-4):
        plan = mb.Contact(body, CYLINDER, UNILATERAL).plan(load=1.0, rtol=rtol)
        assert [candidate.name for candidate in plan.candidates] == ["longer_than_others", "panels", "cells"]
        assert repr(plan).startswith("longer_than_others no prediction  <- the usual method")


def test_an_rtol_is_refused_where_a_solver_of_ones_own_estimates_no_error():
    """Its state was returned, as if the rtol had been met."""

    class Deaf(NodalSolver):
        def solve(self, load, approach, rtol, initial=None):
            return super().solve(load, approach, None, initial)

    method = type("Deaf_Method", (), {"solver": Deaf})
    body = type("Mine", (Springs,), {"methods": (method,)})()
    with pytest.raises(mb.BadArgument, match="^rtol = 0.001: cannot be asked of deaf_method"):
        mb.Contact(body, CYLINDER, UNILATERAL).solve(load=1.0, rtol=1e-3)


def test_what_a_solution_lacks_is_named():
    """It was told as a State that has no zones."""
    with pytest.raises(AttributeError, match="'Pressures' object has no attribute 'zones_by_name'"):
        type("Pressures", (PlaneSolution,), {"pressures": np.ones((1, 3))})().state()


CHANGES = {
    "skew": (lambda matrix: matrix + np.triu(0.01 * np.abs(matrix).max() + 0 * matrix, 1), "symmetric"),
    # rotations are 1e3 times as large here, and move a corner by half a block times as much
    "skew beside rotations": (
        lambda matrix: (
            matrix * np.repeat((1, 1e3), 81) + 1e-5 * (np.indices(matrix.shape) == [[[0]], [[1]]]).all(0)
        ),
        "symmetric",
    ),
    "NaN": (lambda matrix: np.where(matrix == 0.1, np.nan, matrix), "finite"),
    "indefinite": (lambda matrix: -matrix, "positive semidefinite"),
}


@pytest.mark.parametrize("name", CHANGES)
def test_a_compliance_that_is_none_is_refused_by_the_name_of_its_matrix(name):
    change, words = CHANGES[name]
    body = type("Wrong", (Springs,), {"changed": lambda self, matrix: change(matrix)})()
    problem = mb.Contact(body, CYLINDER, mb.Microblock())
    for ask in (lambda: problem.solve(load=1.0), lambda: problem.path(load=1.0).events):
        with pytest.raises(mb.BadArgument, match=f"^matrix = .*{words}"):
            ask()


def test_a_contact_up_to_the_last_node_is_warned_of():
    """Beyond it there may be body and obstacle; under a punch that ends there the contact does, too."""
    (words,) = pressed(Springs(), load=100.0).warnings[-1:]
    assert "reaches the last node, x1 = 1" in words
    assert not any("last node" in words for words in pressed(Springs(), obstacle=mb.Punch(1.0)).warnings)


def test_no_nodes_are_refused():
    nothing = np.zeros((0, 0))
    with pytest.raises(mb.BadArgument, match="one node or more"):
        FrictionalContact(nothing, nothing, nothing, np.zeros(0), 0.3)
    with pytest.raises(mb.BadArgument, match="one node or more"):
        Compliance(np.zeros((0, 2)), np.zeros((0, 2)), np.zeros(0), nothing, 0.1)


# --- laws of the user's: what a method cannot represent it refuses, and the rest agrees with other methods


NARROW = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.0851)
HALF = mb.HalfPlane(NARROW)


@dataclass(frozen=True)
class Corners(Law):
    """Corners at places s ell from the contact point, on blocks rotated by psi0 in the levers alone."""

    at: tuple
    psi0: float = 0.0
    friction: float = 0.0

    @property
    def corners(self):
        return ("C",) if len(self.at) == 1 else ("A", "B")

    def arms(self, points, normals):
        along = tangents(normals)
        side = along + self.psi0 * normals
        up = normals - self.psi0 * along
        return np.array([s * side + up / 2 for s in self.at])

    def places(self, points, normals):
        return np.array([s * tangents(normals) for s in self.at])


def pressed_by(law, body=HALF, method=None, **how):
    return mb.Contact(body, CYLINDER, law, method).solve(load=1.0, **how)


@pytest.mark.parametrize("law", [Corners((-0.5, 0.5), 0.3), Corners((-0.3, 0.7)), Corners((-0.3, 0.7), 0.2)])
def test_cells_take_the_levers_of_the_law(law):
    """They took those of psi0 = 0, or asked for an attribute `angle`; 1e-2 is what they promise."""
    panels = pressed_by(law, rtol=1e-4)
    cells = pressed_by(law, method=mb.Cells(), rtol=1e-2)
    assert cells.method == "cells" and panels.method == "panels"
    for name in ("pressure", "micromoment"):
        expected = np.interp(cells.x, panels.x, getattr(panels, name))
        assert np.abs(getattr(cells, name) - expected).max() < 0.05 * np.abs(expected).max()  # cells at edges
    assert cells.micromoment.min() == pytest.approx(panels.micromoment.min(), rel=1e-2)


def test_blocks_that_are_rotated_in_the_levers_are_those_of_the_library():
    by_law, expected = (
        pressed_by(law, method=mb.Cells(256))
        for law in (Corners((-0.5, 0.5), 0.3), mb.Microblock(0.3, "levers"))
    )
    assert np.allclose(by_law.pressure, expected.pressure, rtol=0, atol=1e-9 * expected.pressure.max())


REFUSED = {
    "lever of one corner": (Corners((-0.25,)), None, "one corner with a lever"),
    "lever of one corner, cells": (Corners((-0.25,)), mb.Cells(), "one corner with a lever"),
    "distance": (
        type("Far", (Corners,), {"places": lambda self, *where: 0.6 * Corners.places(self, *where)})(
            (-0.5, 0.5)
        ),
        mb.Cells(),
        "differ",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_half_planes_do_not_know_is_refused(name):
    """The lever of one corner was dropped: 1 % of the pressure beside an estimate of 5e-5."""
    law, method, words = REFUSED[name]
    with pytest.raises(mb.BadArgument, match=words):
        pressed_by(law, method=method, rtol=1e-2)


def test_friction_on_a_half_plane_takes_no_other_levers_than_1_and_minus_1():
    """Those of the law were taken as 1 and -1."""
    problem = mb.Contact(HALF, CYLINDER, Corners((-0.3, 0.7), friction=0.3))
    with pytest.raises(mb.BadArgument, match="levers 1 and -1"):
        problem.history([(1.0, 0.0)])


class Elsewhere(Corners):
    """Levers are others for x beyond a place alone."""

    def arms(self, points, normals):
        return super().arms(points, normals) - 0.1 * (points[:, :1] > 0.1) * tangents(normals)


@pytest.mark.parametrize("places", [(0.0,), (-0.5, 0.5)])
def test_levers_are_looked_at_where_the_contact_is(places):
    """At x = 0 alone both laws are those of the library."""
    problem = mb.Contact(HALF, CYLINDER, Corners(places, friction=0.3))
    assert problem.history([(1.0, 0.0)], rtol=0.1).states[0].load == 1
    with pytest.raises(mb.BadArgument, match="lever"):
        mb.Contact(HALF, CYLINDER, Elsewhere(places, friction=0.3)).history([(1.0, 0.0)], rtol=0.1)


@pytest.mark.parametrize("where", ["half-space", "mesh"])
@pytest.mark.parametrize("law", [Corners((-0.25,)), Corners((0.0,)), Corners((-0.5, 0.5))], ids=str)
def test_over_a_surface_laws_derived_from_law_are_refused(law, where):
    """A law derived from another one is refused in `tests/refusals.csv`."""
    mesh = MakeStructured3DMesh(nx=2, ny=2, nz=2, mapping=lambda x, y, z: (x, y, z - 1))
    body = (
        mb.HalfSpace(NARROW)
        if where == "half-space"
        else mb.Body(mesh, NARROW, fixed="bottom", contact="top")
    )
    with pytest.raises(mb.BadArgument, match="^law = Corners.*over a surface"):
        mb.Contact(body, mb.Sphere(2.0), law)


def derived(base=Corners, **own):
    """A law derived from another one, by default with two corners, with attributes of its own."""
    return type("Derived", (base,), own)(*[(-0.5, 0.5)] * (base is Corners))


def returning(result):
    return lambda *_: result


def halved(base):
    return derived(base, arms=lambda self, *where: base.arms(self, *where) / 2)


SLIPS = {
    "nothing": (lambda: derived(arms=returning(None)), "arms must return finite real numbers"),
    "a mapping": (lambda: derived(arms=returning({"A": 1.0, "B": -1.0})), "arms must return.*an array"),
    "of one corner": (lambda: derived(arms=returning(np.zeros((1, 1, 2)))), "arms must return"),
    "NaN": (lambda: derived(arms=returning(np.full((2, 1, 2), np.nan))), "arms must return finite"),
    "complex": (lambda: derived(arms=returning(np.full((2, 1, 2), 1j))), "arms must return finite real"),
    "NaN place": (lambda: derived(places=returning(np.full((2, 1, 2), np.nan))), "places must return finite"),
    **{
        f"named {names}": (lambda names=names: derived(corners=names), "must name its corners")
        for names in (("A", "full"), (1, 2), ("A", "A"), ())
    },
    "no arms": (lambda: derived(Law), "it has no arms"),
    # levers of its own, shifts other than those of its gaps: 15 % of the pressure, without a word
    **{
        name: (lambda name=name: derived(**{name: returning(None)}), f"must not have {name}")
        for name in ("levers", "initial_gaps", "shifts")
    },
    # gaps would be those of the law that it is derived from
    "halved blocks": (lambda: halved(mb.Microblock), "arms of its own and the places of Microblock"),
    "halved line": (lambda: halved(mb.Unilateral), "arms of its own and the places of Unilateral"),
    "from right to left": (lambda: Corners((0.5, -0.5)), "from left to right"),
    "fails": (lambda: derived(arms=lambda *_: 1 / 0), "arms must take points and normals.*ZeroDivision"),
    "rotation in words": (
        lambda: derived(initial_rotation=returning("q")),
        "initial_rotation must return finite real numbers",
    ),
    "no corners": (lambda: derived(corners=None), "must name its corners, a tuple"),
    "flags": (lambda: derived(even=np.array([True, False])), "even must be True or False"),
    "friction in words": (lambda: Corners((-0.5, 0.5), friction="q"), "^friction = .q."),
    "no rotation": (lambda: derived(clamps_rotation=True), "2 corners and constrains psi"),
}


@pytest.mark.parametrize("slip", SLIPS)
def test_slips_in_a_law_are_named(slip):
    make, words = SLIPS[slip]
    with pytest.raises(mb.BadArgument, match=words):
        mb.Contact(HALF, CYLINDER, make())


class Drifting(Corners):
    """Corners go away from their contact point along the surface."""

    def places(self, points, normals):
        return super().places(points, normals) + points[:, :1] * tangents(normals)


def test_corners_are_everywhere_where_they_are_needed():
    """A second body gave way at other places than the corners': 15 % of the pressure, without a word."""
    law = Drifting((-0.5, 0.5))
    second = mb.Deformable(mb.HalfPlane(NARROW), CYLINDER)
    for obstacle, method in ((second, None), (second, mb.Cells()), (mb.Punch(1.0), None)):
        with pytest.raises(mb.BadArgument, match="at one distance"):
            mb.Contact(HALF, obstacle, law, method)
    mesh = MakeStructured2DMesh(nx=4, ny=2, mapping=lambda x, y: (x - 0.5, y - 1))
    mb.Contact(mb.Body(mesh, NARROW, fixed="bottom", contact="top"), CYLINDER, law)  # which needs none


def test_blocks_that_are_rotated_are_those_of_the_library():
    """Gaps and shifts follow from arms and rotation alone."""

    class Rotated(Law):
        corners = ("A", "B")
        arms = mb.Microblock(0.02).arms
        initial_rotation = mb.Microblock(0.02).initial_rotation

    by_law, expected = (pressed_by(law, rtol=1e-4) for law in (Rotated(), mb.Microblock(0.02)))
    assert by_law.problem.blocks.shifts == pytest.approx(expected.problem.blocks.shifts, rel=1e-15)
    # one problem, to rounding and what edges leave
    assert by_law.half_width == pytest.approx(expected.half_width, rel=1e-6)


def test_places_follow_a_rotation_that_differs_from_block_to_block():
    class Wavy(Law):
        corners = ("A", "B")

        def initial_rotation(self, x):
            return 0.1 * x

        def arms(self, points, normals):
            along, psi0 = tangents(normals), 0.1 * points[:, :1]
            return np.array(
                [s * (along + psi0 * normals) + (normals - psi0 * along) / 2 for s in (-0.5, 0.5)]
            )

    points = np.array([(0.3, -0.7), (-0.2, 0.5)])
    normals = np.array([(0.0, 1.0), (0.6, 0.8)])
    side = tangents(normals) + 0.1 * points[:, :1] * normals  # (20), to rounding
    assert Wavy().places(points, normals) == pytest.approx(np.array((-side, side)) / 2, abs=1e-15)


# --- one geometry: what a law is asked for


def solved_with(law, where):
    """A problem that each method solves, and its load."""
    square = MakeStructured2DMesh(nx=16, ny=8, mapping=lambda x, y: (2 * x - 1, y - 1))
    body = mb.Body(square, SOLID, order=2, fixed="bottom", contact="top")
    return {
        "panels": lambda: mb.Contact(HALF, CYLINDER, law, mb.Panels()),
        "cells": lambda: mb.Contact(HALF, CYLINDER, law, mb.Cells()),
        "fitted": lambda: mb.Contact(mb.Block(SOLID, 4.0), CYLINDER, law, mb.Fitted()),
        "newton": lambda: mb.Contact(body, CYLINDER, law, mb.Newton()),
        "half-space": lambda: mb.Contact(mb.HalfSpace(SOLID), mb.Sphere(R=10), law),
    }[where]()


@pytest.mark.parametrize("where", ["panels", "cells", "fitted", "newton", "half-space"])
def test_a_solve_asks_a_uniform_law_ten_times_at_most(where, monkeypatch):
    """One block stands for all; the law was asked 74 times by a fitted mesh."""
    visits = []
    for name in ("arms", "places", "initial_rotation"):
        method = getattr(mb.Microblock, name)

        def counted(law, *points, name=name, method=method):
            visits.append(name)
            return method(law, *points)

        monkeypatch.setattr(mb.Microblock, name, counted)
    problem = solved_with(mb.Microblock(0.01), where)
    made = len(visits)
    problem.solve(load=0.1, rtol=None if where == "newton" else 1e-2)
    assert len(visits) - made <= 10
    assert visits  # they are counted


def test_blocks_keep_the_digits_of_a_small_rotation():
    """It was what levers of 1 leave of it: 0."""
    x = np.array([1.0, 2.0])
    turned = [mb.Microblock(1e-18), mb.Microblock(lambda x: 1e-18 * x)]
    slopes = [Blocks(law, 0.1).tilt(x)[0].tolist() for law in turned]
    assert slopes == [[1e-18, 1e-18], [1e-18, 2e-18]]
    pair = Blocks(mb.Microblock((1e-18, 2e-18)), 0.1, in_space=True)
    assert pair.tilt(x, x).tolist() == [[-2e-18, -2e-18], [1e-18, 1e-18]]
    halved = derived(mb.Microblock, arms=lambda self, *where: mb.Microblock(0.3).arms(*where))
    assert Blocks(halved, 0.1).tilt(x)[0] == pytest.approx([0.3, 0.3], rel=1e-15)


class WithoutAxis:
    even = True

    def height(self, x1):
        return np.where(x1 == 0, np.nan, x1**2 / 20)


def test_an_obstacle_that_says_that_it_is_even_is_looked_at_on_its_axis():
    """No cell of 64 lies there."""
    with pytest.raises(mb.BadArgument, match="nan at x = 0"):
        mb.Contact(mb.HalfPlane(SOLID), WithoutAxis(), UNILATERAL, mb.Cells(64, window=(-1, 1)))


def test_a_law_that_says_that_it_is_uniform_is_looked_at():
    class Growing(Corners):
        uniform = True

        def arms(self, points, normals):
            return super().arms(points, normals) * (1 + 1e-3 * (points[:, :1] > 1))

    with pytest.raises(mb.BadArgument, match="says that it is uniform, but its arms"):
        mb.Contact(HALF, CYLINDER, Growing((-0.5, 0.5)))

    class Derived(mb.Microblock):  # uniform is said of the arms of Microblock
        def arms(self, points, normals):
            return super().arms(points, normals) * (1 + 1e-3 * (np.abs(points[:, :1]) > 1))

        places = mb.Microblock.places

    levers = mb.Contact(HALF, CYLINDER, Derived()).blocks.levers(np.array([0.0, 2.0]))
    assert levers[0] == pytest.approx([1.0, 1.001], abs=1e-12)


def test_a_law_derived_by_its_angle_alone_is_taken():
    """It was refused, as one that says that it is uniform."""

    class Wavy(mb.Microblock):
        def angle(self, x):
            return 0.002 * np.sin(20 * x)

    body = mb.HalfPlane(SOLID)
    states = [
        mb.Contact(body, CYLINDER, law).solve(load=1.0, rtol=1e-4)
        for law in (Wavy(), mb.Microblock(psi0=lambda x: 0.002 * np.sin(20 * x)))
    ]
    x = np.linspace(-0.3, 0.3, 7)
    first, second = (state.pressure_at(x) for state in states)
    assert first == pytest.approx(second, rel=1e-3)  # ten times what both were asked for


def test_an_obstacle_with_the_base_may_be_callable_and_needs_a_height():
    class Parabola(RigidObstacle):
        def __call__(self, x):
            return x**2 / 20

    state = pressed(Springs(), obstacle=Parabola())
    assert state.pressure == pytest.approx(pressed(Springs(), obstacle=CYLINDER).pressure, rel=1e-12)
    with pytest.raises(mb.BadArgument, match="^obstacle = "):
        pressed(Springs(), obstacle=type("Nothing", (RigidObstacle,), {})())


def parabola(**attributes):
    """An obstacle that says something of itself."""
    return SimpleNamespace(height=lambda x: x**2 / 20, **attributes)


SAID = {  # once a ValueError, TypeError or AttributeError of some line far inside, or believed
    "method for a class": (lambda: type("B", (Springs,), {"methods": (GivenCompliance(),)})(), "methods"),
    "a class": (lambda: type("B", (Springs,), {"methods": GivenCompliance})(), "methods"),
    "solid": (lambda: type("B", (Springs,), {"solid": np.ones(2)})(), "solid"),
    "period of a body": (lambda: type("B", (Springs,), {"period": "q"})(), "period"),
    "one end": (lambda: parabola(ends=(0.5,)), "ends"),
    "ends from right to left": (lambda: parabola(ends=(1.0, -1.0)), "ends"),
    "array of ends": (lambda: parabola(ends=np.zeros((2, 2))), "ends"),
    "number of ends": (lambda: parabola(ends=np.array(0.5)), "ends"),
    "jumps": (lambda: parabola(kinks=(0.0,), jumps=(0.0, 0.0)), "jumps"),
    "infinite jump": (lambda: parabola(kinks=(0.0,), jumps=(np.inf,)), "jumps"),
    "array of even": (lambda: parabola(even=np.array([True, False])), "even"),
    "formulas": (lambda: parabola(formulas=np.array([True, False])), "formulas"),
    "period": (lambda: parabola(period="q"), "period"),
    "negative period": (lambda: parabola(period=-1.0), "period"),
}


@pytest.mark.parametrize("name", SAID)
def test_what_parts_say_of_themselves_is_looked_at(name):
    make, argument = SAID[name]
    part = make()
    uses = [lambda: mb.Contact(part, CYLINDER, UNILATERAL)]
    if not isinstance(part, Springs):
        uses = [lambda: mb.Contact(HALF, part, UNILATERAL), lambda: mb.Deformable(HALF, part)]
    for use in uses:
        with pytest.raises(mb.BadArgument, match=f"^{argument} = ") as refused:
            use()
        assert np.array_equal(refused.value.value, getattr(part, argument))


class Shelf:
    """A level punch without a base, which may become wider."""

    half_width = 1.0

    @property
    def ends(self):
        return -self.half_width, self.half_width

    def height(self, x):
        return np.where(np.abs(x) <= self.half_width, 0 * x, np.inf)


@pytest.mark.parametrize("method", [mb.Panels(), mb.Cells()])
def test_an_obstacle_is_asked_each_time(method):
    """It had the ends of the time when the problem was made, and the height of the time of the solve."""
    shelf = Shelf()
    problem = mb.Contact(HALF, shelf, UNILATERAL, method)
    shelf.half_width = 0.5
    assert problem.solve(load=1.0).half_width == pytest.approx(0.5, rel=1e-5)  # cells fit edges to 1e-6
    roller = mb.Deformable(HALF, shelf)
    shelf.half_width = 2.0
    assert as_obstacle(shelf).ends == roller.ends == (-2.0, 2.0)


class Roof:
    """A wedge whose places are arrays."""

    kinks = np.zeros(1)
    jumps = np.array([0.2])
    ends = np.array([-1.0, 1.0])

    def height(self, x):
        return np.where(np.abs(x) <= 1, 0.1 * np.abs(x), np.inf)


@pytest.mark.parametrize("given", [Roof(), Shelf(), np.abs])
def test_what_stands_for_an_obstacle_is_named_as_that_and_pickled(given):
    obstacle = as_obstacle(given)
    assert repr(obstacle) == shown(given)
    copied = pickle.loads(pickle.dumps(obstacle))
    x = np.linspace(-0.5, 0.5, 5)
    assert copied.height(x) == pytest.approx(obstacle.height(x), rel=0, abs=0)
    for name in ("kinks", "jumps", "ends", "formulas", "even", "period"):
        assert getattr(copied, name) == getattr(obstacle, name)
    assert obstacle == as_obstacle(given) and hash(obstacle) == hash(as_obstacle(given))
    failure = mb.BadArgument("obstacle", obstacle, "must be another")
    assert failure.value is given and str(failure) == f"obstacle = {shown(given)}: must be another"


@pytest.mark.parametrize("method", [mb.Panels(), mb.Cells()])
def test_a_rotation_of_a_derived_law_is_obeyed(method):
    """Gaps were those of psi0 = 0, and the blocks taken for level ones."""

    class Rotated(mb.Microblock):
        def initial_rotation(self, x):
            return 0.02 + 0 * x

    states = [pressed_by(law, method=method, rtol=1e-2) for law in (Rotated(), mb.Microblock(0.02))]
    x = np.linspace(-0.3, 0.3, 31)
    by_law, expected = (state.pressure_at(x) for state in states)
    assert np.abs(by_law - expected).max() < 0.04 * expected.max()  # levers have 2 % less
    level = pressed_by(mb.Microblock(), method=method, rtol=1e-2).pressure_at(x)
    assert np.abs(level - expected).max() > 0.1 * expected.max()


def test_a_law_that_says_that_it_is_even_has_its_corners_at_mirrored_places():
    class Claims(mb.Microblock):
        even = True

        def initial_rotation(self, x):
            return 0.02 + 0 * x

    with pytest.raises(mb.BadArgument, match="says that it is even, but its places"):
        mb.Contact(HALF, CYLINDER, Claims())


def test_a_compliance_with_the_side_of_the_blocks_asks_these_alone(monkeypatch):
    """A uniform law was asked once more for each system of corners."""
    problem = mb.Contact(Springs(), CYLINDER, mb.Microblock())
    nodes = problem.solver.nodes
    asked = []
    places = mb.Microblock.places

    def counted(law, points, normals):
        asked.append(len(points))
        return places(law, points, normals)

    monkeypatch.setattr(mb.Microblock, "places", counted)
    blocks = Blocks(mb.Microblock(), SOLID.ell)
    for _ in range(3):
        nodes.corner_system(blocks, CYLINDER)
    assert asked == [1]


def test_a_compliance_has_its_own_side_of_the_blocks():
    """Gaps had that of the solid, and levers that of the compliance."""

    class Wide(Springs):
        def compliance(self, clamped=False):
            return replace(super().compliance(clamped), ell=0.2)

    wide = mb.Contact(Wide(), CYLINDER, mb.Microblock()).solver.nodes
    geometry = wide.corner_system(mb.Contact(Springs(), CYLINDER, mb.Microblock()).blocks, CYLINDER)
    x = wide.points[:, 0]
    assert geometry[1] == pytest.approx(np.concatenate(((x - 0.1) ** 2, (x + 0.1) ** 2)) / 20)
