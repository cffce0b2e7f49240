"""What a result depends on: a call as a digest, and the loaded modules, the user's by their files, installed
ones by the versions of their packages.
"""

import hashlib
import pickle
import sys
from functools import cache
from importlib import metadata, util
from io import BytesIO
from pathlib import Path

from ..errors import BadArgument


def digest(function, point):
    """Returns the digest (SHA-256) of a call. What modules define counts by its name (see `loaded`), what the
    script defines by the whole script.

    Raises BadArgument if a value does not pickle, or if it is defined in no file: a change would not be seen.
    """
    text = BytesIO()
    pickler = pickle.Pickler(text, protocol=4)
    pickler.fast = True  # an object that occurs twice is written like two equal ones
    try:
        pickler.dump((sys.version, function, point))
    except Exception as failure:  # pickles fail in many ways
        allowed = f"cannot be told from others, for it does not pickle ({failure})"
        raise BadArgument("value", (function, point), allowed) from failure
    script = str(_first("__main__")) if b"__main__" in text.getvalue() else ""
    if script == "None":
        words = "is defined in a notebook: records see changes of files, write it to a module"
        raise BadArgument("value", (function, point), words)
    return hashlib.sha256(text.getvalue() + script.encode()).hexdigest()


def loaded():
    """Returns {module: `made_of` it when first asked} of what is loaded beside Python and the script."""
    names = {name.partition(".")[0] for name in list(sys.modules)} - {"__main__", "__mp_main__"}
    return {name: _first(name) for name in sorted(names - sys.stdlib_module_names)}


def made_of(name):
    """Returns the versions of the packages that install a module, else a digest of its files, or None."""
    try:
        spec = util.find_spec(name)
        found = [*(spec.submodule_search_locations or [spec.origin])] if spec else []
    except ValueError:  # of a script, or of what was made in memory
        found = [getattr(sys.modules.get(name), "__file__", None)]
    places = [Path(place) for place in found if place]
    if any({"site-packages", "dist-packages"} & {*place.parts} for place in places):
        return [metadata.version(package) for package in _distributions().get(name, ())]
    files = [file for place in places for file in sorted(place.rglob("*.py")) or [place] if file.is_file()]
    contents = b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)
    return hashlib.sha256(contents).hexdigest() if files else None


_first = cache(made_of)


@cache
def _distributions():
    """{module: names of the installed packages that bring it}."""
    return metadata.packages_distributions()
