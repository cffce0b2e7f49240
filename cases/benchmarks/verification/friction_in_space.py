"""30 histories with friction of bodies on meshes in space, drawn by program: bodies, obstacles, laws, orders,
cells of the mesh, friction, loads.

History k comes from (SEED, 90, k); its kind is k modulo the number of KINDS. What judges it:

half-space   a half-space of the same solid, by cells
finer        the same body with facets of 0.6 times the length
invariance   the same contact turned by any angle, or the half of a symmetric one, or in other units

Of each state the supports balance P and Q, and the fields of the body have its energy. Errors are those of
pressure, couples over ell and shear traction over f, in L2 over the contact boundary: that of the state with
the largest ratio of error to estimate.
"""

from dataclasses import dataclass
from functools import partial

import numpy as np

import microblock as mb
from microblock.fem import meshes3d

from . import SEED, bodies_in_space, scenes_in_space
from .judging import Case
from .obstacles import log
from .scenes_in_space import EXACT, HALF_SPACE, R, contact_in_units, contact_on

FINER = 0.6  # length of facets of the reference
SAME = 1e-3  # of states that are alike: residuals are 1e-7, and stick ends at another node where one is close


@dataclass(frozen=True)
class Motion:
    """A history on meshes whose facets have any length.

    Attributes
    ----------
    words : str
    problem : callable, the Contact on facets of a length
    size : float
    loads : array (k, 3)
    exact : callable, the states that judge, and what they do not know; None to take a finer mesh
    """

    words: str
    problem: object
    size: float
    loads: np.ndarray
    exact: object = None

    def case(self):
        return Case(self.words, 0.0, self.solve, self.verify)

    def solve(self):
        return self.problem(self.size).history(self.loads).states

    def verify(self, states):
        """(Error, estimate, what the judge does not know) of the worst state."""
        if max(map(unbalanced, states)) > EXACT:
            return np.inf, None, 0.0
        if self.exact:
            true, bar = self.exact()
            rows = [(error(*pair, pair[0]), pair[0].error_estimate, bar) for pair in zip(states, true)]
        else:
            true = self.problem(FINER * self.size).history(self.loads).states
            # errors fall like the length of facets
            share = 1 - FINER
            rows = [
                (error(*pair, pair[1]) / share, pair[0].error_estimate, 0.0) for pair in zip(states, true)
            ]
        return max(rows, key=lambda row: row[0] / (row[1] + row[2]))


def error(state, true, on):
    """The largest relative error of p, M/ell and q/f on the boundary of the state `on`."""
    places, weights = scenes_in_space.points(on.fields.body)
    p, couples, shear = fields_of(state, places)
    true_p, true_couples, true_shear = fields_of(true, places)
    squares = [
        weights @ (p - true_p) ** 2,
        weights @ np.nansum((couples - true_couples) ** 2, axis=1),
        weights @ np.sum((shear - true_shear) ** 2, axis=1),
    ]
    return float(np.sqrt(max(squares) / (weights @ true_p**2)))


def fields_of(state, places):
    """The pressure, the couples over ell and q/f of a State at places."""
    values = scenes_in_space.on_cells if state.squares is not None else scenes_in_space.fields_of
    p, couples = values(state)(places)
    return p, couples, state.shear_traction_at(places[:, :2]) / state.law.friction


def unbalanced(state):
    """How far the supports are off from the loads, and the energy from that of the fields."""
    force = scenes_in_space.reaction_of(state).force
    given = np.array((*state.shear, -state.load))
    given[:2] = np.where(state.solution.followed.given, given[:2], -force[:2])
    off = np.abs(force + given).max() / state.load
    return max(off, abs(state.fields.energy() - state.energy) / state.energy)


# ---- what is drawn


def law_of(rng, friction):
    kind = rng.integers(4)
    blocks = mb.Microblock(friction=friction)
    return (mb.Unilateral(friction), blocks, blocks, mb.Microclamped(friction))[kind], kind == 0


def loads_of(rng, friction):
    """Pressed, sheared one way, then another way, under another load in half of the histories."""
    P = scenes_in_space.load_of(rng)
    angles = rng.uniform(0, 2 * np.pi, 2)
    sizes = friction * P * rng.uniform(0.2, 0.95, 2)
    rows = [(P, 0, 0), *((P, q * np.cos(angle), q * np.sin(angle)) for q, angle in zip(sizes, angles))]
    if rng.random() < 0.5:
        rows[2] = tuple(rng.uniform(0.5, 1.0) * np.array(rows[2]))
    return np.array(rows)


