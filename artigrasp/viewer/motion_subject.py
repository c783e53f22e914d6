"""Motions to be viewed, one or several side by side."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from artigrasp.assets.hand import HandModel
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.export.bodies import load_models
from artigrasp.kernels.layout import HANDS
from artigrasp.motion.kinematics import link_poses, part_poses, pose_object, reference_link_poses
from artigrasp.motion.motion import Motion
from artigrasp.references.reference import load_references
from artigrasp.viewer.recording import Aim, Recording, Sample, Track
from artigrasp.viewer.subject import Picker


class MotionSubject:
    """Motions on one timeline, as long as the longest of them.

    See :class:`artigrasp.viewer.subject.Subject`.
    """

    status = ""
    generation = 0
    is_live = False
    reward_terms = ()

    def __init__(self, motions: Sequence[tuple[str, Motion]]) -> None:
        """Show these motions, each with a label.

        Raises:
            UserError: The hand or the object of one is not among the assets.
        """
        self.title = "  |  ".join(label for label, _ in motions)
        self.tracks = [motion_track(label, motion) for label, motion in motions]
        self.duration = max(track.recording.duration for track in self.tracks)
        self.pickers: tuple[Picker, ...] = ()
        self._motion = motions[0][1]

    def pick(self, label: str, option: str) -> None:
        """There is nothing to pick."""

    def demand(self, time: float) -> float:
        """All is there."""
        return self.duration

    def begin_anew(self) -> None:
        """There is only this one."""

    def motion(self) -> Motion:
        """The first motion."""
        return self._motion

    def close(self) -> None:
        """There is nothing to end."""


def motion_track(label: str, motion: Motion) -> Track:
    """A motion as something that can be drawn.

    Raises:
        UserError: Its hand or an object is not among the assets.
    """
    hands, object = load_models(motion)
    objects, parts = [object], [part_poses(motion, object)]
    count = len(motion.time)
    focus = np.zeros(count, np.int64)
    angles = [motion.hinge_angle]
    if (beside := motion.bystanders) is not None:
        focus = beside.focus
        for index, name in enumerate(beside.objects):
            objects.append(load_object(name))
            angles.append(beside.hinge_angle[:, index])
            parts.append(pose_object(beside.pose[:, index], angles[-1], objects[-1]))
    links = link_poses(motion, hands)
    recording = Recording(count, motion.hands, len(objects))
    for row, time in enumerate(motion.time):
        recording.append(
            Sample(
                time=float(time),
                link_poses=links[row],
                part_poses=np.stack([poses[row] for poses in parts]),
                focus=int(focus[row]),
                hinge_angle=float(angles[focus[row]][row]),
                contact_force=motion.contact_force[row],
                phase=str(motion.phases[row]),
            )
        )
    return Track(label, hands, objects, recording, _aim(motion, hands), motion.stage, dict(motion.metrics))


def moved_target(target: NDArray[np.floating] | None, start: NDArray[np.floating]) -> NDArray[np.floating] | None:
    """The pose that an object should reach, None if that is where it starts."""
    if target is None or (np.allclose(target[:3], start[:3], atol=2e-3) and abs(target[3:] @ start[3:]) > 0.9999):
        return None
    return target


def _aim(motion: Motion, hands: Sequence[HandModel]) -> Aim | None:
    reference = motion.reference
    if reference is None:
        return None
    contacts, active = _known_of_reference(motion)
    return Aim(
        angle=motion.target_angle,
        object_pose=moved_target(motion.target_object_pose, motion.object_pose[0]),
        part=reference.part,
        link_poses_in_part=reference_link_poses(reference, hands),
        contacts=contacts,
        active=active,
    )


def _known_of_reference(motion: Motion) -> tuple[NDArray[np.bool_] | None, NDArray[np.bool_]]:
    """Links that should touch in the reference that a motion names, and hands that take part in it.

    A motion does not tell; if the reference is not among the assets, no links are known and all hands take part.
    """
    unknown = None, np.ones(len(motion.hands), bool)
    try:
        references = load_references(motion.object)
    except UserError:
        return unknown
    rows = np.flatnonzero(references.source == motion.provenance.get("reference"))
    sides = [HANDS.index(side) for side in motion.hands]
    return (references.contacts[rows[0]][sides], references.active[rows[0]][sides]) if len(rows) else unknown
