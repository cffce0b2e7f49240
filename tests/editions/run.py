"""Run a problem, the text on the standard input: numbers, processor seconds and peak memory as JSON."""

import json
import re
import sys
import time
from pathlib import Path

import microblock


def plain(values):
    """{name: number or text} of a dictionary of numbers, of numpy, or lists of them."""
    pairs = [(name, getattr(value, "tolist", lambda value=value: value)()) for name, value in values.items()]
    lists = [(name, value if isinstance(value, list) else [value]) for name, value in pairs]
    return {f"{n} {k}" if len(own) > 1 else n: one for n, own in lists for k, one in enumerate(own)}


scope, start = {"__name__": "problem"}, time.process_time()
try:
    exec(compile(sys.stdin.read(), "problem", "exec"), scope)
    if "solve" in scope:
        start = time.process_time()
        scope["numbers"] = scope["solve"]()
except Exception as error:
    scope["numbers"] = {"error": f"{type(error).__name__}: {error}".splitlines()[0]}
seconds = time.process_time() - start
peak = re.search(r"VmHWM:\s*(\d+)", Path("/proc/self/status").read_text())  # of this process alone
result = {"seconds": seconds, "MiB": int(peak[1]) / 1024, "library": microblock.__file__}
print(json.dumps(result | {"numbers": plain(scope["numbers"])}))
