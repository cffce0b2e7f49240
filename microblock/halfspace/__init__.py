"""The homogeneous half-space x3 < 0: surface response, cells on a plane, obstacles over x1 and x2."""
