"""The torques and the Lagrangian of a scene, with every effect that it names."""

from __future__ import annotations

import casadi as ca

from hovi.checks.arguments import check_arguments
from hovi.scene.scene import Scene, require_known_joints

ARGUMENTS = ["q", "v", "a", "t"]


@check_arguments
def torques(scene: Scene) -> ca.Function:
    """tau = RNEA(q, v, a) + effects: (q, v, a, t) -> (nv,), in [N m] or [N].

    Raises ModelError for joints of an unsupported kind.
    """
    return _graph(scene, 0, "tau")


@check_arguments
def lagrangian(scene: Scene) -> ca.Function:
    """L~ of a scene, 1/2 |tau|^2 and the costs that its effects add: (q, v, a, t) -> L~.

    With the effect `jerk_cost` it is (q, v, a, j, t) -> L.
    Raises ModelError for joints of an unsupported kind.
    """
    effort, W = _graph(scene, 1, "L"), scene.terms.jerk_weight
    if W is None:
        return effort
    q, v, a, t = (ca.SX.sym(each, *effort.size_in(i)) for i, each in enumerate(ARGUMENTS))
    j = ca.SX.sym("j", *a.shape)
    cost = effort(q, v, a, t) + ca.dot(ca.DM(W), j**2) / 2
    return ca.Function("L", [q, v, a, j, t], [cost], ["q", "v", "a", "j", "t"], ["L"])


def _graph(scene: Scene, index: int, name: str) -> ca.Function:
    """One output of the scene's graph."""
    require_known_joints(scene.robot)
    graph = scene.graph()
    symbols = [ca.SX.sym(each, *graph.size_in(i)) for i, each in enumerate(ARGUMENTS)]
    return ca.Function(name, symbols, [graph(*symbols)[index]], ARGUMENTS, [name])
