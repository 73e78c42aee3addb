from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from PIL import Image

import hovi
from hovi.discrete.grid import DiscretePath
from hovi.discrete.measures.motion_segments import SEGMENT_NAMES, motion_segments
from hovi.discrete.trajectory import Trajectory
from hovi.effects import Gravity
from hovi.errors import DisplayError
from hovi.planning.problem.limits import as_limits
from hovi.robot.loading import load_robot
from hovi.robot.robot import Robot
from hovi.robot.urdf import planar_chain
from hovi.scene.scene import Scene
from hovi.viewing import plotting
from hovi.viewing.curves.scheme_torque import scheme_torque
from hovi.viewing.figures import align_zeros
from samples.cubic_motion import cubic_motion
from samples.manifold_robots import chain

Picture = Callable[[Trajectory, Path], None]

PICTURES = [plotting.plot, plotting.plot_angles, plotting.plot_swept_surface]
MAGIC = {".png": b"\x89PNG", ".pdf": b"%PDF", ".svg": b"<?xml"}


@pytest.fixture(scope="module")
def motion(two_link: Robot) -> Trajectory:
    trajectory, _ = cubic_motion(Scene(two_link, [Gravity(9.8)]))
    path = trajectory.path
    inner = np.random.default_rng(3).normal(size=path.inner.shape)
    return dataclasses.replace(trajectory, path=DiscretePath(path.q, path.v, path.z, inner))


def with_limits(motion: Trajectory, **limits: object) -> Trajectory:
    """The motion with these limits in its metadata."""
    assert motion.robot is not None
    imposed = as_limits(motion.robot, {"base": "none", **limits})
    return dataclasses.replace(motion, metadata={"limits": imposed.to_dict()})


def lines(figure: Figure, panel: int, gid: str) -> list[Line2D]:
    return [line for line in figure.axes[panel].lines if line.get_gid() == gid]


@pytest.mark.parametrize("picture", PICTURES)
@pytest.mark.parametrize("suffix", MAGIC)
def test_the_suffix_selects_the_file_format(
    motion: Trajectory, tmp_path: Path, picture: Picture, suffix: str
) -> None:
    path = tmp_path / f"motion{suffix}"
    picture(motion, path)
    assert path.read_bytes().startswith(MAGIC[suffix])
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("picture", PICTURES)
def test_pictures_are_reproducible_and_not_blank(
    motion: Trajectory, tmp_path: Path, picture: Picture
) -> None:
    first, second = tmp_path / "1.png", tmp_path / "2.png"
    picture(motion, first)
    picture(motion, second)
    assert first.read_bytes() == second.read_bytes()
    pixels = np.asarray(Image.open(first).convert("RGB"), dtype=np.int16)
    colored = np.ptp(pixels, axis=2) > 60
    assert colored.mean() > 1e-3


def test_curves_show_the_motion_in_degrees(motion: Trajectory) -> None:
    axes = plotting.motion_figure(motion).axes
    assert [ax.get_ylabel() for ax in axes] == [
        "angle [deg]",
        "velocity [deg/s]",
        "torque [N m]",
    ]
    t, q = axes[0].lines[0].get_xdata(), axes[0].lines[0].get_ydata()
    drawn = np.isfinite(t)
    wanted = np.degrees(motion.configurations(t[drawn])[:, 0])
    np.testing.assert_allclose(q[drawn], wanted, atol=1e-9)
    np.testing.assert_array_equal(axes[0].lines[1].get_xdata()[::2], motion.t[:-1])


def test_torque_jumps_are_gaps(motion: Trajectory) -> None:
    line = plotting.motion_figure(motion).axes[2].lines[0]
    t, tau = np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
    breaks = np.flatnonzero(np.isnan(t))
    np.testing.assert_allclose(t[breaks - 1], motion.t[1:], atol=1e-15)
    right = motion.sample(motion.t[1:-1]).tau[:, 0]
    np.testing.assert_allclose(tau[breaks[:-1] + 1], right, atol=1e-12)
    assert np.abs(tau[breaks[:-1] - 1] - right).max() > 0.1


