"""Bodies and methods of a user's own: what they may leave out, and what is refused or warned of by name."""

import numpy as np
import pytest

import microblock as mb
from microblock.contact_solvers.compliance import Compliance
from microblock.contact_solvers.event_driven import FrictionalContact
from microblock.contact_solvers.nodal import NodalSolver
from microblock.model.methods import GivenCompliance
from microblock.model.solver import Solver
from microblock.model.state import Solution, State

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
CYLINDER, LINE = mb.Cylinder(R=10), mb.Unilateral()


class Springs:
    """Independent springs, of which what the protocol does not ask for is left out."""

    methods = (GivenCompliance,)
    solid, x = SOLID, np.linspace(-1.0, 1.0, 81)

    def compliance(self, clamped=False):
        count = len(self.x)
        matrix = np.diag(np.repeat((0.1, 0.0 if clamped else 1.0), count))
        points, normals = np.column_stack((self.x, 0 * self.x)), np.tile([0.0, 1.0], (count, 1))
        return Compliance(points, normals, np.full(count, 0.025), self.changed(matrix), SOLID.ell)

    def changed(self, matrix):
        return matrix


def pressed(body, load=1.0, obstacle=CYLINDER, law=LINE):
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
        plan = mb.Contact(body, CYLINDER, LINE).plan(load=1.0, rtol=rtol)
        assert [one.name for one in plan.candidates] == ["longer_than_others", "panels", "cells"]
        assert repr(plan).startswith("longer_than_others no prediction  <- the usual method")


def test_what_a_solution_lacks_is_named():
    """It was told as a State that has no zones."""
    with pytest.raises(AttributeError, match="'Solution' object has no attribute 'zones_by_name'"):
        State(Solution()).zones  # noqa: B018


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
