"""The one list of reference tools for comparison: `hovi accuracy --peer NAME[=PYTHON]`.

A tool in an environment of its own is a worker in this folder and an entry of OUTSIDE; one that
runs in this process is a file with its methods and an entry of INSIDE.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from hovi.accuracy import Peer
from hovi.accuracy.peers.external_method import OutsideTool
from hovi.accuracy.peers.ipopt_method import collocation_peers
from hovi.errors import InputError, nearest

INSIDE: Mapping[str, Callable[[], Sequence[Peer]]] = {"collocation": collocation_peers}

OUTSIDE: Mapping[str, OutsideTool] = {
    # FDDP with two ways to write the torque in an interval. From the near guess it leaves for
    # other minima on the arms.
    "crocoddyl": OutsideTool(
        worker="crocoddyl_worker",
        family="Crocoddyl",
        variants={
            "RK4, constant torque": (2, {"control": "zero"}),
            "RK4, quadratic torque": (4, {"control": "two"}),
        },
        nearer=True,
    ),
    "drake": OutsideTool(
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

    name: in INSIDE or OUTSIDE. python: of the tool's environment, for those of OUTSIDE.
    Raises InputError for an unknown name, and for a Python that is missing or has no use.
    """
    if name in INSIDE:
        if python is not None:
            raise InputError(f"{name} runs in this Python, not in {str(python)!r}; leave it out.")
        return list(INSIDE[name]())
    if name not in OUTSIDE:
        raise InputError(f"there is no peer {name!r}: {nearest(name, (*INSIDE, *OUTSIDE))}")
    if python is None:
        raise InputError(f"{name} needs the Python of its environment: {name}=PYTHON.")
    return list(OUTSIDE[name].peers(python))