def test_the_legend_names_the_joints(motion: Trajectory) -> None:
    for figure in (plotting.motion_figure(motion), plotting.angles_figure(motion)):
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        assert texts == ["shoulder", "elbow"]


def test_curves_of_eighteen_joints_differ_and_the_legend_has_the_name_of_each(
    tmp_path: Path,
) -> None:
    (tmp_path / "arm.urdf").write_text(planar_chain.chain(18))
    arm = load_robot(tmp_path / "arm.urdf")
    figure = plotting.motion_figure(cubic_motion(Scene(arm, [Gravity(9.8)]))[0])
    curves = [line for line in figure.axes[0].lines if line.get_label() in arm.joint_names]
    looks = {line.get_label(): look(line) for line in curves}
    assert len(set(looks.values())) == len(looks) == 18
    (legend,) = figure.legends
    shown = zip(legend.get_lines(), legend.get_texts(), strict=True)
    assert {text.get_text(): look(line) for line, text in shown} == looks


def look(line: Line2D) -> tuple[object, object]:
    """Its color and its dashes, of which Matplotlib gives only a name."""
    return line.get_color(), str(line._unscaled_dash_pattern)  # type: ignore[attr-defined]


def test_nearby_limits_are_drawn_as_bands(motion: Trajectory) -> None:
    speed = motion.sample(np.linspace(0.0, motion.duration, 4001)).v[:, 1]
    low, high = float(speed.min()), float(speed.max())
    figure = plotting.motion_figure(with_limits(motion, v={"elbow": [low - 50.0, 1.01 * high]}))
    (line,) = lines(figure, 1, "limit")  # the lower bound is too far away
    np.testing.assert_allclose(line.get_ydata(), np.degrees(1.01 * high))
    assert figure.axes[1].patches
    assert not lines(figure, 0, "limit") + lines(figure, 2, "limit")
    assert [text.get_text() for text in figure.legends[0].get_texts()][2:] == ["limit"]
    assert figure.axes[1].get_title(loc="right") == ""


def test_a_curve_is_marked_where_it_is_at_a_limit(motion: Trajectory) -> None:
    speed = motion.sample(np.linspace(0.0, motion.duration, 4001)).v[:, 1]
    figure = plotting.motion_figure(with_limits(motion, v={"elbow": [-100.0, float(speed.max())]}))
    (mark,) = lines(figure, 1, "at a limit")
    marked = np.asarray(mark.get_ydata())
    marked = marked[np.isfinite(marked)]
    assert 0 < len(marked) < 1000
    assert marked.min() >= np.degrees(speed.max()) - 1e-3 * np.degrees(speed.max() + 100.0)
    assert "at a limit" in [text.get_text() for text in figure.legends[0].get_texts()]


def marked(figure: Figure) -> list[np.ndarray]:
    """What is marked as at a limit in each panel, in its unit."""
    found = [[np.asarray(x.get_ydata()) for x in lines(figure, k, "at a limit")] for k in range(3)]
    return [np.concatenate([np.zeros(0), *each]) for each in found]


@pytest.mark.parametrize(
    ("limits", "start", "goal", "duration"),
    [
        ({"q": 1.6}, hovi.State([1.0], [2.5]), 1.5, 1.2),
        ({"v": 1.8}, hovi.State([0.2]), 1.4, 0.8),
        ({"tau": 10.0}, hovi.State([0.2]), 1.4, 0.8),
    ],
    ids=["q", "v", "tau"],
)
def test_a_planned_motion_of_one_joint_is_marked_where_it_is_at_its_limit(
    pendulum: Robot, limits: dict[str, float], start: hovi.State, goal: float, duration: float
) -> None:
    given = {"limits": {"base": "none", **limits}, "self_collision": False}
    solution = hovi.plan(Scene(pendulum, [Gravity()]), start, [goal], duration, **given)
    values = marked(hovi.plot(solution))
    (kind, bound), *_ = limits.items()
    for name, found, unit in zip(
        ("q", "v", "tau"), values, (np.degrees(1.0),) * 2 + (1.0,), strict=True
    ):
        found = found[np.isfinite(found)] / unit
        assert (len(found) > 0) is (name == kind)
        assert (np.abs(np.abs(found) - bound) <= 2.1e-3 * bound).all()


