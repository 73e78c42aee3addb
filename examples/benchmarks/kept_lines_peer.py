"""The side of `kept_lines.py` that runs where `roboplan-cartesian-planning` is installed.

It reads lines as JSON from standard input, and prints what it finds as JSON, with the time of each.
"""

from __future__ import annotations

import json
import re
import sys
import tempfile
import time
from typing import Any

import numpy as np
from roboplan.cartesian_planning import (
    CartesianPathPlanner,
    CartesianPlannerOptions,
    CartesianSpeedMode,
)
from roboplan.core import (
    CartesianPath,
    JointConfiguration,
    Scene,
    loadJointLimitsConfig,
    loadUrdfSceneDescriptionFromXml,
)


def limit_accelerations(scene: Scene, acceleration: float) -> None:
    """Give every joint a largest acceleration, which URDFs do not have."""
    lines = ["joint_limits:"]
    for name in scene.getJointNames():
        lines += [f"  {name}:", f"    max_acceleration: [{acceleration}]"]
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write("\n".join(lines) + "\n")
        file.flush()
        scene.importJointLimitsFromConfig(loadJointLimitsConfig(file.name))


def planned(asked: dict[str, Any]) -> dict[str, Any]:
    """One line: the fastest trajectory within limits on velocities and accelerations."""
    bare = re.sub(r"<(visual|collision)\b.*?</\1>", "", asked["urdf"], flags=re.DOTALL)
    scene = Scene("arm", loadUrdfSceneDescriptionFromXml(bare))
    limit_accelerations(scene, asked["acceleration"])
    names, q = scene.getJointNames(), np.array(asked["start"])
    options = CartesianPlannerOptions(
        dt=asked["dt"],
        speed_mode=CartesianSpeedMode.TimeOptimal,
        max_position_error=asked["within"],
        max_orientation_error=asked["turn"],
    )
    scene.setJointPositions(q)
    poses = [np.asfortranarray(each) for each in np.array(asked["poses"])]
    path = CartesianPath([asked["base"]], [asked["frame"]], [poses])
    began = time.process_time()
    try:
        found = CartesianPathPlanner(scene, options).plan(path, JointConfiguration(names, q))
    except Exception as error:
        return {"error": str(error), "seconds": time.process_time() - began}
    return {
        "seconds": time.process_time() - began,
        "t": list(found.times),
        "q": np.array(found.positions).tolist(),
        "v": np.array(found.velocities).tolist(),
        "a": np.array(found.accelerations).tolist(),
    }


if __name__ == "__main__":
    print(json.dumps([planned(each) for each in json.load(sys.stdin)]))
