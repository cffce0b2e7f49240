"""The documentation: `python -m sphinx -W --keep-going docs out/site`.

Everything that a page needs is put beside it: no page asks the network for anything.
"""

import hashlib
import logging
import os
import re
import shutil
import sys
from pathlib import Path

for library in ("OPENBLAS", "OMP"):  # before numpy: kernels and examples compute the same digits each time
    os.environ.setdefault(f"{library}_NUM_THREADS", "1")

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS / "_ext"), str(DOCS.parent)]  # the checkout comes before an installed copy
os.environ["TQDM_DISABLE"] = "1"  # no bars in the outputs of notebooks
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, (str(DOCS.parent), os.environ.get("PYTHONPATH"))))

import microblock  # noqa: E402

project = "microblock"
author = "the microblock developers"
copyright = author
release = version = microblock.__version__
extensions = [
    "sphinx.ext.autodoc",
    "numpydoc",
    "myst_nb",
    "sphinx_gallery.gen_gallery",
    "sphinx_copybutton",
    "mathml",  # beside this file, in _ext
    "pages",
]
# of the package index, of a journal, and downloads
exclude_patterns = ["description.md", "paper/*", "gallery/**/*.ipynb"]

html_theme = "furo"
html_title = f"microblock {release}"
html_static_path = ["_static"]
html_extra_path = ["../out/beside"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_copy_source = False
html_show_sourcelink = False
html_theme_options = {"navigation_with_keys": True}

myst_enable_extensions = ["dollarmath", "deflist"]
myst_heading_anchors = 3
default_role = "code"  # single backquotes are code in our docstrings

# notebooks run when the pages are built; their outputs are kept until a file of the program changes
FILES = sorted(path for part in ("microblock", "cases") for path in (DOCS.parent / part).rglob("*.py"))
DIGEST = hashlib.sha256(b"".join(path.read_bytes() for path in FILES)).hexdigest()[:16]
PROFILE = DOCS.parent / "out" / "ipython" / "profile_default"
PROFILE.mkdir(parents=True, exist_ok=True)
# each kernel warns that it is not encrypted; those of a build talk within this machine
(PROFILE / "ipython_kernel_config.py").write_text("get_config().IPKernelApp.log_level = 'ERROR'\n")
os.environ["IPYTHONDIR"] = str(PROFILE.parent)
logging.getLogger("traitlets").setLevel("WARNING")  # which notebook is executed is no news
nb_execution_mode = "cache"
nb_execution_cache_path = str(DOCS.parent / "out" / "notebooks" / DIGEST)
nb_execution_timeout = 300
nb_execution_raise_on_error = True
nb_merge_streams = True
nb_output_stderr = "remove-warn"

# the gallery: scripts of `cases` in groups; those of an earlier digest are drawn anew
SCRIPTS, MADE = DOCS.parent / "out" / "scripts", DOCS / "gallery"
for stale in (SCRIPTS, *([] if (MADE / DIGEST).exists() else [MADE])):
    shutil.rmtree(stale, ignore_errors=True)
(MADE / DIGEST).mkdir(parents=True, exist_ok=True)
for folder, heading in {
    "": "Gallery\n=======\n\nScripts that import ``cases`` run in the root of the checkout, for example "
    "``python -m cases.sphere``. The others run wherever microblock is installed.",
    "plane": "In the plane\n------------\n\nHalf-planes, blocks, and meshes in the plane.",
    "space": "In space\n--------\n\nHalf-spaces, and meshes in space.",
    "the_paper": "The figures of the paper\n------------------------\n\nDrawn anew, by other methods.",
}.items():
    (SCRIPTS / folder).mkdir(parents=True, exist_ok=True)
    (SCRIPTS / folder / "GALLERY_HEADER.rst").write_text(f"{heading}\n")
for path in FILES:
    text = path.read_text()
    if path.parent.name in ("cases", "paper") and "    plt.show()" in text:
        plane = "space" if re.search("HalfSpace|meshes3d", text) else "plane"
        if re.search(r"^(from|import) cases\b", text, re.M):  # who downloads it has to know
            module = ".".join(path.relative_to(DOCS.parent).with_suffix("").parts)
            text = text.replace(
                '\n"""', f'\n:Runs:      in the root of the checkout, ``python -m {module}``\n"""', 1
            )
        (SCRIPTS / {"paper": "the_paper"}.get(path.parent.name, plane) / path.name).write_text(text)
# README links to it
shutil.copytree(
    SCRIPTS.parents[1] / "cases/playground",
    SCRIPTS.with_name("beside") / "cases/playground",
    dirs_exist_ok=True,
)
sphinx_gallery_conf = {
    "examples_dirs": str(SCRIPTS),
    "gallery_dirs": "gallery",
    "backreferences_dir": "gallery/uses",
    "filename_pattern": "",
    "reset_modules": ("matplotlib", "pages.style"),
    "download_all_examples": False,
    "write_computation_times": False,
    "show_signature": False,
}

# a word of a type, such as nodes, may be the name of several attributes
suppress_warnings = ["ref.python"]
autodoc_default_options = {
    "members": True,
    "inherited-members": "BaseException, Exception, ValueError, RuntimeError, ImportError",
}
autodoc_typehints = "none"
numpydoc_show_class_members = False  # autodoc lists them


def setup(app):
    """Keep what is no page beside the pages, so that their folder is what is published, and nothing else."""
    if app.doctreedir == app.outdir / ".doctrees":
        app.doctreedir = app.outdir.with_name("doctrees")
