"""Which problems of a room are computed, all or a share, and which rows are left out with the others."""

from tests.choice import part


def traits_of(problem):
    """What a problem of plain data shows: its method with its law, its obstacle, and each of its options."""
    law, angles = problem["law"]
    obstacle = problem["obstacle"]
    method = problem.get("solver", problem["method"])
    traits = {f"{method} {law}", *angles, obstacle if isinstance(obstacle, str) else obstacle[0]}
    for name, value in problem.items():
        traits.add(f"{name} {value}" if isinstance(value, str) and name not in ("name", "obstacle") else name)
    return traits


class Choice:
    """The problems of a room that are computed, and whether a row belongs to one that is left out.

    Parameters
    ----------
    whole : bool
        Whether all problems are computed.
    """

    def __init__(self, whole):
        self._whole = whole
        self._computed = {}  # {how the rows of a problem begin: whether it is computed}

    def of(self, problems):
        """Return those of a list of problems of plain data that are computed."""
        traits = {problem["name"]: traits_of(problem) for problem in problems}
        computed = self.named(traits)
        return [problem for problem in problems if problem["name"] in computed]

    def named(self, traits):
        """Return the names that are computed, in order, of {how rows of a problem begin: what it shows}."""
        chosen = {*traits} if self._whole else part(traits)
        self._computed |= {name: name in chosen for name in traits}
        return [name for name in traits if name in chosen]

    def leaves_out(self, row):
        """Return whether a row belongs to a problem that is left out: that whose name is the longest."""
        words = row
        while words and words not in self._computed:
            words = words.rpartition(" ")[0]
        return not self._computed.get(words, True)
