"""What a motion shows: rigid bodies with a surface, a colour and a path through time."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.assets.hand import HandModel, load_hand
from artigrasp.assets.hand_skin import SKIN_COLOUR
from artigrasp.assets.object import ObjectModel, load_object
from artigrasp.config import StageConfig
from artigrasp.export.surface import Surface, join, link_surface, mesh_surface, part_surface, place
from artigrasp.kernels.layout import ARTICULATED, BASE, LINK_COUNT, LINKS, PARTS
from artigrasp.motion.file import Motion
from artigrasp.motion.kinematics import link_poses, part_poses, pose_object


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body of a motion with T samples.

    Attributes:
        name: Name of the hand link or object part.
        surface: In the frame of the body.
        colours: Linear RGB of each face of the surface, each 0 to 1, shape ``[F, 3]``.
        poses: Of the body in the world: position [m], quaternion xyzw, shape ``[T, 7]``.
    """

    name: str
    surface: Surface
    colours: Array
    poses: NDArray[np.float32]


def load_models(motion: Motion) -> tuple[tuple[HandModel, ...], ObjectModel]:
    """The models of a motion's hands and object.

    Raises:
        UserError: one of them is not among the assets.
    """
    return tuple(load_hand(motion.hand, side) for side in motion.hands), load_object(motion.object)


def hand_bodies(motion: Motion, hands: Sequence[HandModel]) -> list[tuple[Body, ...]]:
    """The 16 links of each hand of a motion."""
    poses = link_poses(motion, hands)
    return [
        tuple(_link_body(hand, link, poses[:, index, link]) for link in range(LINK_COUNT))
        for index, hand in enumerate(hands)
    ]


def _link_body(hand: HandModel, link: int, poses: NDArray[np.float32]) -> Body:
    surface = link_surface(hand, link)
    return Body(LINKS[link], surface, np.tile(SKIN_COLOUR, (len(surface.faces), 1)), poses)


def object_bodies(motion: Motion, object: ObjectModel) -> tuple[Body, ...]:
    """The two parts of the object of a motion."""
    return _part_bodies(object, part_poses(motion, object))


def _part_bodies(object: ObjectModel, poses: NDArray[np.float32]) -> tuple[Body, ...]:
    return tuple(
        Body(name, *part_surface(part), poses[:, index])
        for index, (name, part) in enumerate(zip(PARTS, object.parts, strict=True))
    )


def bystander_bodies(motion: Motion) -> tuple[tuple[ObjectModel, tuple[Body, ...], NDArray[np.float32]], ...]:
    """The other objects of a motion's scene: each with its two parts and its hinge angles [rad], shape ``[T]``.

    Raises:
        UserError: one of them is not among the assets.
    """
    if (bystanders := motion.bystanders) is None:
        return ()
    models = [load_object(name) for name in bystanders.objects]
    courses = zip(models, np.moveaxis(bystanders.pose, 1, 0), bystanders.hinge_angle.T, strict=True)
    return tuple(
        (model, _part_bodies(model, pose_object(poses, angles, model)), angles) for model, poses, angles in courses
    )


def stage_surface(stage: StageConfig) -> Surface:
    """The surface of a plateau on the table, in the world."""
    box = trimesh.creation.box((*stage.size, stage.height))
    centre = np.array([*stage.position, stage.height / 2])
    return mesh_surface(np.asarray(box.vertices) + centre, np.asarray(box.faces))


def target_ghost(motion: Motion, object: ObjectModel) -> Body:
    """The object at its target, or where that is not known the articulated part at the target angle, on the base."""
    count = len(motion.time)
    articulated, colours = part_surface(object.parts[ARTICULATED])
    if motion.target_object_pose is None:
        poses = pose_object(motion.object_pose, np.full(count, motion.target_angle, np.float32), object)
        return Body("target", articulated, colours, poses[:, ARTICULATED])
    base, base_colours = part_surface(object.parts[BASE])
    turned = place(articulated, np.concatenate(object.articulated_pose_in_base(motion.target_angle)))
    whole = join([base, turned])
    return Body(
        "target", whole, np.concatenate([base_colours, colours]), np.tile(motion.target_object_pose, (count, 1))
    )


def box_corners(bodies: Sequence[Body], samples: NDArray[np.integer]) -> Array:
    """Corners of the boxes around N bodies, along the axes of their frames, world [m], shape ``[T, 8 N, 3]``."""
    seen = []
    for body in bodies:
        bounds = np.stack([body.surface.vertices.min(axis=0), body.surface.vertices.max(axis=0)], axis=1)
        corners = np.array(list(itertools.product(*bounds)))
        poses = body.poses[samples]
        turn = Rotation.from_quat(poses[:, 3:]).as_matrix()
        seen.append(np.einsum("tij,cj->tci", turn, corners) + poses[:, None, :3])
    return np.concatenate(seen, axis=1)
