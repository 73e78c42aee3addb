from __future__ import annotations

import json
import pickle
import re
import sys
from pathlib import Path

import coal
import numpy as np
import numpy.typing as npt
import pinocchio as pin
import pytest

from hovi.errors import InputError, ModelError
from hovi.robot.example_robots import BUILT_IN_CODE, example_names, example_robot
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot, RobotSource
from samples.meshes import TRIANGLE, mesh_arm

Array = npt.NDArray[np.float64]

FINGERS = ("panda_finger_joint1", "panda_finger_joint2")

NOT_A_URDF = {"cassie": "SDF"}
"""Examples that cannot be loaded, with a word of the error."""

MASSLESS = {
    "bluevolta_bravo7_gripper": r"bravo_finger\d_joint",
    "bravo7_gripper": r"bravo_finger\d_joint",
    "falcon_bravo7_gripper": r"bravo_finger\d_joint",
    "romeo": r"[LR](Finger\d\d|Thumb\d|Hand)",
}
"""Examples whose fingers have no mass, with a pattern of the joints of these fingers."""


def printed_torques(q: Array, v: Array, a: Array) -> Array:
    """u1, u2 of [ColomboFerraroMartin2016, section 5], as printed."""
    m1, m2, l1, l2, g = 0.375, 0.25, 1.5, 1.0, 9.8
    j1, j2 = m1 * l1**2 / 3, m2 * l2**2 / 3
    s2, c2, c1, c12 = np.sin(q[1]), np.cos(q[1]), np.cos(q[0]), np.cos(q[0] + q[1])
    coupling = m2 * l2**2 / 4 + j2 + c2 * l1 * l2 * m2 / 2
    u1 = (
        -s2 * l1 * l2 * m2 * v[1] * v[0]
        - s2 * v[1] ** 2 * l1 * l2 * m2 / 2
        + m2 * l2 * c12 * g / 2
        + (m2 * g * c1 + g * c1 * m1 / 2) * l1
        + coupling * a[1]
        + (c2 * l1 * l2 * m2 + (m1 / 4 + m2) * l1**2 + m2 * l2**2 / 4 + j1 + j2) * a[0]
    )
    u2 = (
        s2 * l1 * l2 * m2 * v[0] ** 2 / 2
        + coupling * a[0]
        + m2 * l2 * c12 * g / 2
        + (m2 * l2**2 / 4 + j2) * a[1]
    )
    return np.array([u1, u2])


# The shipped models


def test_the_two_link_arm_has_the_torques_printed_in_the_paper(two_link: Robot) -> None:
    model = two_link.model.copy()
    model.gravity.linear = np.array([0.0, 0.0, -9.8])
    data = model.createData()
    for q, v, a in np.random.default_rng(1).uniform(-4.0, 4.0, (200, 3, 2)):
        assert pin.rnea(model, data, q, v, a) == pytest.approx(
            printed_torques(q, v, a), rel=0.0, abs=1e-12
        )


def test_the_two_link_arm_lies_along_x_and_has_visual_geometry(two_link: Robot) -> None:
    assert two_link.joint_names == ("shoulder", "elbow")
    assert two_link.tip_frame == "tip"
    q = np.array([[0.0, 0.0], [np.pi / 2, 0.0], [0.0, np.pi / 2]])
    expected = np.array([[2.5, 0.0, 0.0], [0.0, 0.0, 2.5], [1.5, 0.0, 1.0]])
    assert two_link.frame_position("tip", q) == pytest.approx(expected, abs=1e-12)
    assert two_link.visual is not None
    assert two_link.visual.ngeoms == 6
    assert two_link.visual_problem == ""


def test_the_pendulum_has_the_torque_of_a_point_mass(models: Path) -> None:
    robot = load_robot(models / "pendulum.urdf")
    q, a = np.array([0.7]), np.array([1.1])
    torque = pin.rnea(robot.model, robot.model.createData(), q, np.array([5.0]), a)
    assert torque[0] == pytest.approx((1.0 + 1.6e-4) * a[0] + 9.81 * np.sin(q[0]), rel=1e-14)
    assert robot.visual is not None


