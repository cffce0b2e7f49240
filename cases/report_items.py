"""Items of the report: records that are kept while they hold, figures drawn from them, made here or by other processes."""

import json
import time
from concurrent.futures import FIRST_COMPLETED, wait
from dataclasses import dataclass
from pathlib import Path

import cloudpickle

from microblock import plots, provenance
from microblock.study import read_records, versions, write_json, write_records
from microblock.sweeps import processes

BEAT = 1.0      # seconds between two signs of life


@dataclass(frozen=True)
class File:
    """Records of an item, DIR/data/NAME.csv, and beside them what they depend on."""

    out: Path
    name: str
    depends_on: str

    @property
    def path(self):
        return self.out/"data"/f"{self.name}.csv"

    @property
    def figure(self):
        return self.out/"figures"/f"{self.name}.png"

    def kept(self):
        """What is known of records from an earlier run {seconds, machine, kept}; None if they do not hold."""
        try:
            told = json.loads(self.path.with_suffix(".json").read_text())
            holds = told["depends_on"] == self.depends_on and told["content"] == provenance.File(self.path).content
        except (OSError, ValueError, KeyError):      # none, torn, or not ours
            return None
        return {**told, "kept": True} if holds else None

    def write(self, rows, seconds):
        """Keep records that took so long; what is known of them."""
        write_records(self.path, rows)
        told = {"depends_on": self.depends_on, "content": provenance.File(self.path).content, "seconds": seconds,
                "machine": versions()["machine"]}
        write_json(self.path.with_suffix(".json"), told)
        return {**told, "kept": False}

    def draw(self, drawing):
        """Seconds that it takes to draw the figure from what is written."""
        start = time.perf_counter()
        plots.draw(drawing, read_records(self.path), self.figure.parent, self.name)
        return time.perf_counter() - start


@dataclass(frozen=True)
class Task:
    """An item for another process: its file, functions that compute and (or None) draw it, and whether kept records count."""

    file: File
    compute: object
    drawing: object
    anew: bool

    def run(self):
        """(what is known of the records, seconds of drawing)."""
        told = None if self.anew else self.file.kept()
        if told is None:
            start = time.perf_counter()
            rows = self.compute()
            told = self.file.write(rows, time.perf_counter() - start)
        return told, self.file.draw(self.drawing) if self.drawing else None


def together(tasks, workers, keep, tell):
    """Run tasks on so many processes, the first ones first; keep(name, outcome of `run`, or the exception) as they come.

    Every second tell(names that are being made). When interrupted, processes are stopped; what is on the disk by then is whole.
    """
    with processes(min(workers, len(tasks))) as pool:
        left = {pool.schedule(_run, (cloudpickle.dumps(task),)): task.file.name for task in tasks}
        while left:
            done, _ = wait(left, timeout=BEAT, return_when=FIRST_COMPLETED)
            for future in done:
                keep(left.pop(future), future.exception() or future.result())
            tell([name for future, name in left.items() if future.running()])


def _run(pickled):
    return cloudpickle.loads(pickled).run()
