"""Three components in space, each a number or a formula of the time t."""

from __future__ import annotations

import casadi as ca

from hovi.effects.expressions.formula import Number, expression
from hovi.errors import SceneError

TimeVector = tuple[Number, Number, Number]
"""(x, y, z), each a number or a formula of t such as "0.1*sin(2*pi*t)"."""


def time_vector(what: str, given: TimeVector, t: ca.SX) -> ca.SX:
    """The three components at time t, shape (3,).

    what: the effect and its key, the start of messages. Raises SceneError.
    """
    names = ("x", "y", "z")
    if len(given) != 3:
        raise SceneError(f"{what} needs three components, got {len(given)}.")
    parts = (
        expression(f"{what}, component {name}", each, {"t": t})
        for name, each in zip(names, given, strict=True)
    )
    return ca.vertcat(*parts)


def in_words(given: TimeVector) -> str:
    """The components, for the description of a scene."""
    return "(" + ", ".join(each if isinstance(each, str) else f"{each:g}" for each in given) + ")"