def test_motions_of_continuous_joints_and_without_torques_are_marked_at_limits() -> None:
    robot = hovi.load_robot(chain([pin.JointModelRUBY(), pin.JointModelRX()]))
    goal = pin.integrate(robot.model, robot.neutral(), np.array([1.0, 0.5]))
    given = {"limits": {"base": "none", "v": {"j0": 1.1}}, "self_collision": False}
    turning = hovi.plan(Scene(robot), robot.neutral(), goal, 1.0, **given)
    bounds = np.full((4, 2), np.inf)
    bounds[1, 0] = 1.1
    ld = hovi.DiscreteLagrangian(
        hovi.spline(2), hovi.Grid.uniform(1.0, 8, hovi.schemes.galerkin(2))
    )
    ends, limits = (hovi.State([0.0, 0.0]), hovi.State([1.0, 0.5])), hovi.Limits(-bounds, bounds)
    without = hovi.solve(hovi.TrajectoryProblem(ld, *ends, limits))
    for solution, unit in ((turning, np.degrees(1.0)), (without, 1.0)):
        assert solution.success, solution.message
        q, v, tau = (x[np.isfinite(x)] / unit for x in marked(hovi.plot(solution)))
        assert len(v) > 0
        assert (np.abs(v - 1.1) <= 2.3e-3).all()
        assert len(q) == len(tau) == 0


def test_distant_limits_do_not_change_the_axis_range(motion: Trajectory) -> None:
    free = plotting.motion_figure(motion)
    figure = plotting.motion_figure(with_limits(motion, q=1000.0, v=1000.0, tau={"elbow": 1e5}))
    for k, sentence in enumerate(
        ["far from all limits", "far from all limits", "far from the limits of elbow"]
    ):
        assert not lines(figure, k, "limit")
        assert figure.axes[k].get_ylim() == free.axes[k].get_ylim()
        assert figure.axes[k].get_title(loc="right") == sentence


def test_joints_with_the_same_limit_share_a_dashed_line(motion: Trajectory) -> None:
    speed = np.abs(motion.sample(np.linspace(0.0, motion.duration, 4001)).v)
    bound = 1.001 * float(speed.max(axis=0).min())
    figure = plotting.motion_figure(with_limits(motion, v=bound))
    drawn = {(line.get_ydata()[0], line.get_color()) for line in lines(figure, 1, "limit")}
    assert len({color for _, color in drawn}) == 2
    np.testing.assert_allclose({abs(y) for y, _ in drawn}.pop(), np.degrees(bound))


@pytest.mark.parametrize("limits", [3, {}, {"lower": [[0]], "upper": [[1]], "tolerance": 1e-6}])
def test_invalid_limits_in_metadata_are_ignored(motion: Trajectory, limits: object) -> None:
    invalid = dataclasses.replace(motion, metadata={"limits": limits})
    assert len(plotting.motion_figure(invalid).legends[0].get_texts()) == 2


def test_prismatic_joints_get_an_axis_in_meters() -> None:
    robot = load_robot("panda")
    figure = plotting.motion_figure(cubic_motion(Scene(robot))[0])
    labels = {ax.get_ylabel() for ax in figure.axes}
    assert labels >= {"angle [deg]", "position [m]", "force [N]", "torque [N m]"}
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    fingers = [f"{name} (right)" for name in robot.joint_names[7:]]
    assert texts == [*robot.joint_names[:7], *fingers]


def zero_height(ax: Axes) -> float:
    low, high = ax.get_ylim()
    return -low / (high - low)


@pytest.mark.parametrize(
    ("one", "other"), [((0, 3), (-1, 1)), ((-4, 1), (-1, 4)), ((1, 3), (-2, -1)), ((-1, 2), (0, 9))]
)
def test_zeros_of_two_axes_are_aligned(one: tuple[int, int], other: tuple[int, int]) -> None:
    left = Figure().subplots()
    right = left.twinx()
    for ax, limits in ((left, one), (right, other)):
        ax.set_ylim(*limits)
    align_zeros(left, right)
    assert zero_height(left) == pytest.approx(zero_height(right), abs=1e-12)
    for ax, (low, high) in ((left, one), (right, other)):
        assert ax.get_ylim()[0] <= low
        assert ax.get_ylim()[1] >= high


