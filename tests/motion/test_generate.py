"""Generated motions: what was simulated, told whole."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import warp as wp

from artigrasp.config import ActionConfig, StageConfig
from artigrasp.controllers.controller import ZeroController, pd_ik_controller
from artigrasp.environment.environment import Environment
from artigrasp.environment.worlds import planned_worlds, trial_worlds
from artigrasp.motion.file import load_motion, save_motion
from artigrasp.motion.generate import MotionRecorder, generate, phase_name
from artigrasp.tasks import get_task
from tests.environment.examples import TWO_THREADS, play, random_actions
from tests.example_references import RIGHT, box_references

PAPER = get_task("right-fixed")


def test_pd_ik_opens_the_box_in_a_motion(tmp_path: Path) -> None:
    """A sample per control step and one for the start; the lid ends where the metrics say; the file keeps it all."""
    steps: list[int] = []
    reference = box_references(test_count=2).select(split="test", indices=1)
    motion = generate(pd_ik_controller(PAPER), reference, 1.25, seed=7, on_step=steps.append)
    assert steps == list(range(301)) and len(motion.time) == 301
    np.testing.assert_allclose(motion.time, np.arange(301) / 100)
    assert (motion.hands, motion.hand, motion.object, motion.target_angle) == (("right",), "open", "lidded-box", 1.25)
    assert motion.hinge_angle[0] == 0.0 and motion.hinge_angle[-1] > 0.3
    assert motion.metrics["final_angle"] == pytest.approx(float(motion.hinge_angle[-1]), abs=1e-6)
    assert motion.metrics["angle_error"] == pytest.approx(abs(1.25 - float(motion.hinge_angle[-1])), abs=1e-5)
    assert motion.metrics["success"] == 1.0 and motion.metrics["failed"] == 0.0
    assert list(dict.fromkeys(motion.phases)) == ["approach", "grasp", "articulate"]
    assert not motion.contact_force[0].any() and np.abs(motion.contact_force[-1]).max() > 0.1
    assert motion.reference is not None and motion.reference.part.tolist() == [1]
    np.testing.assert_array_equal(motion.reference.finger_angles, reference.finger_angles[0, [RIGHT]])
    np.testing.assert_allclose(motion.reference.wrist_pose_in_part, reference.wrist_pose_in_part[0, [RIGHT]], atol=1e-6)
    expected = {"task": "right-fixed", "controller": "pd-ik", "reference": "made by hand 4", "seed": "7"}
    assert expected.items() <= motion.provenance.items() and "mujoco" in motion.provenance
    save_motion(tmp_path / "motion.npz", motion)
    np.testing.assert_array_equal(load_motion(tmp_path / "motion.npz").joint_q, motion.joint_q)


def test_the_same_call_gives_the_same_motion() -> None:
    """Nothing is left to chance."""
    task = replace(PAPER, episode_steps=40)
    first, second = (generate(pd_ik_controller(task), box_references().select(indices=0), 1.0) for _ in range(2))
    for name in ("joint_q", "hinge_angle", "contact_force", "hand_base"):
        np.testing.assert_array_equal(getattr(first, name), getattr(second, name))


def test_one_of_many_worlds_is_recorded() -> None:
    """The recorder follows its world, whatever set its reference is in, and keeps copies."""
    references = [box_references(), box_references(test_count=1).select(indices=[3, 2])]
    environment = Environment(
        PAPER, references, trial_worlds(references, [0.5, 1.0]), noise=False, simulator=TWO_THREADS
    )
    environment.reset()
    recorder = MotionRecorder(environment, world=8)
    seen = []
    for step in range(3):
        recorder.record(step)
        seen.append(environment.state.hands.joint_q.numpy()[8].copy())
        play(environment, random_actions(environment, 1, seed=step))
    motion = recorder.motion(ZeroController(PAPER), seed=0)
    base = environment.state.hands.hand_base.numpy()[8].copy()
    environment.reset(wp.full(environment.world_count, 1, dtype=int, device=environment.device))
    environment.state.hands.hand_base.zero_()
    np.testing.assert_array_equal(motion.joint_q, seen)
    assert (motion.joint_q[0] != motion.joint_q[2]).any()
    np.testing.assert_array_equal(motion.hand_base, base)
    assert motion.provenance["reference"] == "made by hand 2" and motion.target_angle == 0.5


def test_the_whole_scene_is_recorded() -> None:
    """Bystanders, which of the objects the hands are about, the stage, and where the object should go."""
    references = [box_references().select(indices=[0])]
    offset = np.array([[0.1, 0.0, 0.2, 0.0, 0.0, 0.0, 1.0]])
    worlds = planned_worlds(references, [0], [0], 1.0, target_offset=offset)
    stage = StageConfig(0.03, (0.2, 0.2), (0.5, 0.0))
    environment = Environment(
        replace(get_task("both-free"), stage=stage), references, worlds, bystanders=references, noise=False,
        simulator=TWO_THREADS,
    )  # fmt: skip
    place = np.array([0.5, 0.0, 0.2, 0.0, 0.0, 1.0, 0.0], np.float32)
    environment.place_bystander(1, place, 0.4)
    environment.reset()
    recorder = MotionRecorder(environment, world=0)
    for step in range(3):
        recorder.record(step)
        environment.set_focus(1)
        play(environment, random_actions(environment, 1, seed=step))
    motion = recorder.motion(ZeroController(environment.task), seed=0)
    assert motion.stage == stage and motion.bystanders is not None
    assert motion.bystanders.objects == ("lidded-box",) and motion.bystanders.focus.tolist() == [0, 1, 1]
    np.testing.assert_allclose(motion.bystanders.pose[0, 0], place, atol=1e-6)
    assert motion.bystanders.hinge_angle[0, 0] == pytest.approx(0.4) and motion.bystanders.pose[2, 0, 2] < place[2]
    np.testing.assert_allclose(motion.object_pose[2], motion.object_pose[0], atol=2e-3)
    assert motion.target_object_pose is not None
    np.testing.assert_allclose(
        motion.target_object_pose, motion.object_pose[0] + offset[0] - [0, 0, 0, 0, 0, 0, 1], atol=1e-6
    )


def test_a_motion_has_one_reference() -> None:
    """A set of several is a mistake of the caller's."""
    with pytest.raises(ValueError, match="references: expected exactly one, found 3"):
        generate(ZeroController(PAPER), box_references(), 1.0)


def test_phases_follow_the_prior() -> None:
    """Closing begins the grasp, the lead on the hinge the articulation; the paper's action articulates throughout."""
    action = ActionConfig(finger_prior="reference", close_start=30, lead_start=70)
    assert [phase_name(action, step) for step in (0, 29, 30, 69, 70, 300)] == [
        "approach", "approach", "grasp", "grasp", "articulate", "articulate"
    ]  # fmt: skip
    assert {phase_name(ActionConfig(), step) for step in (0, 300)} == {"articulate"}
