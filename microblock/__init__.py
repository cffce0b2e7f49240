"""microblock: contact of bodies with microstructure, on NGSolve.

The names below are what a script needs; those that live on a mesh load NGSolve when first used.
"""

from importlib import import_module

__version__ = "0.1.0"

_ROOMS = {
    "Cosserat": "material",
    "Plane": "obstacles", "Cylinder": "obstacles", "Wedge": "obstacles", "Punch": "obstacles",
    "Profile": "obstacles", "Shape": "obstacles", "Wave": "obstacles", "Rough": "obstacles",
    "Microblock": "law", "Unilateral": "law", "Microclamped": "law",
    "HalfPlane": "halfplane", "Compliance": "compliance", "Contact": "scene",
    "PeriodicHalfPlane": "grid", "GridContact": "grid_contact",
    "Body": "body", "Loads": "body", "Fields": "body",
    "Condensed": "condensation", "Ground": "meshes",
    "BodyContact": "body_contact", "BodyState": "body_state",
    "FittedContact": "fitted", "UniformContact": "uniform", "SurfaceState": "surface_state",
    "Explorer": "explorer", "Choice": "explorer",
    "ContactFacets": "facets",
    "Newton": "newton", "State": "newton", "Event": "newton_path", "load_path": "newton_path",
    "sweep": "sweeps", "to_csv": "export", "to_vtk": "export",
    "MicroblockError": "errors", "BadArgument": "errors", "Inadmissible": "errors", "NotConverged": "errors",
    "MissingExtra": "errors",
}

__all__ = sorted(_ROOMS)


def __getattr__(name):
    if name in _ROOMS:
        return getattr(import_module(f".{_ROOMS[name]}", __name__), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__():
    return sorted([*globals(), *__all__])
