"""Errors of a motion at the tips of a robot, against positions of frames by Pinocchio."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi import plan
from hovi.discrete.measures.motion_error import deviation, relative_difference, sample_points
from hovi.discrete.state import State
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.errors import InputError
from hovi.robot.robot import Robot
from hovi.scene.scene import Scene

Array = npt.NDArray[np.float64]

LEFT, RIGHT = np.array([0.2, -0.3, 0.0, 0.0]), np.array([0.0, 0.0, 0.3, 0.4])


def motion(robot: Robot, step: Array) -> Trajectory:
    scene, start = Scene(robot, [Gravity()]), robot.neutral() + 0.1
    options = {"limits": "none", "intervals": 8}
    return plan(
        scene, State(start), State(start + step), 1.0, self_collision=False, **options
    ).trajectory


@pytest.fixture(scope="module")
def reference(two_arms: Robot) -> Trajectory:
    return motion(two_arms, LEFT + RIGHT)


def positions(robot: Robot, frame: str, q: Array) -> Array:
    model, data, found = robot.model, robot.model.createData(), []
    index = model.getFrameId(frame, pin.FrameType.BODY)
    for each in q:
        pin.framesForwardKinematics(model, data, each)
        found.append(data.oMf[index].translation.copy())
    return np.array(found)


@pytest.mark.parametrize(
    ("step", "moved", "still"),
    [(LEFT, "left_gripper", "right_gripper"), (RIGHT, "right_gripper", "left_gripper")],
)
def test_an_error_at_the_tip_is_the_largest_of_all_tips(
    two_arms: Robot, reference: Trajectory, step: Array, moved: str, still: str
) -> None:
    """Of two motions that differ in one arm."""
    other = motion(two_arms, LEFT + RIGHT + 0.05 * step)
    k, s = sample_points(other)
    q = other.sample_intervals(k, s).q, reference.sample_intervals(k, s).q
    each = {
        frame: np.linalg.norm(np.subtract(*(positions(two_arms, frame, x) for x in q)), axis=1)
        for frame in two_arms.tip_frames
    }
    assert each[moved].max() > 1e-3 > 1e-6 > each[still].max()
    error = deviation(other, reference, (1.0, 1.0))
    largest = np.maximum(each[moved], each[still]).reshape(other.grid.intervals, -1)
    assert error.frame == moved
    np.testing.assert_allclose(error.tip, largest.max(axis=1), atol=1e-14)
    nodes = np.append(largest[:, 0], largest[-1, -1])
    np.testing.assert_allclose(error.tip_at_nodes, nodes, atol=1e-14)
    alone = deviation(other, reference, (1.0, 1.0), still)
    assert alone.frame == still
    assert alone.largest_tip == pytest.approx(each[still].max(), abs=1e-14)


def test_no_error_is_measured_at_a_frame_that_does_not_move(reference: Trajectory) -> None:
    with pytest.raises(InputError, match=r"'sonar_ring' .* is fixed to the world.*'left_gripper'"):
        deviation(reference, reference, (1.0, 1.0), "sonar_ring")


@pytest.mark.parametrize(
    ("value", "reference", "expected"),
    [(3.0, 2.0, 0.5), (-1.0, 2.0, 1.5), (1.0, -2.0, 1.5), (2.0, 2.0, 0.0), (0.0, 0.0, 0.0)],
)
def test_relative_differences_are_relative_to_the_reference(
    value: float, reference: float, expected: float
) -> None:
    assert relative_difference(value, reference) == expected
