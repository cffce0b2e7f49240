"""Items of the report: records that are kept while they are valid, figures drawn from them, made here or by
other processes.
"""

import json
import time
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from pathlib import Path

from microblock.data.provenance import content
from microblock.data.records import read_records, versions, write_json, write_records
from microblock.data.sweeps import carried, processes
from microblock.view import plots

BEAT = 1.0  # seconds between two signs of life


@dataclass(frozen=True)
class File:
    """Records of an item, DIR/data/NAME.csv, and beside them what they depend on.

    page : whether the item is a page of its own, DIR/NAME.html, without which the records do not count
    """

    out: Path
    name: str
    depends_on: str
    page: bool = False

    @property
    def path(self):
        return self.out / "data" / f"{self.name}.csv"

    @property
    def figure(self):
        return self.out / "figures" / f"{self.name}.png"

    def kept(self):
        """What is known of valid records from an earlier run, {seconds, machine, kept}; None without them."""
        try:
            known = json.loads(self.path.with_suffix(".json").read_text())
            valid = known["depends_on"] == self.depends_on and known["content"] == content(self.path)
            valid = valid and (not self.page or (self.out / f"{self.name}.html").exists())
        except (OSError, ValueError, KeyError):  # none, torn, or not ours
            return None
        return {**known, "kept": True} if valid else None

    def write(self, rows, seconds):
        """Keep records that took so long; what is known of them."""
        write_records(self.path, rows)
        known = {
            "depends_on": self.depends_on,
            "content": content(self.path),
            "seconds": seconds,
            "machine": versions()["machine"],
        }
        write_json(self.path.with_suffix(".json"), known)
        return {**known, "kept": False}

    def draw(self, drawing):
        """Seconds that it takes to draw the figure from what is written."""
        start = time.perf_counter()
        plots.draw(drawing, read_records(self.path), self.figure.parent, self.name)
        return time.perf_counter() - start


@dataclass(frozen=True)
class Task:
    """An item for another process: its file, functions that compute and (or None) draw it, and whether kept
    records count.
    """

    file: File
    compute: object
    drawing: object
    anew: bool

    def run(self):
        """(what is known of the records, seconds of drawing)."""
        known = None if self.anew else self.file.kept()
        if known is None:
            start = time.perf_counter()
            rows = self.compute()
            known = self.file.write(rows, time.perf_counter() - start)
        return known, self.file.draw(self.drawing) if self.drawing else None


def together(tasks, workers, keep, tell):
    """Run tasks on so many processes, the first ones first; keep(name, outcome of `run`, or the exception) as
    they come.

    Every second tell(names that are being made). When interrupted, processes are stopped; what is on the disk
    by then is whole.
    """
    with processes(min(workers, len(tasks))) as pool:
        left = {pool.schedule(carried(task.run)): task.file.name for task in tasks}
        while left:
            done, _ = wait(left, timeout=BEAT, return_when=FIRST_COMPLETED)
            for future in done:
                keep(left.pop(future), future.exception() or future.result())
            tell([name for future, name in left.items() if future.running()])
