"""Sphinx reads the docstrings of all public names: `python -m sphinx -W --keep-going docs/reference out/reference`."""

import microblock

project = "microblock"
author = copyright = "the microblock founders"
release = version = microblock.__version__
extensions = ["sphinx.ext.autodoc", "sphinx.ext.napoleon"]
html_theme = "alabaster"
suppress_warnings = ["ref.python"]      # a word of a type, such as nodes, may be the name of several attributes
default_role = "code"              # single backquotes are code in our docstrings
autodoc_default_options = {"members": True}
autodoc_typehints = "none"
napoleon_use_ivar = True           # attributes of a dataclass are listed with its fields


def names(app, name, source):
    """The page that lists every public name, from the package itself."""
    if name == "index":
        kind = {one: "autofunction" if not isinstance(getattr(microblock, one), type) else "autoclass" for one in microblock.__all__}
        source[0] += "\n".join(f".. {kind[one]}:: microblock.{one}" for one in microblock.__all__)


def setup(app):
    app.connect("source-read", names)