def half_space(rng):
    friction = log(rng, 0.1, 0.6)
    law, _ = law_of(rng, friction)
    solid = scenes_in_space.solid_of(rng, classical=False)
    name, obstacle = scenes_in_space.smooth(rng)
    loads = loads_of(rng, friction)
    rows = partial(bodies_in_space.block, half=4.0, depth=5.0)
    words, mesh, order, size = scenes_in_space.cells(rng, rows, False)
    if order > 1:
        words, mesh, order, size = "hexahedra 1", rows, 1, 0.25

    def exact():
        states = mb.Contact(mb.HalfSpace(solid), obstacle, law).history(loads, rtol=0.1).states
        return states, max(state.error_estimate for state in states) + 2 * HALF_SPACE

    words = f"half-space {words} {name} {law} size {size:.2f} ell {solid.ell:.2f}"
    return Motion(words, partial(contact_on, mesh, solid, order, obstacle, law), size, loads, exact)


def finer(rng):
    friction = log(rng, 0.1, 0.6)
    law, classical = law_of(rng, friction)
    solid = scenes_in_space.solid_of(rng, classical)
    loads = loads_of(rng, friction)
    words, mesh, order, size = scenes_in_space.cells(rng, bodies_in_space.block, classical)
    name = ("block", "block", "layered", "cylinder", "holed")[rng.integers(5)]
    if name == "layered":
        mesh, solid = scenes_in_space.layered(rng, mesh, solid, classical)
    if name in ("cylinder", "holed"):
        mesh = getattr(bodies_in_space, name)
        words, order, size = "tetrahedra 1", 1, min(size, 0.35)
    shape, obstacle, *_ = scenes_in_space.smooth(rng)
    text = f"finer {name} {words} {shape} {law} size {size:.2f}"
    return Motion(text, partial(contact_on, mesh, solid, order, obstacle, law), size, loads)


def invariance(rng):
    friction = log(rng, 0.1, 0.6)
    kind = ("turned", "half", "units")[rng.integers(3)]
    law, _ = law_of(rng, friction)
    if kind == "turned" and isinstance(law, mb.Microblock):
        law = mb.Microclamped(friction)  # square blocks know directions
    solid = scenes_in_space.solid_of(rng, classical=False)
    order = 1
    loads = loads_of(rng, friction)
    mesh = bodies_in_space.block(0.35)
    curved = log(rng, 0.5, 2)

    def height(x, y):
        return (x**2 + curved * y**2) / (2 * R)

    angle = rng.uniform(0, 2 * np.pi)
    length = log(rng, 1e-6, 1e6)
    stress = log(rng, 1e-6, 1e12)
    if kind == "half":
        loads[:, 2] = 0.0

    def solve():
        return contact_on(lambda size: mesh, solid, order, height, law, 1.0).history(loads).states

    def turned():
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array(((c, s, 0), (-s, c, 0), (0, 0, 1)))
        other = bodies_in_space.moved(mesh, lambda x: x @ turn)
        contact = contact_on(
            lambda size: other, solid, order, lambda x, y: height(c * x + s * y, c * y - s * x), law, 1.0
        )
        rows = np.column_stack((loads[:, :1], loads[:, 1:] @ turn[:2, :2]))
        return contact.history(rows).states, 1.0, 1.0, turn[:2, :2]

    def half():
        x = np.unique(mesh.ngmesh.Coordinates()[:, 0])
        z = np.unique(mesh.ngmesh.Coordinates()[:, 2])
        part = meshes3d.block(x, x[x > -1e-9], z, reach=1.3)
        fixed = meshes3d.supports("bottom", x2="front")
        contact = contact_on(lambda size: part, solid, order, height, law, 1.0, fixed=fixed)
        return contact.history(loads / 2).states, 0.5, 1.0, np.eye(2)

    def units():
        contact = contact_in_units(mesh, solid, order, height, law, length, stress)
        return contact.history(loads * stress * length**2).states, stress * length**3, length, np.eye(2)

    def verify(states):
        if max(map(unbalanced, states)) > EXACT:
            return np.inf, 0.0, 0.0
        twins, work, unit, turn = {"turned": turned, "half": half, "units": units}[kind]()
        parts = []
        for state, twin in zip(states, twins):
            moved = state.tangential_approach @ turn - twin.tangential_approach / unit
            depth = np.abs(state.displacement).max()
            parts += [
                abs(twin.approach / unit - state.approach) / depth,
                np.abs(moved).max() / depth,
                abs(twin.work / work - state.work) / state.work,
                abs(twin.dissipation / work - state.dissipation) / state.work,
            ]
            if kind == "units":
                q, twin_q = (np.hypot(*solved.shear_traction.T).max() for solved in (state, twin))
                parts.append(abs(twin_q / q / stress - 1))
        return float(max(parts)), 0.0, 0.0

    return Case(f"invariance {kind} {law} ell {solid.ell:.2f}", SAME, solve, verify)


KINDS = (half_space, finer, finer, invariance, finer)


def case(k):
    """History k as a Case."""
    rng = np.random.default_rng((SEED, 90, k))
    drawn = KINDS[k % len(KINDS)](rng)
    return drawn if isinstance(drawn, Case) else drawn.case()
