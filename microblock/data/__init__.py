"""Records, CSV, VTK, studies over parameters."""
