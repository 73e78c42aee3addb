"""The motion that all libraries of this folder are asked for: the tool of an arm to a point.

The limits are those of the arm's URDF; `first_hour.py` judges what comes out by closed forms.
"""

from pathlib import Path

URDF = str(Path(__file__).resolve().parents[3] / "models" / "four_axis_arm.urdf")
HOME = [0.0, 1.4, -1.6, -1.37]
"""Where it begins, at rest, in [rad]."""
GOAL = [0.3, 0.4, 0.2]
"""Where the tool ends, at rest, in [m]."""
T = 1.2
"""Its duration, in [s]."""
