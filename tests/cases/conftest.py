"""Command lines of cases, run in the process of the tests."""

import json
import shlex

import pytest

from cases.__main__ import main


@pytest.fixture
def run(capsys):
    """A function of a command line: (exit status, standard output, standard error)."""

    def status_and_output(words):
        try:
            status = main(shlex.split(words))
        except SystemExit as stop:  # argparse's own way out
            status = stop.code
        return status, *capsys.readouterr()

    return status_and_output


@pytest.fixture
def answer(run):
    """A function of a command line: its JSON object, beside which nothing is printed."""

    def json_object(words):
        status, out, err = run(f"{words} --json -")
        assert (status, err) == (0, "")
        return json.loads(out, parse_constant=lambda word: pytest.fail(f"{word} in the JSON"))

    return json_object
