"""microblock: contact of bodies with microstructure, on NGSolve.

The names below are what a script needs; those that live on a mesh load NGSolve when first used.
"""

from __future__ import annotations

from importlib import import_module

__version__ = "0.3.0"

_HOME = {
    "Contact": "contact",
    "State": "model.state",
    "LoadPath": "model.events",
    "Event": "model.events",
    "History": "model.history",
    "Cosserat": "model.material",
    "Elastic": "model.material",
    "hertz_scales": "model.material",
    "HalfPlane": "halfplane.kernels",
    "HalfSpace": "halfspace.half_space",
    "Block": "model.bodies",
    "Body": "fem.body",
    "Plane": "model.obstacles",
    "Cylinder": "model.obstacles",
    "Wedge": "model.obstacles",
    "Punch": "model.obstacles",
    "Wave": "model.obstacles",
    "Rough": "model.obstacles",
    "Obstacle": "model.obstacles",
    "Deformable": "model.deformable",
    "Sphere": "model.surfaces",
    "Ellipsoid": "model.surfaces",
    "Cone": "model.surfaces",
    "FlatPunch": "model.surfaces",
    "RoughSurface": "model.surfaces",
    "Microblock": "model.law",
    "Unilateral": "model.law",
    "Microclamped": "model.law",
    "Panels": "model.methods",
    "Cells": "model.methods",
    "Fitted": "model.methods",
    "Uniform": "model.methods",
    "Condensed": "model.methods",
    "Newton": "model.methods",
    "sweep": "data.sweeps",
    "load": "model.archive",
    "to_csv": "data.export",
    "to_vtk": "data.export",
    "explore": "view.widgets",
    "MicroblockError": "errors",
    "BadArgument": "errors",
    "NotConverged": "errors",
    "MissingExtra": "errors",
}

_RENAMED = {
    "Body3D": "is mb.Body now, of order 2 where none is named: mb.Body(mesh, solid, order=1)",
    "HistoryEvent": "is mb.Event now: its normal is load, its error load_error, a force",
}

__all__ = sorted(_HOME)


def __getattr__(name: str) -> object:
    if name in _HOME:
        return getattr(import_module(f".{_HOME[name]}", __name__), name)
    if name in _RENAMED:
        from .errors import BadArgument

        raise BadArgument("name", name, _RENAMED[name])
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    return sorted({*__all__, *(name for name in globals() if name.startswith("__"))})
