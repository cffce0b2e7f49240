"""Contact states on any compliance: block pivoting and paths, projected gradients."""