# Example robots


@pytest.mark.parametrize("name", sorted({*example_names()} - {*BUILT_IN_CODE}))
def test_every_example_loads_as_pinocchio_reads_it(name: str) -> None:
    if name in NOT_A_URDF:
        with pytest.raises(ModelError, match=NOT_A_URDF[name]):
            load_robot(name)
        return
    robot, example = load_robot(name), example_robot(name)
    root = (pin.JointModelFreeFlyer(),) if example.free_flyer else ()
    oracle = pin.buildModelFromUrdf(str(example.urdf), *root)
    oracle.armature = robot.model.armature
    assert robot.model == oracle
    assert Robot.from_dict(json.loads(json.dumps(robot.to_dict()))).model == robot.model


@pytest.mark.parametrize("name", ["talos_arm", "ur5", "solo8", *BUILT_IN_CODE])
def test_an_example_has_the_dynamics_of_its_own_loader(name: str) -> None:
    import example_robot_data

    oracle, robot = example_robot_data.load(name), load_robot(name)
    rng = np.random.default_rng(2)
    q = pin.integrate(oracle.model, pin.neutral(oracle.model), rng.uniform(-1, 1, robot.nv))
    v, a = rng.uniform(-1, 1, (2, robot.nv))
    torque = pin.rnea(robot.model, robot.model.createData(), q, v, a)
    assert torque == pytest.approx(pin.rnea(oracle.model, oracle.data, q, v, a), rel=1e-12)
    assert robot.armature == pytest.approx(oracle.model.armature)
    assert robot.visual is not None
    assert robot.visual.ngeoms == oracle.visual_model.ngeoms


@pytest.mark.parametrize("name", sorted({*example_names()} - {*BUILT_IN_CODE, *NOT_A_URDF}))
def test_only_examples_with_massless_fingers_have_a_singular_mass_matrix(name: str) -> None:
    robot = load_robot(name)
    if name not in MASSLESS:
        robot.check_mass_matrix()
        return
    fingers = [joint for joint in robot.joint_names if re.fullmatch(MASSLESS[name], joint)]
    with pytest.raises(ModelError, match=f"singular.*locked={re.escape(repr(fingers))}"):
        robot.check_mass_matrix()
    load_robot(name, locked=fingers).check_mass_matrix()


def test_an_unknown_example_is_refused_with_the_nearest_names() -> None:
    with pytest.raises(ModelError, match=r"'pnada'.*did you mean .*'panda'"):
        load_robot("pnada")


def test_the_free_flyer_option_overrides_the_loader() -> None:
    assert load_robot("solo8").nv == 14
    assert load_robot("solo8", free_flyer=False).nv == 8
    assert load_robot("ur5", free_flyer=True).nv == 12


# Loading


def test_a_missing_file_is_refused(tmp_path: Path) -> None:
    for missing in (tmp_path / "arm.urdf", str(tmp_path / "arm"), "arm.urdf"):
        with pytest.raises(ModelError, match="no such file"):
            load_robot(missing)


def test_loading_reads_no_mesh(panda: Robot) -> None:
    robot = load_robot("panda")
    assert "_visual_shapes" not in vars(robot)
    assert robot.visual is not None
    assert "_visual_shapes" in vars(robot)


def test_locked_joints_are_removed_from_model_and_shapes(panda: Robot) -> None:
    full = load_robot("panda")
    assert (full.nv, panda.nv) == (9, 7)
    assert not set(FINGERS) & set(panda.joint_names)
    assert panda.visual is not None
    assert panda.visual.ngeoms == 11
    assert max(shape.parentJoint for shape in panda.visual.geometryObjects) == 7
    q = np.random.default_rng(3).uniform(-1, 1, (4, 7))
    padded = np.hstack([q, np.zeros((4, 2))])
    frame = "panda_rightfinger"
    assert panda.frame_position(frame, q) == pytest.approx(full.frame_position(frame, padded))


def test_an_unknown_joint_to_lock_is_refused_with_the_nearest_names() -> None:
    with pytest.raises(ModelError, match=r"'panda_finger_joint'.*did you mean"):
        load_robot("panda", locked=["panda_finger_joint"])


