"""What a result depends on: a call as a digest, and the loaded modules, the user's by their files, installed
ones by the versions of their packages.
"""

import hashlib
import pickle
import sys
from collections.abc import Callable, Mapping
from functools import cache
from importlib import metadata, util
from io import BytesIO
from pathlib import Path
from typing import TypeAlias

from ..errors import BadArgument

Origin: TypeAlias = list[str] | str | None  # versions of packages, a digest, or of neither


def digest(function: Callable[..., object], point: Mapping[str, object]) -> str:
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
    call = text.getvalue()
    if b"__main__" in call:
        script = _first("__main__")
        if script is None:
            words = "is defined in a notebook: records see changes of files, write it to a module"
            raise BadArgument("value", (function, point), words)
        call += str(script).encode()
    return hashlib.sha256(call).hexdigest()


def loaded() -> dict[str, Origin]:
    """Returns {module: `made_of` it when first asked} of what is loaded beside Python and the script."""
    names = {name.partition(".")[0] for name in list(sys.modules)} - {"__main__", "__mp_main__"}
    return {name: _first(name) for name in sorted(names - sys.stdlib_module_names)}


def made_of(name: str) -> Origin:
    """Returns the versions of the packages that install a module, else a digest of its files, or None."""
    places = _places(name)
    if any({"site-packages", "dist-packages"} & {*place.parts} for place in places):
        return [metadata.version(package) for package in _distributions().get(name, ())]
    files = [file for place in places for file in sorted(place.rglob("*.py")) or [place] if file.is_file()]
    if not files:
        return None
    contents = b"".join(hashlib.sha256(file.read_bytes()).digest() for file in files)
    return hashlib.sha256(contents).hexdigest()


def _places(name: str) -> list[Path]:
    """Returns the folders or the file of a module, which one made in memory lacks."""
    places: list[str | None] = []
    try:
        spec = util.find_spec(name)
        if spec and spec.submodule_search_locations:
            places += spec.submodule_search_locations
        elif spec:
            places.append(spec.origin)
    except ValueError:  # of a script, or of what was made in memory
        places = [getattr(sys.modules.get(name), "__file__", None)]
    return [Path(place) for place in places if place]


_first = cache(made_of)


@cache
def _distributions() -> Mapping[str, list[str]]:
    """Returns {module: names of the installed packages that bring it}."""
    return metadata.packages_distributions()
