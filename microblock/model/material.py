"""The Cosserat solid: moduli and admissibility, (10)-(13); `fem.contact_term` has energy and stresses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, ClassVar, NamedTuple, Protocol, runtime_checkable

from ..errors import (
    BadArgument,
    Inadmissible,
    plain,
    require,
    require_finite,
    require_flag,
    require_kind,
    require_positive,
)

NO_LENGTH = 1.0  # ell of a classical solid that no contact has given one
UNCOUPLED = 1e-20  # coupling number beta of a classical solid: the least that half-planes take is 1e-24


@runtime_checkable
class Varying(Protocol):
    """A function of the place, as NGSolve's CoefficientFunction is."""

    is_complex: bool

    def Compile(self) -> Any:
        """Returns the same function, compiled."""

    def Diff(self, variable: Any) -> Any:
        """Returns the derivative with respect to a variable."""


class Moduli(NamedTuple):
    """What stress and couple stress take of a solid: numbers, or functions on a mesh."""

    lam: Any
    mu: Any
    mu_c: Any
    ell: Any
    curvature: Any
    alpha_prime: Any
    beta_prime: Any


@dataclass(frozen=True)
class Cosserat:
    """Linear isotropic Cosserat solid in plane strain.

    Its moduli and ell are numbers; of the solid of a `Body` they may be functions of the place, NGSolve's
    CoefficientFunctions, which the body checks in its elements.

    Parameters
    ----------
    E, nu : float
        Young's modulus (stress) and Poisson's ratio.
    ell : float
        Length scale of the material, and side of a microblock (length).
    beta, eta, mu_c : float
        The coupling, of which exactly one is given: ``beta = 2 eta/(1 + eta)`` from 0 to 2 (excluded),
        ``eta = mu_c/mu`` or the modulus ``mu_c`` (stress). With 0 the microrotation is independent;
        ``beta -> 2`` is the couple-stress limit.
    curvature : float
        ``gamma'`` of (12), ``m = gamma' ell^2 mu grad psi``. The printed (18) has 1, but the paper's closed
        form needs 2 (docs/differences.md, "Curvature coefficient").
    alpha_prime, beta_prime : float
        ``alpha'`` and ``beta'`` of (12), which act in three dimensions alone.

    Raises
    ------
    Inadmissible
        If the moduli violate (13).
    BadArgument
        If a value is not a finite number, or not exactly one of beta, eta, mu_c is given.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.085, beta=1)
    >>> round(solid.mu, 3), round(solid.mu_c, 3), solid.curvature
    (38.462, 38.462, 2.0)
    """

    E: float
    nu: float
    ell: float
    eta: float
    curvature: float
    alpha_prime: float = 0.0
    beta_prime: float = 0.0
    _arguments: ClassVar[Mapping[str, Any]] = {}  # of a solid with functions, as they were given

    def __init__(
        self,
        E: float | Varying,
        nu: float | Varying,
        ell: float | Varying,
        *,
        beta: float | Varying | None = None,
        eta: float | Varying | None = None,
        mu_c: float | Varying | None = None,
        curvature: float | Varying = 2.0,
        alpha_prime: float | Varying = 0.0,
        beta_prime: float | Varying = 0.0,
    ) -> None:
        moduli: dict[str, Any] = {
            "E": E,
            "nu": nu,
            "ell": ell,
            "curvature": curvature,
            "alpha_prime": alpha_prime,
            "beta_prime": beta_prime,
        }
        require_finite(**_numbers(moduli))
        coupling = {"beta": beta, "eta": eta, "mu_c": mu_c}
        arguments = moduli | {name: value for name, value in coupling.items() if value is not None}
        if len(_numbers(arguments)) == len(arguments):
            self._require_admissible(**moduli)
        else:
            object.__setattr__(self, "_arguments", arguments)
        moduli["eta"] = _coupling_ratio(moduli["E"] / (2 * (1 + moduli["nu"])), coupling)
        for name, value in moduli.items():
            object.__setattr__(self, name, value if _varies(value) else float(value))

    @staticmethod
    def _require_admissible(
        E: float, nu: float, ell: float, curvature: float, alpha_prime: float, beta_prime: float
    ) -> None:
        """Raises Inadmissible or BadArgument unless numbers satisfy (13), but for the coupling."""
        bulk = alpha_prime + beta_prime + curvature
        for admissible, name, value, words in (
            (-1 < nu < 0.5, "nu", nu, "must satisfy -1 < nu < 1/2"),  # before E, which may depend on nu
            (E > 0, "E", E, "must be positive"),
            (curvature > 0, "curvature", curvature, "gamma' must be positive, (13)"),
            (bulk > 0, "alpha_prime", alpha_prime, "alpha' + beta' + gamma' must be positive, (13)"),
        ):
            if not admissible:
                raise Inadmissible(name, value, words)
        require_positive(E=E, ell=ell, curvature=curvature)  # sizes that can be computed with

    @classmethod
    def of_blocks(cls, side: float, stiffness: float, *, couples: bool = False) -> Cosserat:
        """Returns the solid whose long waves are those of rigid square blocks with elastic interfaces, in
        rows and columns (docs/theory/lattice.md).

        Parameters
        ----------
        side : float
            Side of a block (length).
        stiffness : float
            Stiffness of the interfaces against opening and against slip (stress per length).
        couples : bool
            Whether gamma' is that of blocks in full contact, 5/12 + sqrt(3)/6, in place of 1/6, that of waves
            of rotation along a row: under a cylinder couples differ from those of the blocks by 10 or 71 %.

        Raises
        ------
        BadArgument
            If side or stiffness is not positive.

        Examples
        --------
        >>> solid = mb.Cosserat.of_blocks(side=0.1, stiffness=1000.0)
        >>> solid.E, solid.nu, solid.beta, round(solid.curvature, 4)
        (100.0, 0.0, 1.0, 0.1667)
        """
        require_positive(side=side, stiffness=stiffness)
        require_flag(couples=couples)
        curvature = 1 / 6
        if couples:
            curvature = 5 / 12 + 3**0.5 / 6
        return cls(E=stiffness * side, nu=0.0, ell=side, beta=1.0, curvature=curvature)

    def __repr__(self) -> str:
        """The arguments; near beta = 2, which is excluded, eta."""
        if self.functions:
            words = ", ".join(f"{name}={_word(value)}" for name, value in self._arguments.items())
            return f"Cosserat({words})"
        coupling = f"beta={self.beta:.6g}"
        if self.beta > 1.99:
            coupling = f"eta={self.eta:.6g}"
        words = f"E={self.E}, nu={self.nu}, ell={self.ell}, {coupling}, curvature={self.curvature:.6g}"
        in_space = {"alpha_prime": self.alpha_prime, "beta_prime": self.beta_prime}
        words += "".join(f", {name}={value}" for name, value in in_space.items() if value)
        return f"Cosserat({words})"

    @property
    def functions(self) -> dict[str, Varying]:
        """Arguments that are functions of the place, by their names."""
        return {name: value for name, value in self._arguments.items() if _varies(value)}

    def at(self, **values: float) -> Cosserat:
        """Returns the solid with numbers in place of its `functions`."""
        return Cosserat(**dict(self._arguments) | values)

    @property
    def has_length(self) -> bool:
        """Whether ell is a length of the problem: of the material, or of a contact that has given it one."""
        return True

    def with_length(self, length: float) -> Cosserat:
        """Returns the solid with another ell (length)."""
        return replace(self, ell=length)

    def scaled(self, **factors: float) -> Cosserat:
        """Returns the solid with moduli times positive factors: with beta the ratio mu_c/mu and with nu
        1/(1/2 - nu), which has nu in its range but for -1.
        """
        moduli = {name: factor * getattr(self, name) for name, factor in factors.items()}
        if "beta" in moduli:
            del moduli["beta"]
            moduli["eta"] = factors["beta"] * self.eta
        if "nu" in moduli:
            moduli["nu"] = 0.5 - (0.5 - self.nu) / factors["nu"]
        return replace(self, **moduli)

    @property
    def mu(self) -> float:
        """Shear modulus (stress)."""
        return self.E / (2 * (1 + self.nu))

    @property
    def lam(self) -> float:
        """Lame's first constant (stress)."""
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))

    @property
    def beta(self) -> float:
        """Coupling number 2 eta/(1 + eta), 0 <= beta < 2."""
        return 2 * self.eta / (1 + self.eta)

    @property
    def mu_c(self) -> float:
        """Coupling modulus (stress)."""
        return self.eta * self.mu

    @property
    def E_star(self) -> float:
        """Plane-strain contact modulus E/(1 - nu^2), (50) (stress)."""
        return self.E / (1 - self.nu**2)

    @property
    def is_classical(self) -> bool:
        """Whether displacements and microrotation do not act on each other, but for rounding."""
        return isinstance(self.eta, float) and self.beta <= UNCOUPLED

    @property
    def layer_length(self) -> float:
        """Decay length of the boundary layer, ell sqrt(gamma'/(2 beta)) (length); inf for beta = 0."""
        if self.beta == 0:
            return math.inf
        return self.ell * math.sqrt(self.curvature / (2 * self.beta))


