"""The option --second of cases: a second body that is rigid, the same as the first, or has these numbers."""

import microblock as mb

RIGID, SAME = ("rigid",), ("same",)


def numbers(words, allowed, rest=()):
    """(E, nu, beta, alpha) as given in words; None of RIGID and SAME.

    allowed : str, what may stand in place of these two
    rest : the last numbers, where they are left out

    Raises
    ------
    BadArgument
        For words that are no such numbers, or no numbers of a solid.
    """
    if words in (RIGID, SAME):
        return None
    said = " ".join(map(str, words))
    try:
        E, nu, beta, alpha = map(float, words if len(words) == 4 else (*words, *rest))
    except ValueError:
        raise mb.BadArgument("second", said, f"must be rigid, same, or {allowed}") from None
    try:
        mb.Cosserat(E, nu, alpha, beta=beta)
    except mb.BadArgument as failure:
        raise mb.BadArgument("second", said, f"has a {failure.name} that {failure.allowed}") from failure
    return E, nu, beta, alpha
