"""References of the other hand, on objects that are their own mirror images."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import MIRROR_POSITION
from artigrasp.references.natural_pose import mirror_fingers
from artigrasp.references.reference import ReferenceSet
from artigrasp.references.synthesis.grip import RestingObject

TOLERANCE = 5e-4
"""A vertex has a mirror image if there is one no farther from where it should be [m]."""
MASS_TOLERANCE = 0.01
"""A centre of mass may be off the plane by this share of the part's size, and an inertia by that share of itself."""


@dataclass(frozen=True, eq=False)
class MirrorPlane:
    """A plane in the frame of both parts.

    Attributes:
        normal: Unit vector, shape (3,).
        offset: Of the plane from the origin along it [m].
    """

    normal: Array
    offset: float

    @property
    def reflection(self) -> Array:
        """What it does to vectors, shape (3, 3)."""
        return np.eye(3) - 2 * np.outer(self.normal, self.normal)

    def points(self, points: Array) -> Array:
        """Mirror images of points [..., 3]."""
        return np.asarray(points @ self.reflection + 2 * self.offset * self.normal)

    def wrists(self, poses: NDArray[np.floating]) -> Array:
        """Where the other side's hand has its wrist in the mirror, from poses [..., 7]."""
        flat = poses.reshape(-1, 7).astype(np.float64)
        turns = self.reflection @ Rotation.from_quat(flat[:, 3:]).as_matrix() @ np.diag(MIRROR_POSITION)
        mirrored = np.concatenate(
            [self.points(flat[:, :3]), Rotation.from_matrix(turns).as_quat(canonical=True)], axis=1
        )
        return mirrored.reshape(poses.shape)


def find_mirror_plane(resting: RestingObject) -> MirrorPlane | None:
    """The upright plane across the hinge that an object is its own mirror image in, or None.

    Surfaces count vertex by vertex; masses, too. A hinge keeps its axis and its sense in no other plane.
    """
    model = resting.model
    normal = model.hinge_axis
    if abs(normal @ resting.up) > 1e-3:
        return None
    every = np.concatenate([part.vertices for part in model.parts])
    along = every @ normal
    plane = MirrorPlane(normal, float(along.min() + along.max()) / 2)
    for part in model.parts:
        distance, _ = KDTree(part.vertices).query(plane.points(part.vertices))
        inertia = plane.reflection @ part.inertia @ plane.reflection
        size = float(np.ptp(part.vertices, axis=0).max())
        if (
            distance.max() > TOLERANCE
            or abs(part.com @ normal - plane.offset) > MASS_TOLERANCE * size
            or np.abs(inertia - part.inertia).max() > MASS_TOLERANCE * np.abs(part.inertia).max()
        ):
            return None
    return plane


def mirror_references(references: ReferenceSet, plane: MirrorPlane) -> ReferenceSet:
    """What the other hands do in the mirror."""
    swapped = {name: getattr(references, name)[:, ::-1].copy() for name in ("active", "part", "contacts")}
    return replace(
        references,
        wrist_pose_in_part=plane.wrists(references.wrist_pose_in_part[:, ::-1]).astype(np.float32),
        finger_angles=mirror_fingers(references.finger_angles[:, ::-1]).astype(np.float32),
        **swapped,
    )