def test_a_pinocchio_model_is_copied(two_link: Robot) -> None:
    model = pin.buildSampleModelManipulator()
    robot = load_robot(model, locked=[model.names[1]])
    model.gravity.linear = np.zeros(3)
    assert robot.nv == model.nv - 1
    assert robot.model.gravity.linear[2] == -9.81
    assert robot.source.kind == "model"
    assert robot.visual is None
    assert "without visual" in robot.visual_problem
    seen = load_robot(two_link.model, visual=two_link.visual)
    assert seen.visual is not None
    assert seen.visual.ngeoms == 6


def test_other_types_are_refused() -> None:
    with pytest.raises(ModelError, match="not int"):
        load_robot(3)  # type: ignore[arg-type]


# Meshes


def test_a_robot_without_its_meshes_loads_and_reports_what_is_missing(tmp_path: Path) -> None:
    robot = load_robot(mesh_arm(tmp_path, "package://somewhere/rod.stl"))
    assert robot.nv == 1
    assert robot.visual is None
    assert "'rod'" in robot.visual_problem
    assert "package_dirs" in robot.visual_problem


@pytest.mark.parametrize(
    "mesh", ["package://arm_description/meshes/rod.stl", "../meshes/rod.stl", "file://{}/rod.stl"]
)
def test_meshes_are_found_around_the_urdf(tmp_path: Path, mesh: str) -> None:
    package = tmp_path / "arm_description"
    (package / "meshes").mkdir(parents=True)
    (package / "urdf").mkdir()
    (package / "package.xml").write_text("<package/>")
    (package / "meshes" / "rod.stl").write_text(TRIANGLE)
    robot = load_robot(mesh_arm(package / "urdf", mesh.format(package / "meshes")))
    assert robot.visual is not None, robot.visual_problem
    assert robot.visual.ngeoms == 1


def test_package_folders_are_searched(tmp_path: Path) -> None:
    (tmp_path / "packages" / "arm").mkdir(parents=True)
    (tmp_path / "packages" / "arm" / "rod.stl").write_text(TRIANGLE)
    urdf = mesh_arm(tmp_path, "package://arm/rod.stl")
    assert load_robot(urdf).visual is None
    assert load_robot(urdf, package_dirs=[tmp_path / "packages"]).visual is not None


@pytest.mark.parametrize("mesh", ["{}/rod.stl", "file://{}/rod.stl", "../outside/rod.stl"])
def test_a_mesh_outside_the_package_is_never_read(tmp_path: Path, mesh: str) -> None:
    for folder in ("outside", "inside"):
        (tmp_path / folder).mkdir()
    (tmp_path / "outside" / "rod.stl").write_text(TRIANGLE)
    urdf = mesh_arm(tmp_path / "inside", mesh.format(tmp_path / "outside"))
    robot = load_robot(urdf)
    assert robot.visual is None
    assert "lies outside" in robot.visual_problem
    assert load_robot(urdf, package_dirs=[tmp_path / "outside"]).nv == 1


