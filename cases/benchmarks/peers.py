"""Unilateral contact on one mesh, by the program and by NGSolve's ContactBoundary.

A penalty needs a stiffness and a rule that suit the mesh; contact conditions at nodes need neither.

:Geometry:  a cylinder on half of a block and a sphere on a quarter, parabolas of R = 1000, contact radius 1
:Equations: plane strain or space, E* = 1, nu = 0.3; the approach is given
:Method:    the same squares or cubes for both: `Condensed` and `Newton`; ContactBoundary with the energy
            k/2 <penetration>^2 beside a rigid body whose facets are a quarter as long, by Newton's method
:Reference: plane: an rtol of 1e-4. Space: facets of 0.15, of order 2
:Units:     relative errors of load, largest pressure and contact area; processor seconds of one thread

ContactBoundary is tuned in its favour: of all stiffnesses and rules the table has the run whose largest error
is the least, as only someone who has the answer knows. Its pressure is k times the penetration. GetFEM is not
here: the package index has no wheel of it. It follows the surface as it moves: strains of a thousandth keep
that below the errors.
"""

import argparse
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from time import process_time as clock

import netgen.meshing as netgen
import ngsolve as ng
import numpy as np
import pandas as pd
from ngsolve.meshes import MakeStructured2DMesh, MakeStructured3DMesh

import microblock as mb
from microblock.fem import meshes, meshes3d

from .verification import bodies_in_space

RECORD = Path(__file__).parent / "results" / "peers.csv"
R, NU, FAR, REACH = 1000.0, 0.3, 6.0, 1.5
SOLID = mb.Elastic(E=1 - NU**2, nu=NU)
# k over E*/(length of a facet), and orders of the rule, in the plane and in space, where a run takes seconds
STIFFNESS = {2: (1.0, 3.0, 10.0, 30.0, 100.0, 1000.0), 3: (10.0, 100.0)}
RULES = {2: (2, 4, 8), 3: (2, 8)}
NEAR = 0.05  # of facets that the search looks at
STEPS = 40  # of Newton at most
SOLVED = 1e-9  # of the residual over that of the first step


@dataclass(frozen=True)
class Scene:
    """A block pressed by a parabola, in the plane (dim 2) or in space, with facets of a length."""

    dim: int
    order: int
    h: float

    @cached_property
    def mesh(self):
        if self.dim == 2:
            return meshes.uniform(meshes.Ground(far=FAR, reach=(0.0, REACH)), self.h)
        return bodies_in_space.quarter(self.h, FAR, REACH)

    @property
    def fixed(self):
        if self.dim == 2:
            return {"u1": "axis|bottom", "u2": "bottom"}
        return meshes3d.supports("bottom", x1="left", x2="front")

    @property
    def approach(self):
        """That of a contact radius of about 1: of a plane block the logarithm of its depth counts."""
        return 1.2e-3 if self.dim == 2 else 8.5e-4

    @property
    def obstacle(self):
        return mb.Cylinder(R) if self.dim == 2 else mb.Sphere(R)

    def problem(self, mesh, order, method=None):
        body = mb.Body(mesh, SOLID, order, fixed=self.fixed)
        return mb.Contact(body, self.obstacle, mb.Unilateral(), method)

    def own(self, method):
        """(load, peak, area, steps) by the program."""
        state = self.problem(self.mesh, self.order, method).solve(approach=self.approach)
        return state.load, state.pressure.max(), state.contact_area, state.iterations

    def reference(self):
        """The same of a far finer mesh."""
        if self.dim == 2:
            state = self.problem(self.mesh, 4).solve(approach=self.approach, rtol=1e-4)
        else:
            x = meshes3d.graded(reach=REACH, step=0.15, far=FAR, growth=2.0)
            down = meshes3d.graded(reach=0.3, step=0.15, far=FAR, growth=2.0)
            mesh = meshes3d.block(x, x, -down[::-1], reach=REACH)
            state = self.problem(mesh, 2).solve(approach=self.approach)
        return state.load, state.pressure.max(), state.contact_area

    @property
    def indenter(self):
        """A layer of facets, a quarter as long as those of the block, on the parabola."""
        count = int(np.ceil(4 * REACH / self.h))
        if self.dim == 2:
            return MakeStructured2DMesh(
                nx=count, ny=1, mapping=lambda x, y: (REACH * x, (REACH * x) ** 2 / (2 * R) + 0.2 * y)
            )
        return MakeStructured3DMesh(
            nx=count,
            ny=count,
            nz=1,
            mapping=lambda x, y, z: (REACH * x, REACH * y, REACH**2 * (x * x + y * y) / (2 * R) + 0.2 * z),
        )


def joined(block, indenter):
    """One mesh of two; the names of the second's boundaries begin with "rigid"."""
    dim = block.dim
    solid, facet_of = {2: (netgen.Element2D, element_1d), 3: (netgen.Element3D, netgen.Element2D)}[dim]
    mesh = netgen.Mesh(dim=dim)
    for part, prefix in ((block, ""), (indenter, "rigid ")):
        places = (netgen.Pnt(*vertex.point, *[0.0] * (3 - dim)) for vertex in part.vertices)
        points = [mesh.Add(netgen.MeshPoint(place)) for place in places]
        region = mesh.AddRegion(prefix + "body", dim=dim)
        names = part.GetBoundaries()
        numbers = [mesh.AddRegion(prefix + name, dim=dim - 1) for name in names]
        for element in part.Elements(ng.VOL):
            mesh.Add(solid(region, [points[vertex.nr] for vertex in element.vertices]))
        for facet in part.Elements(ng.BND):
            mesh.Add(facet_of(numbers[facet.index], [points[vertex.nr] for vertex in facet.vertices]))
    return ng.Mesh(mesh)


