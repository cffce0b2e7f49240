"""Figures, pictures of blocks and fields, sliders: loaded when something is drawn."""
