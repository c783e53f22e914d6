"""What is measured of episodes that were written by hand, with the traps that such measurements fall into."""

import numpy as np
import pytest

from artigrasp.evaluation.articulation import ARTICULATION, ArticulationOutcomes, read_outcomes
from artigrasp.evaluation.grasping import GRASPING
from tests.evaluation import test_grasping
from tests.evaluation.trajectories import STEP_COUNT, Trajectory, play, through

OPEN = through(0.0, 0.9)
FAR = (3.0, 0.0, 0.0)

EPISODES = {
    # name: (trajectory, paper, released, strict)
    "opened and kept open": (Trajectory(angle=OPEN), True, True, True),
    "not opened far enough": (Trajectory(angle=through(0.0, 0.29)), False, False, False),
    "opened then fallen shut": (Trajectory(angle=through(0.0, 1.0, 0.1)), False, False, False),
    "flung open and back": (Trajectory(angle=through(0.0, 2.4, 1.0)), True, True, True),
    "flung open": (Trajectory(angle=through(0.0, 2.4)), True, False, True),
    "open at the start and left alone": (Trajectory(angle=1.2, start_angle=1.2), False, False, False),
    "open at the start and closed": (Trajectory(angle=through(1.2, 0.1), start_angle=1.2), True, True, True),
    "turned on the spot": (Trajectory(angle=OPEN, rotation=through((0, 0, 0), (0, 0, 3.1))), True, True, True),
    "turned more than once around": (
        Trajectory(angle=OPEN, rotation=through((0, 0, 0), (0, 0, 4 * np.pi + 0.1))), True, True, True,
    ),
    "slid away": (Trajectory(angle=OPEN, position=through((0, 0, 0), (0.03, -0.06, 0))), True, True, False),
    "slid and came back": (
        Trajectory(angle=OPEN, position=through((0, 0, 0), (0, 0.06, 0), (0, 0, 0))), True, True, False,
    ),
    "leant": (Trajectory(angle=OPEN, rotation=through((0, 0, 0), (0.29, 0, 0))), True, True, True),
    "toppled": (Trajectory(angle=OPEN, rotation=through((0, 0, 0), (0, -np.pi / 2, 0))), True, True, False),
    "toppled and set up again": (
        Trajectory(angle=OPEN, rotation=through((0, 0, 0), (0.4, 0, 0), (0, 0, 0))), True, True, False,
    ),
    "thrown": (Trajectory(angle=OPEN, position=through((0, 0, 0), (0, 0, 0.5), (0.5, 0.3, 0))), True, False, False),
    "lost": (Trajectory(angle=OPEN, position=through((0, 0, 0), FAR, (0, 0, 0))), False, False, False),
    "no number at the end": (Trajectory(angle=np.where(np.arange(STEP_COUNT) > 35, np.nan, OPEN)), False, False, False),
}  # fmt: skip


@pytest.fixture(scope="module", params=[False, True], ids=["plain", "flipped quaternions"])
def outcomes(request: pytest.FixtureRequest) -> dict[str, ArticulationOutcomes]:
    """What is read from each episode; a quaternion of the other sign changes nothing."""
    environment, quality = play([each[0] for each in EPISODES.values()], 1.0, flip_quaternions=request.param)
    everything = read_outcomes(environment, quality)
    rows = np.arange(len(EPISODES))
    return {name: everything.select(rows == index) for index, name in enumerate(EPISODES)}


@pytest.mark.parametrize("name", EPISODES)
def test_success(outcomes: dict[str, ArticulationOutcomes], name: str) -> None:
    """By each criterion, known by construction."""
    _, *expected = EPISODES[name]
    assert [bool(success(outcomes[name])[0]) for success in ARTICULATION.criteria.values()] == expected


@pytest.mark.parametrize(
    ("name", "column", "value"),
    [
        ("opened and kept open", "angle_error", 0.1),
        ("opened then fallen shut", "angle_error", 0.9),
        ("opened then fallen shut", "opened_once", True),
        ("not opened far enough", "opened_once", False),
        ("flung open", "angle_error", 1.4),
        ("open at the start and left alone", "angle_error", 0.2),
        ("open at the start and left alone", "opened_once", False),
        ("open at the start and closed", "initial_angle", 1.2),
        ("turned on the spot", "max_tilt", 0.0),
        ("turned more than once around", "max_tilt", 0.0),
        ("leant", "max_tilt", 0.29),
        ("toppled", "max_tilt", np.pi / 2),
        ("toppled and set up again", "max_tilt", 0.4),
        ("slid away", "final_displacement", np.hypot(0.03, 0.06)),
        # 32 steps of a straight way, then 8 at its end
        ("slid away", "mean_displacement", np.hypot(0.03, 0.06) * (sum(range(1, 33)) / 32 + 8) / 40),
        ("slid and came back", "final_displacement", 0.0),
        ("slid and came back", "max_displacement", 0.06),
        ("slid and came back", "mean_displacement", 0.06 * 16 / 40),
        ("thrown", "max_displacement", np.hypot(0.5, 0.3)),
        ("no number at the end", "final_angle", 0.9),
    ],
)
def test_measurements(outcomes: dict[str, ArticulationOutcomes], name: str, column: str, value: float) -> None:
    """To the precision of single floats; what came before a failure stays."""
    assert getattr(outcomes[name], column)[0] == pytest.approx(value, abs=2e-6)


def test_only_what_failed_is_marked(outcomes: dict[str, ArticulationOutcomes]) -> None:
    """An object that is lost on the way counts as failed even if it comes back."""
    assert [name for name, each in outcomes.items() if each.failed[0]] == ["lost", "no number at the end"]


def test_what_is_lifted_must_stay_up() -> None:
    """Lifted and held counts; lifted and dropped, never lifted enough, or lost on the way and back up does not."""
    up, down, low = (0.0, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.0, 0.09)
    trajectories = [
        Trajectory(position=through(down, up)),
        Trajectory(position=through(down, up, down)),
        Trajectory(position=through(down, up, low)),
        Trajectory(position=through(down, low)),
        Trajectory(position=through(down, (2.5, 0.0, 0.3), up)),
    ]
    environment, _ = play(trajectories, 1.0)
    summary = environment.episode_summary()
    # of the one that is lost it is what was measured before; the start is the target
    for name in ("lift", "position_error"):
        assert summary[name][:4] == pytest.approx([0.3, 0.0, 0.09, 0.09], abs=1e-6)
    outcomes = test_grasping.outcomes_of(5, lift=summary["lift"], failed=summary["failed"] > 0)
    assert GRASPING.criteria["paper"](outcomes).tolist() == [True, False, False, False, False]
