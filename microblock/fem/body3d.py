"""A Cosserat body on a three-dimensional mesh: the space of (u, psi), its energy, loads and supports."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import NamedTuple

import ngsolve as ng
import numpy as np

from ..errors import BadArgument, NotConverged, require_kind, require_whole
from ..halfspace.obstacles import heights
from ..halfspace.symbol import require_stable
from ..model.material import Cosserat
from ..model.methods import Condensed, Newton
from ..threads import bounded
from . import energy3d
from .body import GIVEN, USUAL_CONTACT, BodyFields, MeshBody, require_finite_within
from .bulk import UNSOLVED
from .meshes import require_sound

FIELDS = ("u1", "u2", "u3", "psi1", "psi2", "psi3")
PARTS = "xyz"  # what NGSolve calls the components of a vector space
HELD = (
    "are rigid motions fixed, and psi where beta = 0? With alpha' and beta' (13) does not make "
    "the energy of a body with a free surface positive"
)


@dataclass(frozen=True)
class Loads3D:
    """Dead loads of (8) in three dimensions; every value a number or an NGSolve CoefficientFunction.

    Parameters
    ----------
    force : body force (f1, f2, f3) (force per volume)
    couple : body couple (l1, l2, l3) (moment per volume)
    traction : {boundary: (t1, t2, t3)} (force per area)
    micromoment : {boundary: (M1, M2, M3)} (moment per area)

    Examples
    --------
    >>> from microblock.fem.body3d import Loads3D
    >>> Loads3D(traction={"contact": (0, 0, -1)}).force
    (0, 0, 0)
    """

    force: tuple = (0, 0, 0)
    couple: tuple = (0, 0, 0)
    traction: Mapping = field(default_factory=dict)
    micromoment: Mapping = field(default_factory=dict)

    def __post_init__(self):
        require_finite_within(**vars(self))


class Body3D(MeshBody):
    """A linear Cosserat body on a mesh in three dimensions, pressed from above.

    Its contact boundary is horizontal (normal e3, at one height or several): facets are quadrilaterals, as of
    hexahedra, of any order, or triangles with order 1. Obstacles are those over a surface, `Sphere` and the
    like, or any ``height(x1, x2)``, counted from x3 = 0; laws have four corners as on a `HalfSpace`. The law
    `Microclamped` constrains psi1 and psi2 there. States have three dimensions, see `microblock.State`.

    Parameters
    ----------
    mesh : ngsolve.Mesh
        Three-dimensional; `microblock.fem.meshes3d.block` makes one of hexahedra.
    solid : Cosserat
    order : int
        Polynomial order of u and psi.
    fixed : str or mapping
        Boundaries on which u = psi = 0, or {field: boundaries} with the fields u1, u2, u3, psi1, psi2, psi3.
    contact : str
        Name or pattern of the boundary that an obstacle may touch.

    Raises
    ------
    BadArgument
        If an argument is out of range, a boundary is unknown, the mesh has elements without volume or of the
        other orientation, or the solid lets short waves of a free surface turn by themselves.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> x = meshes3d.graded(reach=0.6, step=0.15, far=3.0, growth=2.0)
    >>> mesh = meshes3d.block(x, x, -x[::-1], reach=0.6)          # a quarter, with two planes of symmetry
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> body = mb.Body3D(mesh, solid, fixed=meshes3d.supports("bottom", x1="left", x2="front"))
    >>> state = mb.Contact(body, mb.Sphere(R=10), mb.Microblock()).solve(load=0.25)   # of the quarter
    >>> round(float(state.weights @ state.pressure), 9), state.approach > 0
    (0.25, True)
    """

    solvers = {Condensed: "fem.solver3d.Solver3D", Newton: "fem.newton3d.NewtonSolver3D"}
    methods = (Condensed, Newton)
    names, periodic, element_orders = FIELDS, False, None
    prescribed: Mapping = MappingProxyType({})

    def __init__(self, mesh, solid: Cosserat, order=1, *, fixed=(), contact=USUAL_CONTACT):
        require_sound(mesh, dims=(3,))
        require_kind(Cosserat, "a Cosserat", solid=solid)
        if solid.beta > 0:  # else psi has nothing to do with u
            require_stable(solid)
        require_kind(str, "the name of a boundary", contact=contact)
        require_whole(1, order=order)
        self.mesh, self.solid, self.contact = mesh, solid, contact
        self.order = self.order_psi = int(order)
        self.fixed = self._patterns(fixed)
        self.space = self._vectors("u") * self._vectors("psi")
        self.width = self.space.ndof // len(
            FIELDS
        )  # unknowns of one field: numbers of field i begin at i width
        if contact != USUAL_CONTACT:
            self.boundary(contact, "contact")
        self.derived: dict = {}  # what costs a factorisation, see `once`

    def _vectors(self, name):
        """The H1 space of a vector with its supports."""
        constrained = {
            f"dirichlet{part}": self.fixed.get(f"{name}{i}", "") for i, part in enumerate(PARTS, 1)
        }
        return ng.VectorH1(self.mesh, order=self.order, **constrained)

    @property
    def _made_of(self):
        return {name: getattr(self, name) for name in ("mesh", "solid", "order", "fixed", "contact")}

    def check(self, obstacle):
        """BadArgument unless the obstacle has heights over a surface."""
        heights(obstacle, np.zeros(2), np.zeros(2))

    def unknowns_of(self, field):
        """Slice of the unknowns of a field."""
        first = FIELDS.index(field) * self.width
        return slice(first, first + self.width)

    def bulk(self, **options):
        """The bilinear form of the second variation of (10), assembled."""
        trial, test = self.space.TnT()
        form = ng.BilinearForm(self.space, symmetric=True, **options)
        form += energy3d.virtual_work(self.solid, trial, test) * ng.dx(bonus_intorder=self.bonus)
        form.Assemble()
        return form

    @bounded
    def solve(self, loads=Loads3D()):
        """Equilibrium without contact, as Fields3D.

        Raises
        ------
        NotConverged
            If the supports leave a rigid motion free, or the energy is not positive.
        """
        require_kind(Loads3D, "Loads3D", loads=loads)
        state, form = ng.GridFunction(self.space), self.bulk()
        right = self._work(loads)
        free = self.space.FreeDofs()
        inverse = form.mat.Inverse(free, "sparsecholesky")
        state.vec.data = inverse * right
        forces = (form.mat * state.vec - right).Evaluate()
        left, size = (np.linalg.norm(one.FV().NumPy()[np.array(free)]) for one in (forces, right))
        if not left <= UNSOLVED * size:  # also where it is NaN
            raise NotConverged(f"no factorisation of the bulk; {HELD}")
        return Fields3D(self, state.components, forces.FV().NumPy().copy())

    def _work(self, loads):
        """The linear form of dead loads, its vector."""
        v, chi = self.space.TestFunction()
        form = ng.LinearForm(self.space)
        more = {"bonus_intorder": self.order + GIVEN}
        form += (ng.CF(tuple(loads.force)) * v + ng.CF(tuple(loads.couple)) * chi) * ng.dx(**more)
        for test, given in ((v, loads.traction), (chi, loads.micromoment)):
            for pattern, values in given.items():
                form += ng.CF(tuple(values)) * test * ng.ds(definedon=self.boundary(pattern), **more)
        return form.Assemble().vec


class Reaction3D(NamedTuple):
    """What supports exert on a body: force (3,), and moment (3,) about the origin, of force and couple stress
    together.
    """

    force: np.ndarray
    moment: np.ndarray


class Fields3D(BodyFields):
    """The fields of a state: u, psi and what follows from them, as NGSolve functions.

    Parameters
    ----------
    body : Body3D
    components : grid functions of u and psi
    forces : array (unknowns of the body,)
        Internal forces less the loads: what supports exert in each unknown.

    Examples
    --------
    >>> from microblock.fem import meshes3d
    >>> from microblock.fem.body3d import Loads3D
    >>> x = np.linspace(0, 1, 3)
    >>> sides = {"u1": "left|right", "u2": "front|back", "u3": "bottom", "psi1": "bottom",
    ...          "psi2": "bottom", "psi3": "bottom"}
    >>> solid = mb.Cosserat(E=2.6, nu=0.3, ell=0.2, beta=1)
    >>> body = mb.Body3D(meshes3d.block(x, x, x - 1), solid, fixed=sides)
    >>> fields = body.solve(Loads3D(traction={"contact": (0, 0, -1)}))
    >>> round(float(fields.u[2](body.mesh(0.5, 0.5, 0.0))), 9)      # 1/(lambda + 2 mu)
    -0.285714286
    >>> force, moment = fields.reaction("bottom")
    >>> round(float(force[2]), 9)
    1.0
    """

    def __init__(self, body, components, forces):
        super().__init__(body, components, forces)
        self.u, self.psi = self

    @property
    def gamma(self):
        """Relative deformation (1), 3x3."""
        return energy3d.relative_deformation(self.u, self.psi)

    @property
    def stress(self):
        """Force stress (16), 3x3; on a boundary that of the element beside it."""
        return ng.BoundaryFromVolumeCF(energy3d.stress(self.body.solid, self.gamma))

    @property
    def couple_stress(self):
        """Couple stress (17), 3x3; on a boundary that of the element beside it."""
        return ng.BoundaryFromVolumeCF(energy3d.couple_stress(self.body.solid, ng.Grad(self.psi)))

    def energy(self):
        """Elastic energy of the whole body."""
        density = energy3d.energy(self.body.solid, self.gamma, ng.Grad(self.psi))
        return self.body.integrated(density)

    def reaction(self, boundary):
        """The Reaction3D of the supports on a boundary, from nodal forces: together they balance the loads.

        What an unknown exerts that lies on two supported boundaries is part of the reaction of each: name
        them together, "bottom|left", for their sum.

        Raises
        ------
        BadArgument
            For a boundary on which nothing is supported.
        """
        body, region = self.body, self.body.boundary(boundary)
        if not any(any(body.boundary(pattern).Mask() & region.Mask()) for pattern in body.fixed.values()):
            raise BadArgument("boundary", boundary, "is supported in no field")
        fixed = ~np.array(body.space.FreeDofs()) & np.array(body.space.GetDofs(region))
        exerted = np.where(fixed, self.forces, 0.0)
        work = np.array([exerted @ motion for motion in rigid_motions(body)])
        return Reaction3D(work[:3], work[3:])


def rigid_motions(body):
    """Coefficients of the six rigid motions of a body, translations and rotations (u = e x x, psi = e)."""
    place, found = ng.CF((ng.x, ng.y, ng.z)), []
    for number in range(6):
        axis = ng.CF(tuple(float(i == number % 3) for i in range(3)))
        motion = ng.GridFunction(body.space)
        motion.components[0].Set(ng.Cross(axis, place) if number > 2 else axis)
        if number > 2:
            motion.components[1].Set(axis)
        found.append(motion.vec.FV().NumPy().copy())
    return found
