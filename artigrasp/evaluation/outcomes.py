"""What happens in trials: what every experiment records of each, and what those about a hinge or a pose do besides."""

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from artigrasp.arrays import Array
from artigrasp.environment.measuring import REACHED_DISTANCE, REACHED_TURN
from artigrasp.evaluation.quality import area_under_curve

AT_POSE = {"position_error": (-np.inf, REACHED_DISTANCE), "rotation_error": (-np.inf, REACHED_TURN)}
"""Of the metrics of an episode, the ranges in which its object is at its target."""


@dataclass(frozen=True)
class Outcomes:
    """What happened in each trial; every array is indexed [trial, ...]."""

    grouping: ClassVar[tuple[tuple[str, ...], ...]] = (("object", "reference"),)
    """For every kind of reference that a trial has, the fields that name it."""

    object: NDArray[np.str_]
    reference: NDArray[np.int64]
    """Index among the object's references of the kind and split, as `artigrasp generate --reference` counts."""
    source: NDArray[np.str_]
    """Where the reference came from."""
    failed: NDArray[np.bool_]
    """Whether the physics failed; such a trial never counts as success, and its errors are those measured before."""
    base_distance: Array
    """Mean distance of the base's vertices from where the target has them, at the end (ADD) [m]."""
    articulated_distance: Array
    """The same of the articulated part."""
    penetration: Array
    """Deepest overlap of a hand's collision shapes and the object's surface, mean over the episode [m]."""
    jerk: Array
    """Norm of the third derivative of the hands' keypoints, mean over keypoints and episode [m/s³]."""
    contact_consistency: Array
    """Of the links that touch the object at either of two control steps, the share that do at both, mean from the
    first contact on."""

    @property
    def cause(self) -> NDArray[np.str_]:
        """What went wrong in a trial that did not succeed, empty where that is not known."""
        return np.where(self.failed, "physics", "")

    @property
    def base_auc(self) -> Array:
        """ADD-AUC of the base up to 0.1 m."""
        return area_under_curve(self.base_distance)

    @property
    def articulated_auc(self) -> Array:
        """ADD-AUC of the articulated part up to 0.1 m."""
        return area_under_curve(self.articulated_distance)

    @property
    def groups(self) -> NDArray[np.int64]:
        """Numbers of the references that a trial shares with others, one of each kind, [trial, kind]."""
        return group_numbers([[getattr(self, name) for name in names] for names in self.grouping])

    @property
    def reference_count(self) -> int:
        """Number of references in all trials."""
        return int((self.groups.max(axis=0) + 1).sum())

    def __len__(self) -> int:
        return len(self.object)

    def select(self, mask: NDArray[np.bool_]) -> Self:
        """The trials where the mask is true."""
        return type(self)(**{name: value[mask] for name, value in self.columns().items()})

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """The trials of several, one after the other."""
        columns = [part.columns() for part in parts]
        return cls(**{name: np.concatenate([each[name] for each in columns]) for name in columns[0]})

    def columns(self) -> dict[str, NDArray[Any]]:
        """Every array by its name."""
        return {each.name: getattr(self, each.name) for each in fields(self)}


@dataclass(frozen=True)
class HingeOutcomes(Outcomes):
    """Trials in which the hinge should reach an angle."""

    goal_angle: Array
    """Target of the hinge [rad]."""
    final_angle: Array

    @property
    def angle_error(self) -> Array:
        """|goal − final angle| [rad]."""
        return np.asarray(np.abs(self.goal_angle - self.final_angle))


@dataclass(frozen=True)
class PoseOutcomes(Outcomes):
    """Trials in which the base should reach a pose."""

    position_error: Array
    """Distance of the base from its target at the end [m]."""
    rotation_error: Array
    """Angle between the base and its target at the end [rad]."""

    @property
    def at_pose(self) -> NDArray[np.bool_]:
        """Whether the base is at its target at the end."""
        return (self.position_error < REACHED_DISTANCE) & (self.rotation_error < REACHED_TURN)


def group_numbers(kinds: Sequence[Sequence[NDArray[Any]]]) -> NDArray[np.int64]:
    """Numbers from zero on, alike where all columns of a kind are, [trial, kind]."""
    numbers = [np.unique(np.rec.fromarrays(columns), return_inverse=True)[1].reshape(-1) for columns in kinds]
    return np.stack(numbers, axis=1)