class Elastic(Cosserat):
    """The classical elastic solid in plane strain, under `Unilateral`: a `Cosserat` solid whose coupling is
    rounding beside its moduli. On a mesh it has no microrotation: none to support, and none to solve for; psi
    and micromoment of its states are 0.

    It has no length: as ell a problem gives it the length of its contact (`microblock.model.scales`), and two
    that differ by ell alone are equal.

    Parameters
    ----------
    E, nu : float
        Young's modulus (stress) and Poisson's ratio.

    Raises
    ------
    Inadmissible
        If the moduli violate (13).

    Examples
    --------
    >>> ground = mb.HalfPlane(mb.Elastic(E=100, nu=0.3))
    >>> state = mb.Contact(ground, mb.Cylinder(R=10), mb.Unilateral()).solve(load=1.0, rtol=1e-6)
    >>> round(state.half_width / mb.hertz_scales(ground.solid, R=10, P=1.0)[0], 6)
    1.0
    """

    def __init__(self, E: float | Varying, nu: float | Varying, *, ell: float = NO_LENGTH) -> None:
        super().__init__(E, nu, ell=ell, beta=UNCOUPLED)

    def at(self, **values: float) -> Elastic:
        return Elastic(**{name: values.get(name, self._arguments[name]) for name in ("E", "nu", "ell")})

    @property
    def has_length(self) -> bool:
        return self.ell != NO_LENGTH

    def scaled(self, **factors: float) -> Elastic:
        for name in factors:
            words = "belongs to a Cosserat solid: an Elastic one has none"
            require(name in ("E", "nu"), name, None, words)
        moduli = Cosserat(self.E, self.nu, self.ell, beta=0).scaled(**factors)
        return Elastic(moduli.E, moduli.nu, ell=self.ell)

    def with_length(self, length: float) -> Elastic:
        return Elastic(self.E, self.nu, ell=length)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Elastic) and (self.E, self.nu) == (other.E, other.nu)

    def __hash__(self) -> int:
        return hash((Elastic, self.E, self.nu))

    def __repr__(self) -> str:
        return f"Elastic(E={_word(self.E)}, nu={_word(self.nu)})"


