"""Tests of recordings and of the subjects that need no simulation."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS
from artigrasp.motion.kinematics import link_poses
from artigrasp.references.reference import load_references
from artigrasp.viewer.motion_subject import MotionSubject, motion_track, moved_target
from artigrasp.viewer.reference_subject import ReferenceSubject
from tests.motion.example import example_motion


def test_samples_of_a_motion() -> None:
    """At every time the last sample that is not later is shown, with all that the motion has."""
    motion = example_motion(hands=("left", "right"))
    recording = motion_track("a", motion).recording
    links = link_poses(motion, [load_hand("open", side) for side in HANDS])
    for time, row in ((0.0, 0), (0.0199, 1), (0.02, 2), (9.0, 4)):
        sample = recording.at(time)
        assert sample.time == pytest.approx(0.01 * row)
        np.testing.assert_array_equal(sample.link_poses, links[row])
        np.testing.assert_array_equal(sample.contact_force, motion.contact_force[row])
        assert sample.hinge_angle == motion.hinge_angle[row] and sample.phase == motion.phases[row]


def test_curves() -> None:
    """The hinge in degrees and the net force of each hand are there to be plotted."""
    motion = example_motion(hands=("left", "right"))
    times, curves = motion_track("a", motion).recording.curves()
    np.testing.assert_allclose(times, motion.time)
    np.testing.assert_allclose(curves["hinge angle"], np.degrees(motion.hinge_angle))
    force = np.linalg.norm(motion.contact_force[:, 1].sum(axis=(1, 2)), axis=-1)
    np.testing.assert_allclose(curves["force right"], force, rtol=1e-6)


def test_side_by_side() -> None:
    """Motions side by side share a timeline as long as the longest of them; the first is what is saved."""
    motions = [("a", example_motion(sample_count=3)), ("b", example_motion(hands=("left", "right"), sample_count=6))]
    subject = MotionSubject(motions)
    assert subject.duration == pytest.approx(0.05)
    assert [track.label for track in subject.tracks] == ["a", "b"]
    assert subject.motion() is motions[0][1]


def test_target_that_moves() -> None:
    """Only a target other than the start is one to carry the object to, whatever the sign of the quaternion."""
    turn = Rotation.from_euler("z", 0.3).as_quat()
    start = np.array([0.1, 0.2, 0.3, *turn])
    assert moved_target(None, start) is None
    assert moved_target(np.array([0.1, 0.2, 0.3, *-turn]), start) is None
    for target in ([0.11, *start[1:]], [0.1, 0.2, 0.3, 0, 0, 0, 1]):
        np.testing.assert_array_equal(moved_target(np.array(target), start), target)


def test_references() -> None:
    """Each reference can be picked; it shows the hands that take part and what they should touch."""
    references = load_references("lidded-box")
    subject = ReferenceSubject(["lidded-box"])
    generation = subject.generation
    labels = {picker.label: picker for picker in subject.pickers}
    assert len(labels["Reference"].options) == len(references)
    row = int(np.flatnonzero(references.kind == "grasp")[0])
    subject.pick("Reference", labels["Reference"].options[row])
    assert subject.generation > generation
    track = subject.tracks[0]
    assert len(track.hands) == references.active[row].sum()
    assert track.aim is not None and track.aim.contacts is not None
    np.testing.assert_array_equal(track.aim.contacts, references.contacts[row][references.active[row]])
    subject.pick("Kind", "articulate")
    assert all("articulate" in option for option in subject.pickers[2].options)
    with pytest.raises(UserError, match="generate one"):
        subject.motion()


def test_reference_ghost_is_where_the_hands_are() -> None:
    """A reference's hands and its ghost, which rides on the part, are at the same place."""
    track = ReferenceSubject(["lidded-box"]).tracks[0]
    sample, aim = track.recording.at(0.0), track.aim
    assert aim is not None
    for hand, part in enumerate(aim.part):
        pose = sample.part_poses[0, part]
        links = Rotation.from_quat(pose[3:]).apply(aim.link_poses_in_part[hand, :, :3]) + pose[:3]
        np.testing.assert_allclose(links, sample.link_poses[hand, :, :3], atol=1e-5)
