"""Two editions of the library run the same problems in turns: numbers, seconds and peak memory, side by side.

    python -m tests.editions COMMIT [COMMIT] --problem FILE|NAME[:SIZE] ... [--rounds N] [--at DIR]

An edition is a commit of the repository's own history, or "." for this checkout as it stands, which is the
second one unless one is named. Its files are a worktree below DIR (usually microblock/editions in the user's
cache) and are used again, with the packages of this Python.

A problem is a file of Python that uses public names and leaves a dictionary `numbers`, or has a function
`solve()` that returns one; then `solve` alone is timed. NAME is one of `tests.editions.problems`. Every run
is a process of its own with one thread; seconds are the processor's. An error is a number, too: its type and
its first line.
"""