def test_a_range_far_from_zero_is_unchanged() -> None:
    left = Figure().subplots()
    right = left.twinx()
    left.set_ylim(-1, 2)
    right.set_ylim(100, 101)
    align_zeros(left, right)
    assert (left.get_ylim(), right.get_ylim()) == ((-1, 2), (100, 101))


def test_sections_of_the_surface_are_the_links(motion: Trajectory, two_link: Robot) -> None:
    q = motion.configurations([1.0])
    shoulder, elbow, tip = plotting._chain(two_link, q)[:, 0]
    theta1, theta2 = q[0]
    np.testing.assert_allclose(shoulder, 0.0)
    np.testing.assert_allclose(elbow, [1.5 * np.cos(theta1), 0, 1.5 * np.sin(theta1)])
    forearm = [np.cos(theta1 + theta2), 0, np.sin(theta1 + theta2)]
    np.testing.assert_allclose(tip, elbow + forearm, atol=1e-15)


def test_the_surface_is_drawn_over_the_plane_of_the_motion(motion: Trajectory) -> None:
    (ax,) = plotting.surface_figure(motion, (0.5, 1.5)).axes
    labels = ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()  # type: ignore[attr-defined]
    assert labels == ("time [s]", "x [m]", "z [m]")


@pytest.mark.parametrize("window", [(1.0, 1.0), (-1.0, 1.0), (0.0, 2.1), (float("nan"), 1.0)])
def test_a_window_outside_the_motion_raises(
    motion: Trajectory, window: tuple[float, float]
) -> None:
    with pytest.raises(DisplayError, match="window"):
        plotting.surface_figure(motion, window)


def test_a_two_link_arm_gets_the_papers_pictures_and_others_do_not(
    motion: Trajectory, panda: Robot, tmp_path: Path
) -> None:
    names = [path.name for path in plotting.plot_all(motion, tmp_path / "arm.png")]
    assert names == ["arm.png", "arm_angles.png", "arm_surface.png"]
    other, _ = cubic_motion(Scene(panda))
    assert plotting.plot_all(other, tmp_path / "panda.png") == (tmp_path / "panda.png",)
    assert len(list(tmp_path.iterdir())) == 4


def test_a_motion_without_its_robot_is_drawn_in_si_units(two_link: Robot, tmp_path: Path) -> None:
    cubic_motion(Scene(load_robot(two_link.model)))[0].save(tmp_path / "motion.npz")
    loaded = Trajectory.load(tmp_path / "motion.npz")
    figure = plotting.motion_figure(loaded)
    assert [ax.get_ylabel().split(" ")[1] for ax in figure.axes] == ["[SI]"] * 3
    with pytest.raises(DisplayError, match="without its robot"):
        plotting.surface_figure(loaded)


def test_an_unknown_format_or_an_unwritable_path_raises(motion: Trajectory, tmp_path: Path) -> None:
    with pytest.raises(DisplayError, match=r"\.png, \.pdf, \.svg"):
        plotting.plot(motion, tmp_path / "motion.bmp")
    with pytest.raises(DisplayError, match="No such file or directory"):
        plotting.plot(motion, tmp_path / "no" / "motion.png")
    assert not list(tmp_path.iterdir())


def test_the_torque_of_a_taylor_scheme_is_drawn_without_zigzag() -> None:
    """Against a fine Galerkin solution; the interpolant's own torque is far off."""
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")), [hovi.effects.Gravity()])
    ends = [-np.pi / 2, 0.0], [0.3, 0.7], 1.0
    options = {"limits": "none", "processes": 1}
    motion = hovi.plan(scene, *ends, scheme="taylor-midpoint", intervals=100, **options).trajectory
    fine = hovi.plan(scene, *ends, tolerance=1e-9, **options).trajectory
    t = np.linspace(0.02, 0.98, 501)
    true, drawn = fine.sample(t).tau, scheme_torque(motion, t)
    assert drawn is not None
    assert scheme_torque(fine, t) is None
    interpolated = motion.sample(t).tau
    assert np.abs(drawn - true).max() < 0.4 * np.abs(interpolated - true).max()
    variation = [np.abs(np.diff(each, axis=0)).sum() for each in (true, drawn, interpolated)]
    assert variation[1] == pytest.approx(variation[0], rel=0.05)
    assert variation[2] > 2 * variation[0]


