"""The groups of arrays that kernels share.

``W`` worlds, ``H`` hands and ``O`` objects of the scene; float32 unless said otherwise.

A group is allocated by the function of its name; every array stays reachable as an attribute.
"""

from typing import Any

import warp as wp

from .layout import DOF_COUNT, FINGER_DOF_COUNT, KEYPOINT_COUNT, LINK_COUNT, PARTS, TIP_COUNT

Shapes = dict[str, tuple[int, ...]]


@wp.struct
class HandState:
    """Hands at one instant.

    Attributes:
        joint_q: [W, H, 51] joint coordinates, m and rad.
        joint_qd: [W, H, 51] their rates, m/s and rad/s.
        hand_base: [W, H] frame that the wrist coordinates are relative to, in the world.
        contact_force: [W, H, 16, 2] net force of each part on each link, world frame, N, mean over the control step.
        link_pose: [W, H, 16] link frames in the world, by `forward_kinematics`.
        keypoint: [W, H, 21] keypoints in the world, m, by `forward_kinematics`.
    """

    joint_q: wp.array3d[float]
    joint_qd: wp.array3d[float]
    hand_base: wp.array2d[wp.transform]
    contact_force: wp.array4d[wp.vec3]
    link_pose: wp.array3d[wp.transform]
    keypoint: wp.array3d[wp.vec3]


@wp.struct
class ObjectState:
    """One object of every world at one instant.

    Attributes:
        pose: [W] frame of the base part in the world.
        velocity: [W] velocity of the base: linear (of the frame's origin, m/s), angular (rad/s), world frame.
        hinge_q: [W] hinge angle, rad, positive opens.
        hinge_qd: [W] its rate, rad/s.
    """

    pose: wp.array[wp.transform]
    velocity: wp.array[wp.spatial_vector]
    hinge_q: wp.array[float]
    hinge_qd: wp.array[float]


@wp.struct
class ObjectSlots:
    """All objects of every world at one instant: the fields of `ObjectState`, object by object in the scene's order.

    Attributes:
        pose: [W, O]
        velocity: [W, O]
        hinge_q: [W, O]
        hinge_qd: [W, O]
    """

    pose: wp.array2d[wp.transform]
    velocity: wp.array2d[wp.spatial_vector]
    hinge_q: wp.array2d[float]
    hinge_qd: wp.array2d[float]


@wp.struct
class ObjectModel:
    """What does not change of one object of every world.

    Attributes:
        hinge_origin: [W] a point on the hinge axis in the base frame, m.
        hinge_axis: [W] unit axis in the base frame; a positive turn of the articulated part opens.
        part_mass: [W, 2] masses of the parts, kg.
    """

    hinge_origin: wp.array[wp.vec3]
    hinge_axis: wp.array[wp.vec3]
    part_mass: wp.array2d[float]


@wp.struct
class HandModel:
    """What does not change of the hands.

    Attributes:
        link_offset: [H, 16] origin of each link in its parent's frame, m.
        tip_offset: [H, 5] fingertips in the frames of their last links, m.
        lower, upper: [H, 51] joint limits, m and rad.
    """

    link_offset: wp.array2d[wp.vec3]
    tip_offset: wp.array2d[wp.vec3]
    lower: wp.array2d[float]
    upper: wp.array2d[float]


@wp.struct
class Goal:
    """What every hand is asked to do in the running phase, and where the episode started and should end.

    Set by `reset_worlds` and `begin_phases`.

    Attributes:
        active: [W, H] int, 1 where the hand takes part.
        engaged: [W, H] int, 1 where it takes part, or steadies the base meanwhile; else it waits.
        keeps: [W, H] int, 1 where it keeps its targets and gains whatever the phase is, such as a hand that holds
            something else. Not set by resets and phases.
        part: [W, H] int, the part that the hand manipulates.
        contact_part: [W, H] int, the part whose contacts count, -1 for either.
        wrist_pose_in_part: [W, H] reference wrist frame in the manipulated part's frame.
        finger_angles: [W, H, 45] reference finger angles, rad.
        link_pose_in_part: [W, H, 16] reference link frames in the manipulated part's frame.
        keypoint_in_part: [W, H, 21] reference keypoints in the manipulated part's frame, m.
        contacts: [W, H, 16] target contacts, 0 or 1.
        lower, upper: [W, H, 51] effective joint limits: the hand's, widened to contain the reference, m and rad.
        angle: [W] hinge angle asked for now, rad.
        object_pose: [W] base frame asked for now, in the world.
        target_angle: [W] hinge angle at the end of the episode, rad.
        target_object_pose: [W] base frame in the world at the end of the episode.
        start_object_pose: [W] base frame in the world when the episode started.
        start_angle: [W] hinge angle when the episode started, rad.
    """

    active: wp.array2d[int]
    engaged: wp.array2d[int]
    keeps: wp.array2d[int]
    part: wp.array2d[int]
    contact_part: wp.array2d[int]
    wrist_pose_in_part: wp.array2d[wp.transform]
    finger_angles: wp.array3d[float]
    link_pose_in_part: wp.array3d[wp.transform]
    keypoint_in_part: wp.array3d[wp.vec3]
    contacts: wp.array3d[float]
    lower: wp.array3d[float]
    upper: wp.array3d[float]
    angle: wp.array[float]
    object_pose: wp.array[wp.transform]
    target_angle: wp.array[float]
    target_object_pose: wp.array[wp.transform]
    start_object_pose: wp.array[wp.transform]
    start_angle: wp.array[float]


