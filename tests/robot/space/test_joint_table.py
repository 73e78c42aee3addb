"""Configurations and rates by joint, against Pinocchio's integration from the neutral one."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import hovi
from hovi.errors import InputError
from hovi.robot.space.joint_table import JointError, configuration_of, rates_of


@pytest.fixture(scope="module")
def kinova() -> hovi.Robot:
    """An arm with continuous and bounded joints."""
    return hovi.load_robot("kinova")


def test_a_table_of_angles_is_the_neutral_configuration_moved_by_them(kinova: hovi.Robot) -> None:
    angles = np.linspace(-1.1, 1.3, kinova.nv)
    table = dict(zip(kinova.joint_names[::-1], angles[::-1], strict=True))
    q = configuration_of(table, kinova, "start.q")
    assert q == pytest.approx(kinova.integrate(kinova.neutral(), angles), abs=1e-15)


def test_a_continuous_joint_takes_cosine_and_sine_as_well(kinova: hovi.Robot) -> None:
    table: dict[str, Any] = dict.fromkeys(kinova.joint_names, 0.0)
    angles = dict.fromkeys(kinova.manifold_joints, 0.4)
    pairs = {joint: [np.cos(0.4), np.sin(0.4)] for joint in kinova.manifold_joints}
    assert angles
    one, other = (configuration_of(table | each, kinova, "q") for each in (angles, pairs))
    assert np.array_equal(one, other)


def test_a_floating_base_takes_seven_numbers() -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"), free_flyer=True)
    base = [0.1, 0.2, 0.3, 0.0, 0.0, 0.6, 0.8]
    table = {"root_joint": base, "shoulder": 0.5, "elbow": -0.5}
    assert configuration_of(table, robot, "q").tolist() == [*base, 0.5, -0.5]
    v = rates_of({"root_joint": [1, 2, 3, 4, 5, 6], "elbow": -1.0}, robot, "v")
    assert v.tolist() == [1, 2, 3, 4, 5, 6, 0.0, -1.0]


def test_rates_that_are_left_out_are_zero(two_link: hovi.Robot) -> None:
    assert rates_of({"elbow": 2.0}, two_link, "start.v").tolist() == [0.0, 2.0]


def test_what_is_no_table_stays_as_it_is(two_link: hovi.Robot) -> None:
    given = [0.1, 0.2]
    assert configuration_of(given, two_link, "start.q") is given
    assert rates_of(None, two_link, "start.v") is None


def test_a_named_pose_is_that_of_the_srdf(panda: hovi.Robot) -> None:
    assert np.array_equal(configuration_of("default", panda, "q"), panda.pose("default"))


@pytest.mark.parametrize(
    ("table", "sentence", "joint"),
    [
        ({"elbow": 1.0}, "`start.q` leaves out joint 'shoulder'; it needs every joint.", None),
        ({"elbo": 1.0, "shoulder": 0.0}, "names joint 'elbo', which robot 'two_link' does", "elbo"),
        ({"elbow": [1, 2], "shoulder": 0}, "`start.q.elbow` must be one number, but it", "elbow"),
        ({"elbow": "x", "shoulder": 0}, "must be one number, but it is 'x'.", "elbow"),
        ({"elbow": {}, "shoulder": 0}, "must be one number, but it is a dict.", "elbow"),
        ({3: 1.0}, "names joint 3, which", "3"),
    ],
)
def test_a_wrong_table_is_refused_at_its_joint(
    two_link: hovi.Robot, table: Any, sentence: str, joint: str | None
) -> None:
    with pytest.raises(JointError) as raised:
        configuration_of(table, two_link, "start.q")
    assert sentence in str(raised.value)
    assert raised.value.joint == joint
    copy = pickle.loads(pickle.dumps(raised.value))
    assert (str(copy), copy.joint) == (str(raised.value), joint)


def test_states_simulations_and_solves_take_tables(two_link: hovi.Robot) -> None:
    state = hovi.State({"shoulder": 0.1, "elbow": 0.2}, {"elbow": 3.0}, a={"shoulder": 1.0})
    q, v, a, _ = state.jet_on(two_link, "start")
    assert (q.tolist(), v.tolist(), a.tolist()) == ([0.1, 0.2], [0.0, 3.0], [1.0, 0.0])
    scene = hovi.Scene(two_link, [hovi.effects.Gravity()])
    by_name = hovi.simulate(scene, {"shoulder": 0.1, "elbow": 0.2}, 0.1, intervals=4)
    assert np.array_equal(by_name.q, hovi.simulate(scene, [0.1, 0.2], 0.1, intervals=4).q)
    with pytest.raises(InputError, match=r"`start\.q` leaves out joint 'shoulder'"):
        hovi.simulate(scene, {"elbow": 0.2}, 0.1, intervals=4)
