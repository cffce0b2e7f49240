"""Sphinx reads the docstrings that index.rst lists: `python -m sphinx -W --keep-going docs/reference
out/reference`.
"""

import microblock

project = "microblock"
author = copyright = "the microblock founders"
release = version = microblock.__version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "alabaster"
# a word of a type, such as nodes, may be the name of several attributes
suppress_warnings = ["ref.python"]
default_role = "code"  # single backquotes are code in our docstrings
autodoc_default_options = {"members": True}
autodoc_typehints = "none"
napoleon_use_ivar = True  # attributes of a dataclass are listed with its fields