@pytest.mark.parametrize("folder", ["/", "/usr/..", "/proc/self/root", "link", "~/.."])
def test_a_folder_of_everything_is_no_package_folder(
    tmp_path: Path, folder: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every file would be inside its package."""
    monkeypatch.setenv("HOME", str(tmp_path / "home" / "user"))
    (tmp_path / "home" / "user").mkdir(parents=True)
    (tmp_path / "link").symlink_to("/")
    urdf = mesh_arm(tmp_path / "home", "rod.stl")
    given = str(tmp_path / folder if folder == "link" else Path(folder).expanduser())
    with pytest.raises(ModelError, match="holds the files of every user") as refused:
        load_robot(urdf, package_dirs=[given])
    assert str(refused.value).count("\n") == 0
    with pytest.raises(ModelError, match="holds the files of every user"):
        Robot.from_dict(load_robot(urdf).to_dict(), package_dirs=[given])
    assert load_robot(urdf, package_dirs=[tmp_path / "home" / "user"]).nv == 1


def test_a_urdf_among_the_files_of_every_user_shows_none_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", str(tmp_path / "user"))
    (tmp_path / "user").mkdir()
    (tmp_path / "user" / "rod.stl").write_text(TRIANGLE)
    robot = load_robot(mesh_arm(tmp_path, "user/rod.stl"))
    assert robot.visual is None
    assert "holds the files of every user" in robot.visual_problem


@pytest.mark.parametrize("depth", [1, 2, 3])
def test_a_folder_above_the_urdf_is_no_package_by_its_name_alone(
    depth: int, tmp_path: Path
) -> None:
    """package://home/... would be every user's files."""
    folder = tmp_path / "home" / "user" / "downloads"
    folder.mkdir(parents=True)
    above = folder.parents[depth - 1]
    (above / "rod.stl").write_text(TRIANGLE)
    urdf = mesh_arm(folder, f"package://{above.name}/rod.stl")
    robot = load_robot(urdf)
    assert robot.visual is None
    assert "was not found" in robot.visual_problem
    (above / "package.xml").write_text("<package/>")
    assert load_robot(urdf).visual is not None


def test_the_folder_of_the_urdf_is_a_package_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "rod.stl").write_text(TRIANGLE)
    assert load_robot(mesh_arm(tmp_path, f"package://{tmp_path.name}/rod.stl")).visual is not None


@pytest.mark.parametrize(
    ("mesh", "package"),
    [
        *(("a" * 300 + ".stl", "."), ("a/" * 5_000 + "x.stl", "."), ("loop.stl", ".")),
        *(("package://" + "p" * 300 + "/x.stl", "."), ("package://p/x.stl", "a\0")),
        ("package://p/x.stl", "a" * 5_000),
    ],
)
def test_a_path_that_no_mesh_can_have_is_reported(mesh: str, package: str, tmp_path: Path) -> None:
    (tmp_path / "loop.stl").symlink_to("loop.stl")
    robot = load_robot(mesh_arm(tmp_path, mesh), package_dirs=[package])
    assert robot.visual is None
    circular = mesh == "loop.stl" and sys.version_info >= (3, 13)  # which leads to itself there
    said = "was not found" if circular else "cannot be looked for"
    assert said in robot.visual_problem
    assert len(robot.visual_problem) < 500


def test_the_sum_of_all_meshes_is_limited(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "rod.stl").write_text(TRIANGLE)
    urdf = mesh_arm(tmp_path, "rod.stl")
    shape = '<visual><geometry><mesh filename="rod.stl"/></geometry></visual>'
    urdf.write_text(urdf.read_text().replace(shape, 3 * shape))
    monkeypatch.setattr("hovi.robot.geometry.MAX_ALL_MESHES", 2 * len(TRIANGLE))
    robot = load_robot(urdf)
    assert robot.visual is not None
    assert robot.visual.ngeoms == 2
    assert "the meshes of all shapes exceed" in robot.visual_problem


def test_a_symbolic_link_out_of_the_package_is_not_followed(tmp_path: Path) -> None:
    for folder in ("outside", "inside"):
        (tmp_path / folder).mkdir()
    (tmp_path / "outside" / "rod.stl").write_text(TRIANGLE)
    (tmp_path / "inside" / "rod.stl").symlink_to(tmp_path / "outside" / "rod.stl")
    robot = load_robot(mesh_arm(tmp_path / "inside", "rod.stl"))
    assert robot.visual is None
    assert "lies outside" in robot.visual_problem


def test_a_package_may_be_a_symbolic_link(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "rod.stl").write_text(TRIANGLE)
    (tmp_path / "arm").symlink_to(tmp_path / "real")
    urdf = mesh_arm(tmp_path / "arm", "package://arm/rod.stl")
    assert load_robot(urdf).visual is not None


# Names, limits, configurations