def _varies(value: Any) -> bool:
    """Returns whether a modulus is a function of the place."""
    return not isinstance(value, (int, float)) and isinstance(value, Varying)  # a Protocol: slow to ask


def _word(value: Any) -> str:
    """Returns a number, or that it is a function, for a representation."""
    return "function" if _varies(value) else str(value)


def _numbers(arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Returns those of arguments that are no functions."""
    return {name: value for name, value in arguments.items() if not _varies(value)}


def require_number_solid(**arguments: Any) -> None:
    """Raises BadArgument unless these are Cosserat solids whose moduli are numbers."""
    require_kind(Cosserat, "a Cosserat", **arguments)
    for solid in arguments.values():
        for name, function in solid.functions.items():
            words = "must be a number: a function of the place is for the solid of a Body on a mesh"
            raise BadArgument(name, function, words)


def _coupling_ratio(mu: Any, coupling: Mapping[str, Any]) -> Any:
    """Returns eta from the one measure that is given, with its digits for beta near 0 and 2."""
    named = {name: value for name, value in coupling.items() if value is not None}
    require(len(named) == 1, "coupling", named, "give exactly one of beta, eta, mu_c")
    require_finite(**_numbers(named))
    ((name, value),) = named.items()
    is_number = not _varies(value)
    if is_number and value < 0:
        raise Inadmissible(name, value, "the coupling must not be negative")
    if is_number and name == "beta" and not value < 2:
        raise Inadmissible(name, value, "must satisfy 0 <= beta < 2 (2 is the couple-stress limit)")
    if name == "beta":
        return value / (2 - value)
    if name == "mu_c":
        return value / mu
    return value


def joint_modulus(first: Cosserat, second: Cosserat | None) -> float:
    """Returns the contact modulus E* of two bodies (stress): 1/E* is the sum of theirs."""
    if second is None:
        return first.E_star
    return 1 / (1 / first.E_star + 1 / second.E_star)


def hertz_scales(solid: Cosserat, R: float, P: float) -> tuple[float, float]:
    """Returns half-width and largest pressure of Hertz' contact with a rigid cylinder, (50).

    Parameters
    ----------
    solid : Cosserat
        The half-plane's solid, of which E* counts.
    R : float
        Radius of the cylinder (length).
    P : float
        Force per thickness.

    Returns
    -------
    a_Hz : float
        ``sqrt(4 P R/(pi E*))`` (length).
    p_Hz : float
        ``2 P/(pi a_Hz)`` (stress).

    Raises
    ------
    BadArgument
        If the solid is no Cosserat, or R or P is not positive.

    Examples
    --------
    >>> solid = mb.Cosserat(E=100, nu=0.3, ell=0.1, beta=1)
    >>> a_Hz, p_Hz = mb.hertz_scales(solid, R=10.0, P=1.0)
    >>> round(a_Hz, 4), round(p_Hz, 4), round(solid.ell / a_Hz, 2)
    (0.3404, 1.8703, 0.29)
    """
    require_number_solid(solid=solid)
    R = plain(R)
    P = plain(P)
    require_positive(R=R, P=P)
    a_Hz = math.sqrt(4 * P * R / (math.pi * solid.E_star))
    return a_Hz, 2 * P / (math.pi * a_Hz)