@wp.struct
class PhaseState:
    """Where every world is in its sequence of phases.

    The pose in which a hand began the phase is its base frame.

    Attributes:
        index: [W] int, the running phase.
        step: [W] int, control steps since it began.
        decision_step: [W] int, control steps since the decisions in force began to count.
        start_object_pose: [W] base frame in the world when it began.
        settled_steps: [W] int, control steps in a row in which its aim was met.
        untouched_steps: [W] int, control steps in a row in which no hand that takes part touched the object.
        finished: [W] int, 1 once the last phase has ended; it then goes on.
        retry_count: [W] int, how often a failed phase was tried again in this episode.
    """

    index: wp.array[int]
    step: wp.array[int]
    decision_step: wp.array[int]
    start_object_pose: wp.array[wp.transform]
    settled_steps: wp.array[int]
    untouched_steps: wp.array[int]
    finished: wp.array[int]
    retry_count: wp.array[int]


def field_names(group: Any) -> list[str]:
    """Names of a struct's fields."""
    return list(group.vars)


def element_types(group: Any) -> dict[str, Any]:
    """Element types of the arrays of a struct, by name."""
    return {name: variable.type.dtype for name, variable in group.vars.items()}


def _allocate(group: Any, shapes: Shapes, device: str | None, requires_grad: bool = False) -> Any:
    """A struct instance with zeroed arrays of the given shapes, their element types taken from the annotations."""
    instance = group()
    for name, dtype in element_types(group).items():
        differentiable = requires_grad and dtype is not wp.int32
        setattr(instance, name, wp.zeros(shapes[name], dtype=dtype, device=device, requires_grad=differentiable))
    return instance


def slice_worlds(group: Any, instance: Any, worlds: slice) -> Any:
    """Some worlds of an instance of a struct whose arrays all start with [W]; the arrays are views."""
    view = group()
    for name in element_types(group):
        setattr(view, name, getattr(instance, name)[worlds])
    return view


def hand_state(world_count: int, hand_count: int, device: str | None = None, requires_grad: bool = False) -> HandState:
    """Zeroed `HandState`; its base frames must be set before use."""
    hands = (world_count, hand_count)
    shapes: Shapes = {
        "joint_q": (*hands, DOF_COUNT),
        "joint_qd": (*hands, DOF_COUNT),
        "hand_base": hands,
        "contact_force": (*hands, LINK_COUNT, len(PARTS)),
        "link_pose": (*hands, LINK_COUNT),
        "keypoint": (*hands, KEYPOINT_COUNT),
    }
    return _allocate(HandState, shapes, device, requires_grad)


def object_state(world_count: int, device: str | None = None, requires_grad: bool = False) -> ObjectState:
    """Zeroed `ObjectState`; its poses must be set before use."""
    shapes: Shapes = dict.fromkeys(element_types(ObjectState), (world_count,))
    return _allocate(ObjectState, shapes, device, requires_grad)


def object_slots(world_count: int, object_count: int, device: str | None = None) -> ObjectSlots:
    """Zeroed `ObjectSlots`; its poses must be set before use."""
    shapes: Shapes = dict.fromkeys(element_types(ObjectSlots), (world_count, object_count))
    return _allocate(ObjectSlots, shapes, device)


def object_in_slot(slots: ObjectSlots, slot: int) -> ObjectState:
    """One object of every world; the arrays are views."""
    view = ObjectState()
    for name in element_types(ObjectState):
        setattr(view, name, getattr(slots, name)[:, slot])
    return view


def object_model(world_count: int, device: str | None = None) -> ObjectModel:
    """Zeroed `ObjectModel`, to be filled."""
    shapes: Shapes = {
        "hinge_origin": (world_count,),
        "hinge_axis": (world_count,),
        "part_mass": (world_count, len(PARTS)),
    }
    return _allocate(ObjectModel, shapes, device)


def hand_model(hand_count: int, device: str | None = None) -> HandModel:
    """Zeroed `HandModel`, to be filled."""
    shapes: Shapes = {
        "link_offset": (hand_count, LINK_COUNT),
        "tip_offset": (hand_count, TIP_COUNT),
        "lower": (hand_count, DOF_COUNT),
        "upper": (hand_count, DOF_COUNT),
    }
    return _allocate(HandModel, shapes, device)


def goal(world_count: int, hand_count: int, device: str | None = None, requires_grad: bool = False) -> Goal:
    """Zeroed `Goal`, filled by `reset_worlds`."""
    hands = (world_count, hand_count)
    shapes: Shapes = dict.fromkeys(("active", "engaged", "keeps", "part", "contact_part", "wrist_pose_in_part"), hands)
    shapes |= {
        "finger_angles": (*hands, FINGER_DOF_COUNT),
        "link_pose_in_part": (*hands, LINK_COUNT),
        "keypoint_in_part": (*hands, KEYPOINT_COUNT),
        "contacts": (*hands, LINK_COUNT),
        "lower": (*hands, DOF_COUNT),
        "upper": (*hands, DOF_COUNT),
    }
    of_world = ("angle", "object_pose", "target_angle", "target_object_pose", "start_object_pose", "start_angle")
    shapes |= dict.fromkeys(of_world, (world_count,))
    return _allocate(Goal, shapes, device, requires_grad)


def phase_state(world_count: int, device: str | None = None) -> PhaseState:
    """Zeroed `PhaseState`, filled by `reset_worlds`."""
    shapes: Shapes = dict.fromkeys(element_types(PhaseState), (world_count,))
    return _allocate(PhaseState, shapes, device)
