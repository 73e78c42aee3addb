"""The reference tools of `hovi accuracy --peer NAME[=PYTHON]`.

To add a tool in an environment of its own, write a worker module in this folder and an entry of
EXTERNAL; to add one that runs in this process, write its methods and an entry of IN_PROCESS.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hovi.accuracy import Peer
from hovi.accuracy.peers.external_method import ExternalTool
from hovi.accuracy.peers.ipopt_method import collocation_peers
from hovi.errors import InputError, nearest

IN_PROCESS: Mapping[str, Callable[[], Sequence[Peer]]] = {"collocation": collocation_peers}

EXTERNAL: Mapping[str, ExternalTool] = {
    # FDDP with two parametrizations of the torque in an interval. From the near guess it finds
    # other minima on the robot arms.
    "crocoddyl": ExternalTool(
        worker="crocoddyl_worker",
        family="Crocoddyl",
        variants={
            "RK4, constant torque": (2, {"control": "zero"}),
            "RK4, quadratic torque": (4, {"control": "two"}),
        },
        nearer=True,
    ),
    "drake": ExternalTool(
        worker="drake_worker",
        family="Drake",
        variants={
            "DirectCollocation, Ipopt": (None, {"solver": "Ipopt"}),
            "DirectCollocation, SNOPT": (None, {"solver": "SNOPT"}),
        },
    ),
}


def tool_peers(name: str, python: Path | None = None) -> list[Peer]:
    """The methods of a tool, for `work_precision(peers=)`.

    name: in IN_PROCESS or EXTERNAL. python: of the tool's environment, for tools in EXTERNAL.
    Raises InputError for an unknown name, and for a Python that is missing or superfluous.
    """
    if name in IN_PROCESS:
        if python is not None:
            raise InputError(f"{name} runs in this Python; leave out {str(python)!r}.")
        return list(IN_PROCESS[name]())
    if name not in EXTERNAL:
        raise InputError(f"there is no peer {name!r}: {nearest(name, (*IN_PROCESS, *EXTERNAL))}")
    if python is None:
        raise InputError(f"{name} needs the Python of its environment; write {name}=PYTHON.")
    return list(EXTERNAL[name].peers(python))