def test_names_and_sizes_agree() -> None:
    robot = load_robot("kinova")
    assert (robot.nq, robot.nv, len(robot.joint_names)) == (9, 6, 6)
    assert not robot.vector_joints
    assert robot.manifold_joints == tuple(f"j2s6s200_joint_{i}" for i in (1, 4, 6))
    assert robot.coordinate_names == robot.joint_names
    assert load_robot("hector").coordinate_names == tuple(f"root_joint[{i}]" for i in range(6))
    assert robot.lower.shape == robot.upper.shape == (9,)
    for value in (robot.velocity_limit, robot.effort_limit, robot.damping, robot.friction):
        assert value.shape == (6,)


def test_limits_match_the_urdf(panda: Robot) -> None:
    assert panda.lower[3] == -3.0718
    assert panda.velocity_limit[4] == 2.61
    assert panda.effort_limit[0] == 87.0


@pytest.mark.parametrize("name", ["panda", "kinova", "hector", "tiago_pro"])
def test_difference_undoes_integrate(name: str) -> None:
    robot = load_robot(name)
    dq = np.random.default_rng(4).uniform(-1, 1, (3, 2, robot.nv))
    q0 = robot.integrate(robot.neutral(), 0.5 * dq[0, 0])
    q1 = robot.integrate(q0, dq)
    assert q1.shape == (3, 2, robot.nq)
    assert robot.difference(q0, q1) == pytest.approx(dq, abs=1e-12)
    assert q1[1, 1] == pytest.approx(pin.integrate(robot.model, q0, dq[1, 1]), abs=1e-15)


@pytest.mark.parametrize(
    ("q", "words"),
    [
        ([0.0], ["start", r"\(1,\)", r"\(2,\)", "shoulder, elbow"]),
        ([0.0, float("nan")], ["start is nan", "'elbow'"]),
        ([float("inf"), 0.0], ["start is inf", "'shoulder'"]),
        (["a", "b"], ["start", "2 numbers"]),
    ],
)
def test_a_bad_configuration_is_refused_by_name(
    two_link: Robot, q: list[float], words: list[str]
) -> None:
    for word in words:
        with pytest.raises(InputError, match=word):
            two_link.check_configuration(q, "start")
        with pytest.raises(InputError, match=word):
            two_link.check_velocity(q, "start")


def test_a_huge_coordinate_is_refused_by_name(two_link: Robot) -> None:
    with pytest.raises(InputError, match=r"start is 1e\+308 at joint 'elbow': at most 1e\+09"):
        two_link.check_configuration([0.0, 1e308], "start")


def test_a_quaternion_or_angle_without_unit_norm_is_refused() -> None:
    kinova, hector = load_robot("kinova"), load_robot("hector")
    for robot, joint in ((kinova, "j2s6s200_joint_4"), (hector, "root_joint")):
        q = robot.neutral()
        index = robot.model.joints[robot.model.getJointId(joint)].idx_q
        unit = slice(index, index + 2) if robot is kinova else slice(3, 7)
        for factor in (1.01, 0.0):
            bad = q.copy()
            bad[unit] *= factor
            with pytest.raises(InputError, match=f"goal .*'{joint}'.*unit norm"):
                robot.check_configuration(bad, "goal")
        nearly = q.copy()
        nearly[unit] *= 1.0 + 1e-6
        assert robot.check_configuration(nearly, "goal") == pytest.approx(q, abs=1e-15)


@pytest.mark.parametrize("shape", [(), (3,), (1, 3), (2, 1)])
def test_frame_positions_need_configurations(two_link: Robot, shape: tuple[int, ...]) -> None:
    with pytest.raises(InputError, match=re.escape(f"q must have shape (..., 2), got {shape}")):
        two_link.frame_position("tip", np.zeros(shape))


@pytest.mark.parametrize("lead", [(), (1,), (4,), (3, 2), (0,), (2, 0)])
def test_frame_positions_are_those_of_the_poses_at_one_or_many_configurations(
    panda: Robot, lead: tuple[int, ...]
) -> None:
    q = np.random.default_rng(0).uniform(-1.0, 1.0, (*lead, panda.nq))
    frames = ("panda_hand_tcp", "panda_link4")
    poses = [panda.frame_pose(frame, q)[..., :3, 3] for frame in frames]
    np.testing.assert_array_equal(panda.frame_positions(frames, q), np.stack(poses, axis=-2))
    for frame, position in zip(frames, poses, strict=True):
        np.testing.assert_array_equal(panda.frame_position(frame, q), position)


