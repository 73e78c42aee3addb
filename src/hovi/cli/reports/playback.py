"""A motion played back in another simulator, as text and as JSON."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from hovi.cli.reports.terminal_table import print_table
from hovi.system.files import finite

if TYPE_CHECKING:
    from hovi.exchange.mujoco_check import MujocoReplay


def playback_json(played: MujocoReplay) -> dict[str, Any]:
    """`success`, `error` by joint (null where the simulation diverged), `steps`, `left_out`."""
    error = dict(zip(played.names, played.error.tolist(), strict=True))
    shown = {"error": error, "steps": len(played.times) - 1, "left_out": list(played.left_out)}
    found: dict[str, Any] = finite({"success": played.success, **shown})
    return found


def print_playback(played: MujocoReplay) -> None:
    """Print the largest deviation of each joint, and a sentence."""
    print_table(
        ("joint", "largest deviation [rad, m]"),
        [(name, f"{error:.2e}") for name, error in zip(played.names, played.error, strict=True)],
        f"played back in MuJoCo in {len(played.times) - 1:,} steps, without feedback",
    )
    if played.left_out:
        print(f"without the torques of {', '.join(played.left_out)}, which MuJoCo does not have")
    if played.success:
        print("MuJoCo follows the plan to 1e-3 rad or m.")
    else:
        print(
            "MuJoCo leaves the plan by more than 1e-3 rad or m. Try a tenth of the --step: if the "
            "deviation stays, model and plan differ, or the motion magnifies rounding errors."
        )
