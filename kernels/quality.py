"""How well a motion is made: how jerky hands move, how steadily they touch, how deep they are in what they hold."""

import warp as wp

from .goals import contact_strength, is_touching
from .states import Goal, HandState

wp.set_module_options({"enable_backward": False})


@wp.struct
class MotionQuality:
    """Sums over the control steps of an episode; means are for who reads them.

    Attributes:
        keypoint: [W, H, 21, 3] keypoints of the last three control steps, m, in a ring.
        jerk_sum: [W, H] norm of the keypoints' third difference, mean over the keypoints, m per control step cubed.
        touching: [W, H] int, bits of the links that touched the object at the last step.
        steadiness_sum: [W, H] share of the links touching at either of two steps that touch at both.
        contact_steps: [W, H] int, steps that the former is a sum over: those since something first touched.
        depth_sum: [W] deepest overlap of hands and object, m.
        depth_count: [W] int, measurements that the former is a sum over.
    """

    keypoint: wp.array4d[wp.vec3]
    jerk_sum: wp.array2d[float]
    touching: wp.array2d[int]
    steadiness_sum: wp.array2d[float]
    contact_steps: wp.array2d[int]
    depth_sum: wp.array[float]
    depth_count: wp.array[int]


def motion_quality(world_count: int, hand_count: int, keypoint_count: int, device: str) -> MotionQuality:
    """Zeroed `MotionQuality`."""
    quality = MotionQuality()
    each_hand = (world_count, hand_count)
    quality.keypoint = wp.zeros((*each_hand, keypoint_count, 3), dtype=wp.vec3, device=device)
    for name, dtype in (("jerk_sum", float), ("touching", int), ("steadiness_sum", float), ("contact_steps", int)):
        setattr(quality, name, wp.zeros(each_hand, dtype=dtype, device=device))
    quality.depth_sum = wp.zeros(world_count, dtype=float, device=device)
    quality.depth_count = wp.zeros(world_count, dtype=int, device=device)
    return quality


@wp.kernel
def update_quality(hand_state: HandState, goal: Goal, failure: wp.array[int], step: int, quality: MotionQuality):
    """Take in the state after a control step; launch with ``dim=(W, H)``, first with step 0 after the reset.

    Worlds whose physics failed and hands that take no part are left as they are.

    Args:
        hand_state, goal: see `states`.
        failure: [W] int, not 0 where the physics failed.
        step: control steps done.
        quality: in and out.
    """
    world, hand = wp.tid()
    if failure[world] != 0 or goal.active[world, hand] == 0:
        return
    keypoint_count = quality.keypoint.shape[2]
    jerk = wp.float32(0.0)
    for point in range(keypoint_count):
        now = hand_state.keypoint[world, hand, point]
        if step >= 3:
            # the ring holds the steps before: one, two and three ago
            one = quality.keypoint[world, hand, point, (step + 2) % 3]
            two = quality.keypoint[world, hand, point, (step + 1) % 3]
            three = quality.keypoint[world, hand, point, step % 3]
            jerk += wp.length(now - 3.0 * one + 3.0 * two - three) / float(keypoint_count)
        quality.keypoint[world, hand, point, step % 3] = now
    quality.jerk_sum[world, hand] += jerk

    before = quality.touching[world, hand]
    touching = wp.int32(0)
    both = wp.int32(0)
    either = wp.int32(0)
    for link in range(hand_state.contact_force.shape[2]):
        bit = wp.lshift(1, link)
        touches = is_touching(contact_strength(hand_state, goal, world, hand, link)) > 0.0
        touched = (before & bit) != 0
        if touches:
            touching = touching | bit
        if touches and touched:
            both += 1
        if touches or touched:
            either += 1
    if either > 0:
        quality.steadiness_sum[world, hand] += float(both) / float(either)
    if either > 0 or quality.contact_steps[world, hand] > 0:
        quality.contact_steps[world, hand] += 1
    quality.touching[world, hand] = touching


@wp.kernel
def add_depth(goal: Goal, failure: wp.array[int], link_distance: wp.array4d[float], quality: MotionQuality):
    """Take in the deepest overlap of the hands that take part with the object; launch with ``dim=W``.

    Args:
        goal: see `states`.
        failure: [W] int, not 0 where the physics failed.
        link_distance: [W, H, 16, 2] signed distance of each link from each part, m.
        quality: in and out.
    """
    world = wp.tid()
    if failure[world] != 0:
        return
    depth = wp.float32(0.0)
    for hand in range(link_distance.shape[1]):
        if goal.active[world, hand] != 0:
            for link in range(link_distance.shape[2]):
                for part in range(link_distance.shape[3]):
                    depth = wp.max(depth, -link_distance[world, hand, link, part])
    quality.depth_sum[world] += depth
    quality.depth_count[world] += 1