@pytest.mark.parametrize("key", ["mimic", "free_flyer"])
def test_options_must_be_true_or_false(key: str) -> None:
    with pytest.raises(InputError, match=f"got a str; give {key}=True or {key}=False"):
        load_robot("panda", **{key: "yes"})  # type: ignore[arg-type]


def test_a_single_name_can_be_locked() -> None:
    assert load_robot("ur5", locked="elbow_joint").nv == 5


def test_a_robot_prints_its_name_and_sizes(two_link: Robot) -> None:
    assert repr(two_link) == "<Robot 'two_link': nq = 2, nv = 2>"


def test_an_unknown_frame_is_refused_with_the_nearest_names(two_link: Robot) -> None:
    with pytest.raises(InputError, match=r"no frame 'tipp'.*'tip'"):
        two_link.frame_position("tipp", np.zeros((1, 2)))


# The mass matrix


@pytest.mark.parametrize("mass", ["0", "1e-18"])
def test_a_massless_last_link_is_refused_by_name(tmp_path: Path, models: Path, mass: str) -> None:
    text = (models / "two_link.urdf").read_text()
    light = text.replace('value="0.25"', f'value="{mass}"').replace("0.083333333333333329", mass)
    (tmp_path / "arm.urdf").write_text(light)
    robot = load_robot(tmp_path / "arm.urdf")
    with pytest.raises(ModelError, match=r"joint 'elbow' \(link 'forearm'\).*locked=\['elbow'\]"):
        robot.check_mass_matrix()


@pytest.mark.parametrize("ratio", [1e-6, 1e6])
def test_unequal_masses_are_not_singular(tmp_path: Path, models: Path, ratio: float) -> None:
    text = (models / "two_link.urdf").read_text().replace('value="0.25"', f'value="{ratio}"')
    (tmp_path / "arm.urdf").write_text(text.replace("0.083333333333333329", f"{ratio / 3}"))
    load_robot(tmp_path / "arm.urdf").check_mass_matrix()


# Files and processes


def test_a_stored_robot_contains_its_urdf_and_no_path(two_link: Robot, models: Path) -> None:
    stored = json.loads(json.dumps(two_link.to_dict()))
    assert str(models) not in json.dumps(stored)
    assert stored["urdf"].encode() == (models / "two_link.urdf").read_bytes()
    again = Robot.from_dict(stored)
    assert again.model == two_link.model
    assert again.to_dict() == two_link.to_dict()
    assert again.visual is not None
    assert again.visual.ngeoms == 6


def test_a_stored_example_finds_its_meshes_by_name(panda: Robot) -> None:
    again = Robot.from_dict(panda.to_dict())
    assert again.model == panda.model
    assert again.visual is not None
    assert again.visual.ngeoms == 11


def test_a_stored_urdf_that_was_edited_is_refused(two_link: Robot) -> None:
    stored = two_link.to_dict()
    stored["urdf"] = stored["urdf"].replace("0.375", "0.376")
    with pytest.raises(ModelError, match="sha256"):
        Robot.from_dict(stored)


@pytest.mark.parametrize("key", ["name", "kind", "reference", "urdf", "locked", "free_flyer"])
def test_an_incomplete_stored_robot_is_refused(two_link: Robot, key: str) -> None:
    for damage in (None, 3):
        with pytest.raises(ModelError):
            Robot.from_dict({**two_link.to_dict(), key: damage})


@pytest.mark.parametrize("armature", [{"elbo": 1.0}, {"elbow": "x"}, {"elbow": float("nan")}])
def test_a_stored_armature_is_checked(two_link: Robot, armature: dict[str, object]) -> None:
    with pytest.raises(ModelError, match="elbo"):
        Robot.from_dict({**two_link.to_dict(), "armature": armature})


def test_a_pinocchio_model_cannot_be_restored_from_a_file() -> None:
    stored = load_robot(pin.buildSampleModelManipulator()).to_dict()
    assert stored["urdf"] is None
    with pytest.raises(ModelError, match=r"was given as a pinocchio\.Model"):
        Robot.from_dict(json.loads(json.dumps(stored)))


