"""A body condensed to its contact nodes for friction: displacements along the surface beside u.n and psi."""

import numpy as np
from scipy.sparse import vstack

from ..corners.follower import FrictionalContact
from ..errors import BadArgument
from .condensation import Condensed, with_psi_constrained
from .facets import FLAT
from .friction import slip_lever


class SlipNodes(Condensed):
    """Body condensed to the nodes of a flat contact boundary with u1 = u.t, t = e1, as a third field.

    Parameters
    ----------
    body, boundary
        As of `Condensed`.

    Attributes
    ----------
    response : array (3 n, 3 n), symmetric
        (u.n, psi, u1) at all nodes from (forces along n, moments, forces along x1), per thickness.

    Raises
    ------
    BadArgument
        If the contact boundary is curved or inclined, or for what `Condensed` does not take.

    Examples
    --------
    >>> from microblock.fem import meshes
    >>> mesh = meshes.uniform(meshes.Ground(far=2.0, reach=(-1.0, 1.0), half=False), 0.5)
    >>> body = mb.Body(mesh, mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1), order=2, fixed="bottom")
    >>> from microblock.fem.slip_nodes import SlipNodes
    >>> nodes = SlipNodes(body)
    >>> nodes.response.shape == (3*len(nodes.points), 3*len(nodes.points))
    True
    """

    def _onto(self):
        """As of `Condensed`, with rows of u1."""
        if np.abs(self.normals[:, 0]).max() > FLAT:
            raise BadArgument(
                "body",
                self.body,
                "must have a flat contact boundary along x1: on others Newton() follows friction",
            )
        return vstack((super()._onto(), self.at("u1")), format="csr")

    def _matrix(self):
        """The part of the response that `Compliance` has."""
        self.response, n = super()._matrix(), len(self.weights)
        return self.response[: 2 * n, : 2 * n]

    def fields(self, forces, moments, shear=None):
        """Fields under nodal forces along n, nodal moments and nodal forces along x1, arrays (n,)."""
        return super().fields(forces, moments, np.zeros_like(forces) if shear is None else shear)

    def slip(self, law):
        """Displacement of the corners along x1 from (u.n, psi, u1), array (n, 3 n)."""
        one = np.identity(len(self.weights))
        return np.hstack((0 * one, -slip_lever(law) * self.body.solid.ell * one, one))

    def corners(self, law):
        """Changes of the gaps, one corner after the other, from (u.n, psi, u1), array (corners n, 3 n)."""
        own = self.compliance.onto_corners(law)
        return np.hstack((own, np.zeros((len(own), len(self.weights)))))

    def loads(self, law, normal, tangential):
        """(Forces along n, moments, forces along x1), array (3 n,), of corner forces, array (corners, n), and
        of forces along the surface, array (n,).
        """
        return self.corners(law).T @ normal.ravel() + self.slip(law).T @ tangential

    def frictional(self, law, obstacle, coupled):
        """The FrictionalContact of the body under an obstacle."""
        corners, slip = self.corners(law), self.slip(law)
        _, gaps, _ = self.compliance.corner_system(law, obstacle)
        if not np.isfinite(gaps).any():
            raise BadArgument("obstacle", obstacle, "faces no node of the contact boundary")
        return FrictionalContact(
            corners @ self.response @ corners.T,
            slip @ self.response @ corners.T,
            slip @ self.response @ slip.T,
            gaps,
            law.friction,
            coupled,
        )


def slip_nodes(solver):
    """The body of a BodySolver as `SlipNodes`, made once and kept with the body; psi constrained if the law
    prescribes it.
    """
    body, clamped = solver.body, solver.law.clamps_rotation
    key = "slip nodes", body.contact, clamped
    return body.once(
        key, lambda: SlipNodes(with_psi_constrained(body, body.contact) if clamped else body, body.contact)
    )
