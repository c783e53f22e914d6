"""Stories that are told in simulation."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.library import find_file
from artigrasp.cli import main
from artigrasp.config import SimulatorConfig
from artigrasp.config.story import CloseStep, MoveStep, OpenStep, PlacedObject, StoryConfig
from artigrasp.controllers.controller import PolicyController
from artigrasp.controllers.policy_file import load_policy
from artigrasp.motion.file import load_motion
from artigrasp.motion.motion import Motion
from artigrasp.stories.recording import story_motion
from artigrasp.stories.teller import Teller, TellerSettings

BOX = StoryConfig(
    objects={"box": PlacedObject("open-box", (0.1, 0.05), yaw=0.3)},
    steps=(OpenStep(open="box", to=1.2, hand="left", hold=True), CloseStep(close="box")),
)
PLAIN = TellerSettings(rollouts=1)
TWO_THREADS = SimulatorConfig(threads=2)


@pytest.fixture(autouse=True)
def only_what_is_shipped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """No assets of the user's own."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ARTIGRASP_ASSETS", str(tmp_path / "none"))


def test_a_bottle_is_put_into_a_box_that_is_closed_over_it(capsys: pytest.CaptureFixture[str]) -> None:
    """The shipped story, objects standing a little elsewhere: one hand holds the lid up while the other works.

    The motion shows all objects, and nothing jumps between steps.
    """
    scattered = ["--start-shift", "0.03", "--start-turn", "0.3", "--seed", "1"]
    assert main(["tell", "ketchup-into-box", "--search", "1", *scattered, "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert result["done"] and result["problem"] == "" and len(result["steps"]) == 4
    assert result["metrics"]["steps_done"] == 4 and result["metrics"]["3 position_error"] < 0.08
    motion = load_motion(Path("story.npz"))
    np.testing.assert_allclose(np.diff(motion.time), 0.01, atol=1e-9)
    bystanders = motion.bystanders
    assert bystanders is not None and bystanders.objects == ("open-ketchup-bottle",)
    assert (motion.object, list(dict.fromkeys(bystanders.focus))) == ("open-box", [0, 1])
    assert list(dict.fromkeys(str(phase).split(":")[0] for phase in motion.phases)) == ["box", "bottle"]
    lid = motion.hinge_angle[bystanders.focus == 1]
    assert lid.min() > 1.1 and lid.max() < 1.7, "it would fall shut"
    assert motion.hinge_angle[-1] < 0.1
    inside = bystanders.pose[-1, 0, :3] - motion.object_pose[-1, :3]
    assert (np.abs(inside) < [0.14, 0.1, 0.136]).all()
    ways = np.linalg.norm(np.diff(motion.joint_q[:, :, :3], axis=0), axis=-1)
    assert ways.max() < 0.03, "nothing is reset between steps"
    assert np.abs(np.diff(bystanders.pose[:, 0, :3], axis=0)).max() < 0.03
    np.testing.assert_allclose(wrists(motion)[-1], [[-0.35, -0.35, 0.25], [0.35, -0.35, 0.25]], atol=0.05)


def wrists(motion: Motion) -> Array:
    """Positions of the wrists in the world, [sample, hand, 3]."""
    sides = zip(motion.hand_base, np.moveaxis(motion.joint_q[..., :3], 1, 0), strict=True)
    return np.stack([base[:3] + Rotation.from_quat(base[3:]).apply(shift) for base, shift in sides], axis=1)


def test_a_story_that_fails_is_shown_as_far_as_it_goes() -> None:
    """With the step and what was missed; the way back to other ways of the step before was taken."""
    impossible = replace(BOX.steps[1], to=0.5, tolerance=1e-6)
    teller = Teller(replace(BOX, steps=(BOX.steps[0], impossible)), PLAIN, TWO_THREADS)
    tale = teller.tell()
    assert not tale.is_whole and [take.success for take in tale.takes] == [True, False]
    assert tale.problem.startswith("2. close box: none of 1 references did it; the nearest: angle error")
    assert tale.tried > len(teller.references[0].select(kind="articulate", hands=("left",)))
    motion = story_motion(tale, teller)
    assert motion.bystanders is None and motion.metrics["success"] == 0.0 and motion.metrics["steps_done"] == 1.0
    assert motion.provenance["problem"] == tale.problem
    assert 0.9 < motion.hinge_angle.max() < 1.3


def test_a_step_that_no_hand_is_free_for_is_told() -> None:
    """Nothing was tried of it."""
    story = replace(BOX, steps=(BOX.steps[0], MoveStep(move="box", to=(0.2, 0.0, 0.0))))
    tale = Teller(story, PLAIN, TWO_THREADS).tell()
    assert not tale.is_whole and len(tale.takes) == 1
    assert "expected a grasp reference of the right hand, which is free, found none" in tale.problem


def test_search_finds_what_no_reference_does_by_itself() -> None:
    """Here: to open the lid to within two hundredths."""
    exact = StoryConfig(BOX.objects, (OpenStep(open="box", to=0.8, hand="left", hold=True, tolerance=0.02),))
    assert not Teller(exact, PLAIN, TWO_THREADS).tell().is_whole
    tale = Teller(exact, TellerSettings(rollouts=17), TWO_THREADS).tell()
    assert tale.is_whole and abs(tale.takes[0].summary["final_angle"] - 0.8) < 0.02


def test_policies_act_first_where_they_have_learned_to_and_hold_nothing_yet(capsys: pytest.CaptureFixture[str]) -> None:
    """Here: to open; PD+IK closes what the policy holds open. One that has not learned a skill is refused."""
    policy = PolicyController(load_policy(find_file("policies", "open-set-articulate")))
    tale = Teller(BOX, PLAIN, TWO_THREADS, [policy]).tell()
    assert tale.is_whole and [take.controller for take in tale.takes] == ["policy", "pd-ik"]
    assert abs(tale.takes[0].summary["final_angle"] - 1.2) < 0.2
    assert main(["tell", "ketchup-into-box", "--grasp-policy", "open-set-articulate"]) == 2
    assert "expected one that learned to grasp, found one for articulate" in capsys.readouterr().err
