"""Solids, obstacles, laws and methods that many tests take."""

import microblock as mb

SOLID = mb.Cosserat(E=100, nu=0.3, beta=1, ell=0.1)
ELASTIC = mb.Elastic(E=100, nu=0.3)
CYLINDER = mb.Cylinder(R=10)
SPHERE = mb.Sphere(R=10)
BLOCKS = mb.Microblock()
UNILATERAL = mb.Unilateral()
CLAMPED = mb.Microclamped()
NEWTON = mb.Newton()