def test_a_robot_can_be_pickled(two_link: Robot, panda: Robot) -> None:
    given = load_robot(two_link.model, visual=two_link.visual)
    for robot in (two_link, panda, given):
        count = robot.visual.ngeoms if robot.visual else 0
        again = pickle.loads(pickle.dumps(robot))
        assert again.model == robot.model
        assert again.source == robot.source
        assert again.visual.ngeoms == count


def test_sources_compare_by_value(two_link: Robot) -> None:
    stored = two_link.source.to_dict()
    assert RobotSource.from_dict(stored) == RobotSource.from_dict(stored)


# Words


def test_the_description_lists_properties_that_need_an_effect() -> None:
    text = load_robot("talos_arm").describe()
    for words in ("7 joints", "nv = 7", "arm_left_2_joint", "damping", "dry friction", "armature"):
        assert words in text
    assert "<mimic>" in load_robot("panda").describe()
    assert "a continuous joint takes its angle" in load_robot("kinova").describe()


def test_the_description_says_if_planning_is_not_possible(tmp_path: Path, models: Path) -> None:
    text = (models / "two_link.urdf").read_text()
    path = tmp_path / "light.urdf"
    path.write_text(re.sub(r'(<mass value=|i[xyz]{2}=)"[^"]*"', r'\1"0"', text))
    words = load_robot(path).describe()
    assert "Planning with torques is not possible: the mass matrix" in words
    assert "'shoulder'" in words


def test_every_robot_can_be_described(two_link: Robot) -> None:
    for robot in (two_link, load_robot(pin.Model()), load_robot("tiago_dual")):
        assert robot.name in robot.describe()


def test_links_keep_their_names_when_a_joint_with_the_name_of_a_link_is_locked(
    tmp_path: Path,
) -> None:
    """A link "rod/link", too, which looks like a link that is renamed while joints are locked."""
    file = mesh_arm(tmp_path, "rod.stl")
    for old, new in (('"rod"', '"rod/link"'), ('"base"', '"hinge"')):
        file.write_text(file.read_text().replace(old, new))
    free, locked = load_robot(file), load_robot(file, locked=["hinge"])
    assert sorted(locked.frame_names) == sorted(free.frame_names)
    assert "rod/link" in locked.frame_names


def test_a_joint_whose_link_has_its_name_can_be_locked() -> None:
    """SO-100: joint and link 'gripper'; Pinocchio's own reduction refuses the name."""
    free, locked = load_robot("so100"), load_robot("so100", locked=["gripper"])
    assert locked.nv == free.nv - 1
    assert sorted(locked.frame_names) == sorted(free.frame_names)
    q = free.neutral()
    reduced = np.delete(q, free.model.joints[free.model.getJointId("gripper")].idx_q)
    mass = pin.crba(free.model, free.model.createData(), q)
    kept = np.delete(np.arange(free.nv), free.model.joints[free.model.getJointId("gripper")].idx_v)
    found = pin.crba(locked.model, locked.model.createData(), reduced)
    np.testing.assert_allclose(np.triu(found), np.triu(mass)[np.ix_(kept, kept)], atol=1e-12)


def test_shapes_of_a_model_without_frames_belong_to_their_joints() -> None:
    """The given model stays as it is."""
    model = pin.Model()
    joint = model.addJoint(0, pin.JointModelRZ(), pin.SE3.Identity(), "turn")
    model.appendBodyToJoint(joint, pin.Inertia.FromSphere(1.0, 0.1), pin.SE3.Identity())
    shapes, frames = pin.GeometryModel(), model.nframes
    shapes.addGeometryObject(
        pin.GeometryObject("ball", joint, pin.SE3.Identity(), coal.Sphere(0.1))
    )
    robot = load_robot(model, collision=shapes)
    assert robot.collision is not None
    (shape,) = robot.collision.geometryObjects
    assert robot.model.frames[shape.parentFrame].name == "turn"
    assert model.nframes == frames