def test_seams_of_a_sequence_are_marked_and_its_segments_named() -> None:
    robot = hovi.load_robot(hovi.example("two_link.urdf"))
    given = [
        hovi.Segment([0.7, 0.9], 0.6, name="reach for $5$"),
        hovi.Segment([0.0, 0.0], 0.9, effects=[hovi.effects.Payload(frame="tip", mass=0.5)]),
    ]
    found = hovi.plan_sequence(
        hovi.Scene(robot), [0.0, 0.0], given, limits="none", scheme="galerkin-2", intervals=6
    )
    figure = plotting.motion_figure(found.trajectory)
    figure.canvas.draw()
    for ax in figure.axes:
        seams = [line for line in ax.lines if line.get_linestyle() == ":"]
        assert [line.get_xdata()[0] for line in seams] == pytest.approx([0.6])
    assert [text.get_text() for text in figure.axes[0].texts] == ["reach for $5$", "segment 2"]
    assert [text.xy[0] for text in figure.axes[0].texts] == pytest.approx([0.3, 1.05])


def test_names_of_segments_are_above_the_note_on_distant_limits() -> None:
    motion = _two_segments()
    assert motion.robot is not None
    far = [as_limits(motion.robot, {"base": "none", "q": 1000.0}).to_dict()] * 2
    figure = plotting.motion_figure(
        dataclasses.replace(motion, metadata={"segment_limits": far, SEGMENT_NAMES: ["a", "b"]})
    )
    figure.canvas.draw()
    ax = figure.axes[0]
    note = ax._right_title  # type: ignore[attr-defined]
    assert note.get_text() == "far from all limits"
    top = note.get_window_extent().y1
    assert all(text.get_window_extent().y0 > top for text in ax.texts)


def test_names_of_segments_from_a_file_that_do_not_fit_are_numbers() -> None:
    motion = _two_segments()
    for names in (["a"], ["a", 3], "ab", None, {"a": 1}):
        spans = motion_segments(dataclasses.replace(motion, metadata={SEGMENT_NAMES: names}))
        assert [each.name for each in spans] == ["segment 1", "segment 2"]
        assert [(each.begin, each.end) for each in spans] == [(0.0, 1.0), (1.0, 2.0)]
    named = dataclasses.replace(motion, metadata={SEGMENT_NAMES: ["a", "b"]})
    assert [each.name for each in motion_segments(named)] == ["a", "b"]


def _two_segments() -> hovi.Trajectory:
    scene = hovi.Scene(hovi.load_robot(hovi.example("two_link.urdf")))
    grid = hovi.Grid.uniform(1.0, 2, hovi.schemes.by_name("galerkin-2"))
    ld = hovi.DiscreteLagrangian(scene.effort_lagrangian(), grid)
    ends = hovi.State([0.0, 0.0]), hovi.State([0.3, 0.7])
    problem = hovi.TrajectoryProblem.of_segments([ld, ld], *ends)
    return problem.trajectory(problem.guess("cubic"))


def test_nodes_have_dots_where_curves_differ_and_not_among_too_many(tmp_path: Path) -> None:
    """The report of a robot of 48 joints has 0.3 MB of marks otherwise."""
    marks = []
    for joints in (3, 28, 29):
        (tmp_path / "chain.urdf").write_text(hovi.chain(joints))
        robot = load_robot(tmp_path / "chain.urdf")
        motion, _ = cubic_motion(Scene(robot, [Gravity()]))
        lines = plotting.motion_figure(motion).axes[0].lines
        marks.append(sum(line.get_marker() == "." for line in lines))
    assert marks == [3, 28, 0]