def element_1d(region, points):
    return netgen.Element1D(points, index=region)


def contact_boundary(scene, stiffness, rule):
    """(load, peak, area, steps) by NGSolve's ContactBoundary, and None where Newton's method does not end."""
    mesh = joined(scene.mesh, scene.indenter)
    fields = mesh.dim
    fixed = [scene.fixed[f"u{i + 1}"] + "|rigid.*" for i in range(fields)]
    dirichlet = dict(zip(("dirichletx", "dirichlety", "dirichletz"), fixed))
    space = ng.VectorH1(mesh, order=scene.order, **dirichlet)
    u = space.TrialFunction()
    contact = ng.ContactBoundary(mesh.Boundaries("contact"), mesh.Boundaries("rigid bottom"))
    k = stiffness / scene.h
    place = ng.CF((ng.x, ng.y, ng.z)[:fields])
    deep = (u + place - u.Other() - place.Other()) * ng.specialcf.normal(fields)
    contact.AddEnergy(ng.IfPos(deep, k / 2 * deep**2, 0))
    form = ng.BilinearForm(space)
    strain = ng.Sym(ng.Grad(u))
    energy = SOLID.mu * ng.InnerProduct(strain, strain) + SOLID.lam / 2 * ng.Trace(strain) ** 2
    form += ng.Variation(energy * ng.dx("body"))
    state = ng.GridFunction(space)
    down = ng.CF((0,) * (fields - 1) + (-scene.approach,))
    state.Set(down, definedon=mesh.Boundaries("rigid.*"))
    residual = state.vec.CreateVector()
    free = space.FreeDofs()
    first = None
    for step in range(1, STEPS + 1):
        contact.Update(state, form, rule, NEAR)
        form.Apply(state.vec, residual)
        size = np.linalg.norm(residual.FV().NumPy()[np.array(free)])
        first = first or size
        if step > 2 and size < SOLVED * first:
            break
        form.AssembleLinearization(state.vec)
        state.vec.data -= form.mat.Inverse(free, "sparsecholesky") * residual
    else:
        return None
    contact.Update(state, form, rule, NEAR)
    form.Apply(state.vec, residual)
    along = ng.GridFunction(space)
    along.Set(ng.CF((0,) * (fields - 1) + (1,)), definedon=mesh.Boundaries("rigid.*"))
    load = abs(ng.InnerProduct(along.vec, residual))
    region = mesh.Boundaries("contact")
    penetration = -contact.gap * ng.specialcf.normal(fields)
    kind = ng.SEGM if mesh.dim == 2 else ng.QUAD
    points = ng.IntegrationRule(kind, rule)
    values = penetration(mesh.MapToAllElements(points, region))
    area = ng.Integrate(ng.IfPos(penetration, 1, 0) * ng.ds("contact", intrules={kind: points}), mesh)
    return load, k * max(values.max(), 0), area, step


def measured(function):
    """The values of a function, and its seconds."""
    start = clock()
    values = function()
    return values, clock() - start


def rows(scenes=((2, 1, 0.15), (2, 2, 0.15), (3, 1, 0.25), (3, 2, 0.375))):
    """Yields the rows of the record."""
    exact = {}
    for scene in (Scene(*values) for values in scenes):
        if scene.dim not in exact:
            exact[scene.dim] = scene.reference()
        for name, method in (("Condensed", mb.Condensed()), ("Newton", mb.Newton())):
            yield row(scene, name, exact[scene.dim], *measured(partial(scene.own, method)))
        for stiffness in STIFFNESS[scene.dim]:
            for rule in RULES[scene.dim]:
                values, seconds = measured(partial(contact_boundary, scene, stiffness, rule))
                yield row(scene, "ContactBoundary", exact[scene.dim], values, seconds, stiffness, rule)


def row(scene, program, exact, values, seconds, stiffness=None, rule=None):
    """A row of the record; errors are None where there is no answer."""
    *figures, steps = values or (None,) * 4
    errors = [figure and abs(figure / true - 1) for figure, true in zip(figures, exact)]
    names = ("load_error", "peak_error", "area_error")
    return {
        "dim": scene.dim,
        "order": scene.order,
        "h": scene.h,
        "program": program,
        "stiffness": stiffness,
        "rule": rule,
        **dict(zip(names, errors)),
        "seconds": seconds,
        "steps": steps,
        "ngsolve": ng.__version__,
    }


def best(runs):
    """Of each program and scene the run whose largest error is the least."""
    errors = ["load_error", "peak_error", "area_error"]
    runs = runs.dropna(subset=errors)
    runs = runs.iloc[np.argsort(runs[errors].max(axis=1), kind="stable")]
    return runs.groupby(["dim", "order", "program"], sort=True).first().reset_index()


def table(runs):
    """{mesh and program: texts of errors, seconds and steps} of the best runs."""
    rows = {}
    for run in best(runs).itertuples():
        where = {2: "squares", 3: "cubes"}[run.dim]
        errors = (run.load_error, run.peak_error, run.area_error)
        cells = [f"{value:.1e}" for value in errors] + [f"{run.seconds:.2g}", str(int(run.steps))]
        rows[f"{where} of order {run.order}, `{run.program}`"] = cells
    return rows


def main(words=None):
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.parse_args(words)
    runs = pd.DataFrame(rows())
    runs.to_csv(RECORD, index=False, float_format="%.4g")
    print(best(runs).to_string())


if __name__ == "__main__":
    main()
