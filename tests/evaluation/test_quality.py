"""How well motions are made, of episodes that were written by hand."""

import numpy as np
import pytest

from artigrasp.evaluation.quality import ADD_LIMIT, DEPTH_INTERVAL, area_under_curve
from artigrasp.kernels.layout import FINGER_DOF_COUNT, WRIST_DOF_COUNT
from artigrasp.references.hand_distance import link_distances
from tests.evaluation.trajectories import STEP_COUNT, Trajectory, play

TIME = 0.01 * np.arange(1, STEP_COUNT + 1)
AXIS = np.array([0.6, 0.0, 0.8])
STEPS = np.arange(STEP_COUNT)[:, None]
LINKS = np.arange(16)
EPISODES = {
    "still": Trajectory(),
    "cubic": Trajectory(wrist=7.0 * TIME[:, None] ** 3 * AXIS),
    "quadratic": Trajectory(wrist=3.0 * TIME[:, None] ** 2 * AXIS),
    # links 1 and 2 from step 10 on
    "steady": Trajectory(force=np.where((STEPS >= 10) & np.isin(LINKS, [1, 2]), 2.0, 0.0)),
    # link 1 always, link 2 every other step
    "flickering": Trajectory(force=np.where((LINKS == 1) | ((LINKS == 2) & (STEPS % 2 == 0)), 2.0, 0.0)),
    # link 1 for 10 of the 40 steps, then never again
    "let go": Trajectory(force=np.where((STEPS < 10) & (LINKS == 1), 2.0, 0.0)),
    "opened": Trajectory(angle=0.7),
    "pushed": Trajectory(position=(0.03, 0.0, 0.0), angle=1.0),
    "turned": Trajectory(rotation=(0.0, 0.0, 0.2), angle=1.0),
    "lost": Trajectory(position=(5.0, 0.0, 0.0), angle=1.0),
    "no number": Trajectory(angle=np.nan),
    # fingers first, past the reference and into the box
    "pierced": Trajectory(wrist=np.where(STEPS >= 19, [[-0.15, 0.0, 0.0]], 0.0)),
}
GOAL = 1.0


@pytest.fixture(scope="module")
def played() -> tuple[object, dict[str, dict[str, float]]]:
    """The environment, and what is told of every episode."""
    environment, quality = play(list(EPISODES.values()), GOAL)
    columns = quality.columns()
    return environment, {
        name: {key: float(values[index]) for key, values in columns.items()} for index, name in enumerate(EPISODES)
    }


@pytest.fixture(scope="module")
def told(played: tuple[object, dict[str, dict[str, float]]]) -> dict[str, dict[str, float]]:
    """What is told of every episode."""
    return played[1]


def test_everything_is_a_number(told: dict[str, dict[str, float]]) -> None:
    """Whatever the physics did."""
    for name, columns in told.items():
        assert all(np.isfinite(value) and value >= 0.0 for value in columns.values()), name


def test_jerk(told: dict[str, dict[str, float]]) -> None:
    """The third derivative of c t³ is 6 c, that of a quadratic nought, to the precision of single floats."""
    # the first two thirds differences see the pose of the reset, which lies on the curve too
    assert told["cubic"]["jerk"] == pytest.approx(42.0, rel=0.02)
    assert told["still"]["jerk"] < 0.05
    assert told["quadratic"]["jerk"] < 0.1


def test_contact_consistency(told: dict[str, dict[str, float]]) -> None:
    """The share of touching links that two steps have in common, from the first contact on."""
    assert told["still"]["contact_consistency"] == 0.0
    assert told["steady"]["contact_consistency"] == pytest.approx(29 / 30)
    # at the first step all contacts are new; then one of two links stays
    assert told["flickering"]["contact_consistency"] == pytest.approx(39 * 0.5 / 40)
    assert told["let go"]["contact_consistency"] == pytest.approx(9 / 40)


def test_average_distances(played: tuple[object, dict[str, dict[str, float]]]) -> None:
    """Chords for a part that turns about the hinge or the vertical, the way for one that is pushed."""
    environment, told = played
    base, lid = environment.objects[0].parts  # type: ignore[attr-defined]
    model = environment.objects[0]  # type: ignore[attr-defined]

    def chord(points: np.ndarray, origin: np.ndarray, axis: np.ndarray, angle: float) -> float:
        arms = np.linalg.norm(np.cross(points - origin, axis), axis=1)
        return float((2.0 * arms * np.sin(angle / 2.0)).mean())

    assert told["opened"]["base_distance"] == 0.0
    expected = chord(lid.vertices, model.hinge_origin, model.hinge_axis, GOAL - 0.7)
    assert told["opened"]["articulated_distance"] == pytest.approx(expected, abs=1e-6)
    for part in ("base", "articulated"):
        assert told["pushed"][f"{part}_distance"] == pytest.approx(0.03, abs=1e-6)
        assert told["lost"][f"{part}_distance"] == told["no number"][f"{part}_distance"] == ADD_LIMIT
    expected = chord(base.vertices, np.zeros(3), np.array([0.0, 0.0, 1.0]), 0.2)
    assert told["turned"]["base_distance"] == pytest.approx(expected, abs=1e-6)


def test_area_under_curve() -> None:
    """It is what integrating the accuracy over thresholds gives."""
    distances = np.array([0.0, 0.02, 0.075, 0.1, 3.0])
    thresholds = np.linspace(0.0, ADD_LIMIT, 100_001)
    expected = (distances[:, None] < thresholds).mean(axis=1)
    np.testing.assert_allclose(area_under_curve(distances), expected, atol=2e-5)


def test_penetration(played: tuple[object, dict[str, dict[str, float]]]) -> None:
    """The deepest link's overlap, mean over what was measured: at steps 0 and 10 there was none, then thrice this."""
    environment, told = played
    assert told["still"]["penetration"] == 0.0
    world = list(EPISODES).index("pierced")
    hands = environment.state.hands  # type: ignore[attr-defined]
    joint_q = hands.joint_q.numpy()[world]
    link_pose = hands.link_pose.numpy()[world]
    assert not environment.state.objects.pose.numpy()[world, :6].any(), "so that world and base agree"  # type: ignore[attr-defined]
    distance = link_distances(
        environment.objects[0],  # type: ignore[attr-defined]
        environment.hands,  # type: ignore[attr-defined]
        link_pose[None, :, 0],
        joint_q[None, :, WRIST_DOF_COUNT:].reshape(1, 1, FINGER_DOF_COUNT),
        np.zeros(1),
    )
    depth = -float(distance.min())
    assert depth > 0.005
    assert told["pierced"]["penetration"] == pytest.approx(3 * depth / (STEP_COUNT // DEPTH_INTERVAL + 1), rel=1e-3)
