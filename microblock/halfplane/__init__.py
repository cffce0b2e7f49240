"""The half-plane without a mesh: kernels, panels fitted to the zones, uniform cells, fields below."""
