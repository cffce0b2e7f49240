"""All that needs NGSolve: bodies on meshes, contact facets, Newton, condensation, fitted meshes."""
