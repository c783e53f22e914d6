"""Tests of tasks that are simulated while they are watched, without a browser."""

import time
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from artigrasp.config import SimulatorConfig
from artigrasp.controllers.controller import pd_ik_controller
from artigrasp.errors import UserError
from artigrasp.tasks import get_task
from artigrasp.viewer.live_subject import AHEAD, LiveSubject
from artigrasp.viewer.pilot import RunPilot, SteadyPilot

PATIENCE = 120.0


def wait_until(condition: Callable[[], object]) -> None:
    """Wait for the simulating thread."""
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


@pytest.fixture
def live() -> Iterator[LiveSubject]:
    """PD+IK in two worlds of the paper's task."""
    task = get_task("right-fixed")
    simulator = SimulatorConfig(threads=1)
    pilot = SteadyPilot(pd_ik_controller(task), "pd-ik")
    live = LiveSubject("right-fixed", pilot, ["lidded-box"], world_count=2, simulator=simulator)
    yield live
    live.close()


def test_simulates_as_far_as_somebody_watches(live: LiveSubject) -> None:
    """Nothing is simulated unasked, and no farther than a little ahead; then it waits, and goes on when asked."""
    time.sleep(0.1)
    assert not live.tracks and live.status == "preparing"
    live.demand(0.0)
    wait_until(lambda: live.demand(0.0) >= AHEAD)
    time.sleep(0.2)
    assert live.demand(0.0) == pytest.approx(AHEAD + 0.01, abs=0.0101)
    wait_until(lambda: live.demand(0.5) >= 0.5 + AHEAD)
    assert live.duration == pytest.approx(3.0)
    motion = live.motion()
    recording = live.tracks[0].recording
    row = recording.at(0.5)
    assert motion.time[-1] >= 0.5 and row.hinge_angle == motion.hinge_angle[50]
    assert set(row.signals) >= {"keypoint", "contact"}
    assert live.tracks[0].metrics["final_angle"] == pytest.approx(recording.at(0.75).hinge_angle, abs=1e-6)


def test_worlds_and_episodes(live: LiveSubject) -> None:
    """Worlds of one episode can be looked at in turn; another episode begins when it is asked for."""
    live.demand(0.0)
    wait_until(lambda: live.tracks and live.demand(0.0) > 0.1)
    first, generation = live.tracks[0], live.generation
    live.pick("Environment", "1")
    assert live.generation > generation and live.tracks[0] is not first
    assert not np.array_equal(live.tracks[0].recording.at(0.1).link_poses, first.recording.at(0.1).link_poses)
    generation = live.generation
    live.begin_anew()
    wait_until(lambda: live.generation > generation)
    assert live.tracks[0].label == "environment 1"
    # nothing is left of the episode before
    assert not any(live.tracks[0].recording.at(0.0).signals.values())


def test_run_without_policy(tmp_path: Path) -> None:
    """A run that has no policy yet is said to have none; nothing ends."""
    pilot = RunPilot(tmp_path)
    with pytest.raises(UserError, match="expected a policy file, found none"):
        pilot.controller()
    live = LiveSubject("a run", pilot, ["lidded-box"])
    live.demand(0.0)
    wait_until(lambda: "found none" in live.status)
    live.close()


def test_newest_policy_takes_over(tmp_path: Path) -> None:
    """The policy of a run is read again when it was written anew, and only then."""
    from artigrasp.assets.library import packaged_root

    shipped = (packaged_root() / "policies" / "lidded-box.pt").read_bytes()
    pilot = RunPilot(tmp_path)
    (tmp_path / "policy.pt").write_bytes(shipped)
    first = pilot.controller()
    assert pilot.controller() is first and "iteration" in pilot.label
    # atomic writes replace the file
    (tmp_path / "new.pt").write_bytes(shipped)
    (tmp_path / "new.pt").replace(tmp_path / "policy.pt")
    assert pilot.controller() is not first
