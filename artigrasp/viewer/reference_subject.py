"""References to be viewed, one at a time."""

from collections.abc import Sequence

import numpy as np

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.errors import UserError
from artigrasp.kernels.layout import HANDS, LINK_COUNT, PARTS
from artigrasp.motion.kinematics import posed_references, reference_link_poses
from artigrasp.motion.motion import Motion, MotionReference
from artigrasp.references.reference import ReferenceSet, load_references
from artigrasp.viewer.recording import Aim, Recording, Sample, Track
from artigrasp.viewer.subject import Picker

EVERY = "all"


class ReferenceSubject:
    """The references of some objects; see :class:`artigrasp.viewer.subject.Subject`."""

    status = ""
    is_live = False
    reward_terms = ()
    duration = 0.0

    def __init__(self, objects: Sequence[str]) -> None:
        """Show references of these objects.

        Raises:
            UserError: There are none of an object.
        """
        self.generation = 0
        self._objects = tuple(objects)
        self._chosen = {"Object": self._objects[0], "Kind": EVERY}
        self._load()

    @property
    def title(self) -> str:
        """The object."""
        return f"references of {self._chosen['Object']}"

    @property
    def pickers(self) -> Sequence[Picker]:
        """Object, kind and number."""
        kinds = (EVERY, *sorted(set(self._all.kind.tolist())))
        choices = {"Object": self._objects, "Kind": kinds, "Reference": tuple(self._names)}
        return [Picker(label, options, self._chosen[label]) for label, options in choices.items()]

    def pick(self, label: str, option: str) -> None:
        """Choose; another object or kind begins with its first reference."""
        self._chosen[label] = option
        if label == "Reference":
            self._show()
        else:
            self._load()

    def demand(self, time: float) -> float:
        """There is no time."""
        return 0.0

    def begin_anew(self) -> None:
        """There is nothing to begin."""

    def motion(self) -> Motion:
        """References do not move.

        Raises:
            UserError: Always.
        """
        raise UserError("references are no motion: generate one to save it")

    def close(self) -> None:
        """There is nothing to end."""

    def _load(self) -> None:
        self._all = load_references(self._chosen["Object"])
        kind = self._chosen["Kind"]
        if kind not in (EVERY, *self._all.kind):
            kind = self._chosen["Kind"] = EVERY
        self._rows = np.flatnonzero(np.isin(self._all.kind, [kind]) | (kind == EVERY))
        self._names = [_name(self._all, int(row)) for row in self._rows]
        self._chosen["Reference"] = self._names[0]
        self._show()

    def _show(self) -> None:
        row = int(self._rows[self._names.index(self._chosen["Reference"])])
        self.tracks = [reference_track(self._all.select(indices=row))]
        self.generation += 1


def reference_track(reference: ReferenceSet) -> Track:
    """A single reference as something that can be drawn: the hands that take part, the object where it begins."""
    object = load_object(reference.object)
    sides = [hand for hand, active in enumerate(reference.active[0]) if active]
    every_hand = [load_hand(reference.hand, side) for side in HANDS]
    links, parts = posed_references(reference, every_hand, object)
    force = np.zeros((len(sides), LINK_COUNT, len(PARTS), 3), np.float32)
    recording = Recording(1, [HANDS[side] for side in sides])
    recording.append(
        Sample(0.0, links[0, sides], parts, 0, float(reference.object_angle[0]), force, str(reference.kind[0]))
    )
    hands = [every_hand[side] for side in sides]
    part = reference.part[0, sides].astype(np.int64)
    pose = MotionReference(part, reference.wrist_pose_in_part[0, sides], reference.finger_angles[0, sides])
    aim = Aim(
        angle=None,
        object_pose=None,
        part=part,
        link_poses_in_part=reference_link_poses(pose, hands),
        contacts=reference.contacts[0, sides],
        active=np.ones(len(sides), bool),
        needs_ghost=False,
    )
    return Track(str(reference.source[0]), hands, [object], recording, aim)


def _name(references: ReferenceSet, row: int) -> str:
    return f"{row}: {references.split[row]} {references.kind[row]}, {references.source[row]}"
