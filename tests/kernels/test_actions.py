"""PD targets: priors, synergies, residual, wraps and limits."""

from dataclasses import replace

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.kernels import states
from artigrasp.kernels.actions import (
    FINGER_PRIORS,
    WRIST_PRIORS,
    ActionSettings,
    SynergyScale,
    hand_backs,
    pd_targets,
)
from artigrasp.kernels.layout import ARTICULATED, DOF_COUNT, DOFS, HANDS
from artigrasp.kernels.synergies import SYNERGIES, finger_synergy_basis
from tests.kernels import numpy_reference
from tests.kernels.launches import launch_forward_kinematics
from tests.kernels.samples import Sample, random_sample, to_device

WAITING = np.array([[-0.4, -0.3, 0.3, 0.0, 0.0, 0.6, 0.8], [0.4, -0.2, 0.25, 0.0, 0.8, 0.0, 0.6]])
"""Where the hands wait."""
PAPER = {"wrist_prior": "reference", "finger_prior": "current"}
HINGE = {"wrist_prior": "hinge", "finger_prior": "reference"}
SCALES = np.array([0.001] * 3 + [0.01] * 3 + [0.015] * 45)
LEAD = 0.35


def settings(wrist_prior: str, finger_prior: str, **changes: float) -> ActionSettings:
    """The paper's scales, ours for the synergies, with changes."""
    result = ActionSettings()
    values = {
        "wrist_prior": WRIST_PRIORS.index(wrist_prior),
        "finger_prior": FINGER_PRIORS.index(finger_prior),
        "approach_steps": 60.0,
        "close_start": 30.0,
        "close_end": 70.0,
        "open_fraction": 0.3,
        "follow": 1.0,
        "lead": LEAD,
        "synergy_scale": SynergyScale(*[0.015] * 3, *[0.15] * 3, 0.3, *[0.2] * 4, 0.15, 0.1, 0.02),
        "residual_scale": wp.vec3(0.001, 0.01, 0.015),
    }
    for name, value in (values | changes).items():
        setattr(result, name, value)
    return result


def targets(
    sample: Sample,
    prior: dict[str, str],
    step: int = 1000,
    synergy: np.ndarray | None = None,
    residual: np.ndarray | None = None,
    limit: float = 100.0,
    **changes: float,
) -> np.ndarray:
    """[W, H, 51] targets of a sample, with all joint limits at ``limit``."""
    device = to_device(sample)
    launch_forward_kinematics(device)
    hands = sample.part.shape
    for array, value in ((device.goal.lower, -limit), (device.goal.upper, limit)):
        array.fill_(value)
    phase = states.phase_state(sample.world_count)
    phase.step.fill_(step)
    phase.start_object_pose.assign(sample.pose)
    result = wp.full((*hands, DOF_COUNT), np.nan, dtype=float)
    wp.launch(
        pd_targets,
        dim=hands,
        inputs=[
            device.hands,
            device.objects,
            device.object_model,
            device.goal,
            phase,
            wp.array([settings(**prior, **changes)], dtype=ActionSettings),
            wp.array(finger_synergy_basis(HANDS), dtype=float),
            wp.array(hand_backs(HANDS), dtype=wp.vec3),
            wp.array(np.broadcast_to(WAITING, (*hands, 7)), dtype=wp.transform),
            wp.array(np.zeros((*hands, len(SYNERGIES))) if synergy is None else synergy, dtype=float),
            wp.array(np.zeros((*hands, DOF_COUNT)) if residual is None else residual, dtype=float),
        ],
        outputs=[result],
    )
    return result.numpy()


def wrist_at(sample: Sample, target: np.ndarray) -> numpy_reference.Frame:
    """Wrist frames in the world of hands that have reached their targets."""
    return numpy_reference.forward_kinematics(replace(sample, joint_q=target.astype(np.float64)))[0][0]


def reference_wrist(
    sample: Sample, angle: np.ndarray, offset: np.ndarray | float = 0.0, turn: np.ndarray | None = None
) -> numpy_reference.Frame:
    """Reference wrist frames on the part at a hinge angle [W], shifted and turned in the part's frame."""
    matrix, origin = numpy_reference.part_frames(sample, angle)
    part = tuple(numpy_reference.of_manipulated_part(sample, values) for values in (matrix, origin))
    rotation, position = numpy_reference.frame(sample.wrist_pose_in_part)
    if turn is not None:
        rotation = Rotation.from_rotvec(turn.reshape(-1, 3)).as_matrix().reshape(rotation.shape) @ rotation
    return numpy_reference.compose(part, (rotation, position + offset))


def assert_frames_agree(found: numpy_reference.Frame, expected: numpy_reference.Frame) -> None:
    """Equal to a few micrometres and microradians."""
    np.testing.assert_allclose(found[1], expected[1], atol=5e-6)
    np.testing.assert_allclose(found[0], expected[0], atol=2e-5)


@pytest.fixture(scope="module")
def sample() -> Sample:
    """100 random states in which every hand takes part."""
    sample = random_sample(seed=2)
    return replace(sample, active=np.ones_like(sample.active))


def led_angle(sample: Sample, lead: np.ndarray | float = LEAD) -> np.ndarray:
    """[W] hinge angle that the wrist of the hinge prior belongs to."""
    return sample.hinge_q + np.clip(sample.angle - sample.hinge_q, -lead, lead)


def test_the_papers_prior_is_reference_position_and_current_pose(sample: Sample) -> None:
    """Wrist position on the part as it is now; rotation and fingers where they are; the residual on top."""
    residual = np.random.default_rng(0).normal(size=sample.joint_q.shape)
    target = targets(sample, PAPER, residual=residual)
    without = target - SCALES * residual
    expected = reference_wrist(sample, sample.hinge_q)
    np.testing.assert_allclose(wrist_at(sample, without)[1], expected[1], atol=5e-6)
    np.testing.assert_allclose(without[..., 3:], sample.joint_q[..., 3:], atol=1e-5)


def test_the_hinge_prior_runs_ahead_of_the_part(sample: Sample) -> None:
    """After the approach the wrist belongs to the part turned towards the goal, by the lead at most."""
    assert_frames_agree(wrist_at(sample, targets(sample, HINGE)), reference_wrist(sample, led_angle(sample)))
    near = replace(sample, angle=sample.hinge_q + np.linspace(-0.3, 0.3, sample.world_count))
    assert_frames_agree(wrist_at(near, targets(near, HINGE)), reference_wrist(near, near.angle))


def test_the_lead_grows_between_two_steps(sample: Sample) -> None:
    """The hand follows the part itself at first, then runs ahead more and more, up to the whole lead."""
    for step, fraction in ((0, 0.0), (80, 0.0), (90, 0.25), (100, 0.5), (120, 1.0), (200, 1.0)):
        target = targets(sample, HINGE, step=step, approach_steps=0.0, lead_start=80.0, lead_end=120.0)
        expected = reference_wrist(sample, led_angle(sample, fraction * LEAD))
        assert_frames_agree(wrist_at(sample, target), expected)


def test_the_schedule_raises_the_angle_with_time(sample: Sample) -> None:
    """The wrist belongs to the part at an angle between start and goal, wherever the part is."""
    schedule = HINGE | {"wrist_prior": "schedule"}
    for step, fraction in ((60, 0.0), (80, 0.0), (90, 0.25), (120, 1.0), (200, 1.0)):
        target = targets(sample, schedule, step=step, approach_steps=0.0, lead_start=80.0, lead_end=120.0)
        angle = sample.start_angle + fraction * (sample.angle - sample.start_angle)
        assert_frames_agree(wrist_at(sample, target), reference_wrist(sample, angle))


def test_on_the_base_the_hinge_prior_is_the_reference(sample: Sample) -> None:
    """A hand on the base, as in grasping, does not care for the hinge."""
    grasp = replace(sample, part=np.zeros_like(sample.part))
    found = wrist_at(grasp, targets(grasp, HINGE))
    assert_frames_agree(found, reference_wrist(grasp, np.zeros(grasp.world_count)))


def test_the_approach_is_a_smooth_step_from_the_start(sample: Sample) -> None:
    """The wrist leaves the pose of its reset, is halfway after half the steps, and starts and ends slowly."""
    np.testing.assert_allclose(targets(sample, HINGE, step=0)[..., :6], 0.0, atol=1e-6)
    arrived = targets(sample, HINGE, step=60)[..., :3]
    for step in (15, 30, 45):
        x = step / 60.0
        fraction = x * x * (3.0 - 2.0 * x)
        np.testing.assert_allclose(targets(sample, HINGE, step=step)[..., :3], fraction * arrived, atol=1e-5)
    np.testing.assert_array_equal(targets(sample, HINGE, step=0, approach_steps=0.0)[..., :3], arrived)


def test_fingers_close_from_a_fraction_to_the_reference(sample: Sample) -> None:
    """Linear between the two steps, constant outside."""
    for step, fraction in ((0, 0.3), (30, 0.3), (50, 0.65), (70, 1.0), (300, 1.0)):
        found = targets(sample, HINGE, step=step)[..., 6:]
        np.testing.assert_allclose(found, fraction * sample.finger_angles, atol=1e-5)


def test_wrist_synergies_move_the_wrist_in_the_parts_frame(sample: Sample) -> None:
    """Shift and turn about the wrist, both along the part's axes, and a longer or shorter lead, never negative."""
    rng = np.random.default_rng(0)
    synergy = np.zeros((*sample.part.shape, len(SYNERGIES)))
    synergy[..., :6] = rng.normal(size=(*sample.part.shape, 6))
    lead = rng.normal(scale=3.0, size=sample.world_count)
    synergy[..., SYNERGIES.index("lead")] = lead[:, None]
    angle = led_angle(sample, np.maximum(LEAD + 0.15 * lead, 0.0))
    expected = reference_wrist(sample, angle, 0.015 * synergy[..., :3], 0.15 * synergy[..., 3:6])
    assert_frames_agree(wrist_at(sample, targets(sample, HINGE, synergy=synergy)), expected)
    assert (LEAD + 0.15 * lead < 0).any()


def test_finger_synergies_add_to_the_fingers(sample: Sample) -> None:
    """Each synergy moves its own angles by its scale, on either finger prior."""
    basis = finger_synergy_basis(HANDS) * np.array([0.3, 0.2, 0.2, 0.2, 0.2])[:, None]
    synergy = np.zeros((*sample.part.shape, len(SYNERGIES)))
    synergy[..., 6:11] = np.random.default_rng(0).normal(size=(*sample.part.shape, 5))
    offset = np.einsum("whk,hkj->whj", synergy[..., 6:11], basis)
    for prior, fingers in ((HINGE, sample.finger_angles), (PAPER, sample.joint_q[..., 6:])):
        np.testing.assert_allclose(targets(sample, prior, synergy=synergy)[..., 6:], fingers + offset, atol=1e-5)


def test_the_finger_synergy_basis() -> None:
    """Flexion is a turn about z of the twelve finger joints; thumb offsets move the thumb; left mirrors right."""
    left, right = finger_synergy_basis(HANDS)
    angles = np.array(DOFS[6:])
    flexing = {f"{finger}{joint}_rz" for finger in ("index", "middle", "ring", "pinky") for joint in (1, 2, 3)}
    assert set(angles[right[0] != 0]) == flexing
    assert set(right[0]) == {0.0, 1.0}
    assert [list(angles[row != 0]) for row in right[1:4]] == [["thumb1_rx"], ["thumb1_ry"], ["thumb1_rz"]]
    assert set(angles[right[4] != 0]) == {"thumb2_ry", "thumb2_rz", "thumb3_ry", "thumb3_rz"}
    np.testing.assert_array_equal(left, right * np.tile([1.0, -1.0, -1.0], 15))


def test_flexion_closes_the_fingers_of_both_hands(sample: Sample) -> None:
    """Flexed fingertips move to -y, where the palms look, on the right and on the left hand."""
    hands = [load_hand("open", side) for side in HANDS]
    offsets = (np.stack([hand.link_offset for hand in hands]), np.stack([hand.tip_offset for hand in hands]))
    basis = 0.3 * finger_synergy_basis(HANDS)
    root = (np.eye(3)[None, None].repeat(2, 1), np.zeros((1, 2, 3)))
    flat = numpy_reference.hand_frames(root, np.zeros((1, 2, 45)), *offsets)[1]
    flexed = numpy_reference.hand_frames(root, basis[None, :, 0].astype(float), *offsets)[1]
    assert (flexed[..., 17:, 1] < flat[..., 17:, 1] - 0.01).all()
    thumb = numpy_reference.hand_frames(root, basis[None, :, 4].astype(float), *offsets)[1]
    # The thumb's tip moves to the palm's side and towards the fingers.
    assert (thumb[..., 16, 1] < flat[..., 16, 1] - 0.005).all()
    assert (thumb[..., 16, 2] < flat[..., 16, 2] - 0.005).all()


@pytest.mark.parametrize("turns", [-2, -1, 0, 1])
def test_wrist_angles_stay_near_the_current_ones(sample: Sample, turns: int) -> None:
    """A wrist that has wound around is asked for the same rotation from where it is, without unwinding."""
    wound = sample.joint_q.copy()
    wound[..., 3:6] += 2.0 * np.pi * turns
    sample = replace(sample, joint_q=wound)
    target = targets(sample, HINGE)
    difference = np.abs(target[..., 3:6] - wound[..., 3:6])
    assert difference[..., [0, 2]].max() < np.pi + 1e-4
    plain = targets(replace(sample, joint_q=np.zeros_like(wound)), HINGE)
    np.testing.assert_allclose(wrist_at(sample, target)[0], wrist_at(sample, plain)[0], atol=1e-4)


def test_targets_follow_a_turning_wrist_without_jumps(sample: Sample) -> None:
    """Tracking a wrist through two full turns about each axis, the angles never jump."""
    for axis in range(3):
        current = np.zeros((*sample.part.shape, DOF_COUNT))
        for angle in np.linspace(0.0, 4.0 * np.pi if axis != 1 else 1.4, 80)[1:]:
            rotvec = np.zeros(3)
            rotvec[axis] = angle
            quaternion = Rotation.from_rotvec(rotvec).as_quat()
            still = np.zeros((*sample.part.shape, 7))
            still[..., 6] = 1.0
            turning = replace(
                sample,
                joint_q=current,
                hand_base=still,
                pose=still[:, 0],
                part=np.zeros_like(sample.part),
                wrist_pose_in_part=np.concatenate(
                    [still[..., :3], np.broadcast_to(quaternion, (*sample.part.shape, 4))], -1
                ),
            )
            target = targets(turning, HINGE).astype(np.float64)
            assert np.abs(target[..., 3:6] - current[..., 3:6]).max() < 0.25
            current = target
        np.testing.assert_allclose(current[..., 3 + axis], angle, atol=1e-4)


def test_targets_keep_the_limits(sample: Sample) -> None:
    """Whatever is added up, the effective limits hold; inside them nothing changes."""
    residual = 100.0 * np.random.default_rng(0).normal(size=sample.joint_q.shape)
    free, limited = (targets(sample, HINGE, residual=residual, limit=limit) for limit in (100.0, 0.5))
    np.testing.assert_array_equal(limited, np.clip(free, -0.5, 0.5))
    assert 0.1 < (limited != free).mean() < 0.9


@pytest.mark.parametrize("prior", [PAPER, HINGE])
def test_idle_hands_hold_still(sample: Sample, prior: dict[str, str]) -> None:
    """A hand that takes no part is asked to keep the pose of its reset, whatever the policy says."""
    idle = replace(sample, active=np.zeros_like(sample.active))
    noise = np.random.default_rng(0)
    synergy = noise.normal(size=(*sample.part.shape, len(SYNERGIES)))
    target = targets(idle, prior, synergy=synergy, residual=noise.normal(size=sample.joint_q.shape))
    np.testing.assert_allclose(wrist_at(idle, target)[1], idle.hand_base[..., :3], atol=1e-6)
    np.testing.assert_allclose(target[..., 6:], 0.3 * sample.finger_angles, atol=1e-6)


def test_hands_that_steady_do_as_those_that_take_part(sample: Sample) -> None:
    """They go to their reference and close, but decisions are not for them."""
    taking_part = replace(sample, active=np.ones_like(sample.active))
    steadying = replace(sample, active=np.zeros_like(sample.active), steadies=np.int32(1))
    np.testing.assert_array_equal(targets(steadying, HINGE), targets(taking_part, HINGE))
    residual = np.random.default_rng(0).normal(size=sample.joint_q.shape)
    np.testing.assert_array_equal(targets(steadying, HINGE, residual=residual), targets(steadying, HINGE))


def test_hands_do_not_follow_an_object_that_they_push(sample: Sample) -> None:
    """The reference moves along by a share of what the object has moved from where it should be."""
    sample = replace(sample, active=np.ones_like(sample.active))
    there = replace(sample, pose=sample.object_pose)
    still = wrist_at(sample, targets(sample, HINGE, follow=0.0))
    assert_frames_agree(still, wrist_at(there, targets(there, HINGE)))
    half = wrist_at(sample, targets(sample, HINGE, follow=0.5))
    between = replace(sample, pose=halfway(sample.object_pose, sample.pose))
    assert_frames_agree(half, wrist_at(between, targets(between, HINGE)))


def halfway(start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """[W, 7] poses midway between two, along a straight line and the shortest turn."""
    first, last = (Rotation.from_quat(each[:, 3:]) for each in (start, end))
    turn = Rotation.from_rotvec(0.5 * (last * first.inv()).as_rotvec()) * first
    return np.concatenate([0.5 * (start + end)[:, :3], turn.as_quat()], axis=1)


def test_both_parts_occur(sample: Sample) -> None:
    """The random states cover hands on the base and on the articulated part."""
    assert 0.3 < (sample.part == ARTICULATED).mean() < 0.7


TRANSPORT = {"wrist_prior": "transport", "finger_prior": "closed"}
RETREAT = {"wrist_prior": "retreat", "finger_prior": "opening"}
HOME = {"wrist_prior": "home", "finger_prior": "opening"}
TRANSIT = {"wrist_prior": "transit", "finger_prior": "opening"}
SPEEDS = {"speed": 0.002, "turn_speed": 0.01}


def planned_object(sample: Sample, fraction: np.ndarray) -> numpy_reference.Frame:
    """[W] base frames between the sample's and the ones asked for."""
    start, end = (numpy_reference.frame(pose) for pose in (sample.pose, sample.object_pose))
    turn = numpy_reference.rotation_vector(np.swapaxes(start[0], -1, -2) @ end[0])
    rotation = start[0] @ Rotation.from_rotvec(fraction[:, None] * turn).as_matrix()
    return rotation, start[1] + fraction[:, None] * (end[1] - start[1])


@pytest.mark.parametrize("step", [0, 40, 1000])
def test_hands_carry_the_object_along_its_way(sample: Sample, step: int) -> None:
    """As it holds the object, on its way to the goal, whose slower half, shift or turn, sets the pace."""
    start, end = (numpy_reference.frame(pose) for pose in (sample.pose, sample.object_pose))
    turn = np.linalg.norm(numpy_reference.rotation_vector(np.swapaxes(start[0], -1, -2) @ end[0]), axis=-1)
    x = np.minimum(step / np.maximum(np.linalg.norm(end[1] - start[1], axis=-1) / 0.002, turn / 0.01), 1.0)
    rotation, position = planned_object(sample, x * x * (3.0 - 2.0 * x))
    matrix, origin = numpy_reference.frame(sample.pose)
    begun = numpy_reference.frame(sample.hand_base)
    in_object = numpy_reference.compose(numpy_reference.inverse((matrix[:, None], origin[:, None])), begun)
    expected = numpy_reference.compose((rotation[:, None], position[:, None]), in_object)
    assert_frames_agree(wrist_at(sample, targets(sample, TRANSPORT, step=step, **SPEEDS)), expected)
    # a share of what the object lags behind is added, within limits: the turn about where it should be, and the shift
    found = wrist_at(sample, targets(sample, TRANSPORT, step=step, feedback=0.5, **SPEEDS))
    lag = at_most(0.2, 0.5 * numpy_reference.rotation_vector(rotation @ np.swapaxes(matrix, -1, -2)))
    correction = Rotation.from_rotvec(lag).as_matrix()[:, None]
    arm = numpy_reference.turned(correction, expected[1] - position[:, None])
    shifted = position[:, None] + arm + at_most(0.05, 0.5 * (position - origin))[:, None]
    assert_frames_agree(found, (correction @ expected[0], shifted))


def at_most(limit: float, vectors: np.ndarray) -> np.ndarray:
    """Vectors [..., 3], shortened to a length."""
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return vectors * np.minimum(limit / np.maximum(length, 1e-9), 1.0)


def test_an_idle_hand_keeps_its_distance_from_a_carried_object(sample: Sample) -> None:
    """It is carried along as if it held on."""
    idle = replace(sample, active=np.zeros_like(sample.active))
    rotation, position = planned_object(sample, np.ones(sample.world_count))
    start = tuple(each[:, None] for each in numpy_reference.frame(sample.pose))
    held = numpy_reference.compose(numpy_reference.inverse(start), numpy_reference.frame(sample.hand_base))
    expected = numpy_reference.compose((rotation[:, None], position[:, None]), held)
    assert_frames_agree(wrist_at(idle, targets(idle, TRANSPORT, **SPEEDS)), expected)


def test_a_hand_draws_out_of_its_grip(sample: Sample) -> None:
    """Between the way from the object's origin and that of its back, never down; fingers open again."""
    base = sample.hand_base[..., :3]
    outward = base - sample.pose[:, None, :3]
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    outward += numpy_reference.turned(numpy_reference.frame(sample.hand_base)[0], hand_backs(HANDS))
    outward[..., 2] = np.maximum(outward[..., 2], 0.0)
    outward /= np.linalg.norm(outward, axis=-1, keepdims=True)
    for step, fraction in ((0, 0.0), (30, 0.5), (60, 1.0)):
        target = targets(sample, RETREAT, step=step, retreat_distance=0.15, wrist_clearance=-9.0)
        rotation, position = wrist_at(sample, target)
        np.testing.assert_allclose(position, base + 0.15 * fraction * outward, atol=1e-5)
        np.testing.assert_allclose(rotation, numpy_reference.frame(sample.hand_base)[0], atol=2e-5)
    low = wrist_at(sample, targets(sample, RETREAT, retreat_distance=0.15, wrist_clearance=0.1))[1]
    np.testing.assert_allclose(low[..., 2], np.maximum((base + 0.15 * outward)[..., 2], 0.1), atol=1e-5)
    for step, fraction in ((30, 1.0), (50, 0.65), (70, 0.3)):
        found = targets(sample, RETREAT, step=step)[..., 6:]
        np.testing.assert_allclose(found, fraction * sample.finger_angles, atol=1e-5)


def test_transit_leads_around_the_object(sample: Sample) -> None:
    """From where the hand is to its pre-grasp pose, or farther if idle, never nearer to the object than both ends."""
    sample = replace(sample, active=np.arange(2 * sample.world_count).reshape(-1, 2) // 3 % 2)
    origin = sample.pose[:, None, :3]
    rotation, reference = reference_wrist(sample, sample.hinge_q)
    outward = (reference - origin) / np.linalg.norm(reference - origin, axis=-1, keepdims=True)
    end = reference + np.where(sample.active[..., None] == 1, 0.1, 0.3) * outward
    distances = {"pregrasp_distance": 0.1, "idle_distance": 0.3, "wrist_clearance": -9.0, "idle_clearance": -9.0}
    arrived = wrist_at(sample, targets(sample, TRANSIT, **distances))
    assert_frames_agree(arrived, (rotation, end))
    begun = wrist_at(sample, targets(sample, TRANSIT, step=0, **distances))
    assert_frames_agree(begun, numpy_reference.frame(sample.hand_base))
    nearest = np.minimum(*(np.linalg.norm(each - origin, axis=-1) for each in (begun[1], arrived[1])))
    for step in range(5, 60, 5):
        position = wrist_at(sample, targets(sample, TRANSIT, step=step, **distances))[1]
        assert (np.linalg.norm(position - origin, axis=-1) > nearest - 1e-4).all()
    high = wrist_at(sample, targets(sample, TRANSIT, **distances | {"idle_clearance": 0.2}))[1]
    np.testing.assert_allclose(
        high[..., 2], np.where(sample.active == 1, end[..., 2], np.maximum(end[..., 2], 0.2)), atol=1e-5
    )
    # to the opposite side, it goes over the top
    opposite = replace(sample, hand_base=np.concatenate([2 * origin - end, sample.hand_base[..., 3:]], axis=-1))
    highest = wrist_at(opposite, targets(opposite, TRANSIT, step=30, **distances))[1]
    np.testing.assert_allclose(highest[..., :2], np.broadcast_to(origin[..., :2], highest[..., :2].shape), atol=1e-3)
    assert (highest[..., 2] > origin[..., 2] + 0.1).all()


def test_hands_that_have_nothing_left_to_do_go_home(sample: Sample) -> None:
    """Up and over: they have gone halfway up before a quarter of the way across; those that take no part stay."""
    sample = replace(sample, active=np.broadcast_to([1, 0], sample.active.shape))
    start, end = numpy_reference.frame(sample.hand_base), numpy_reference.frame(WAITING)
    stays = tuple(each[:, 1] for each in start)
    for step, fraction in ((0, 0.0), (30, 0.5), (1000, 1.0)):
        rotation, position = wrist_at(sample, targets(sample, HOME, step=step))
        low, high = start[1][:, 0], end[1][0]
        across = low + fraction**2 * (high - low)
        across[:, 2] = low[:, 2] + fraction * (high - low)[:, 2] + 0.6 * fraction * (1.0 - fraction)
        np.testing.assert_allclose(position[:, 0], across, atol=1e-5)
        assert_frames_agree((rotation[:, 1], position[:, 1]), stays)
    np.testing.assert_allclose(rotation[:, 0], np.broadcast_to(end[0][0], rotation[:, 0].shape), atol=2e-5)


def test_hands_press(sample: Sample) -> None:
    """Each palm towards the other as the fingers close, one hand alone to where its palm looks; more if decided."""
    sample = replace(sample, active=np.where(np.arange(sample.world_count)[:, None] % 2 == 0, 1, [1, 0]))
    palms = numpy_reference.forward_kinematics(sample)[1][:, :, 4]
    towards = (palms[:, 1] - palms[:, 0]) / np.linalg.norm(palms[:, 1] - palms[:, 0], axis=-1, keepdims=True)
    towards = np.stack([towards, -towards], axis=1)
    decided = one_synergy(sample, "press", 1.5)
    for step, fraction in ((30, 0.0), (50, 0.5), (100, 1.0)):
        rotation, plain = wrist_at(sample, targets(sample, HINGE, step=step))
        direction = np.where(sample.active.all(axis=1)[:, None, None], towards, -rotation[..., 1])
        direction = direction * sample.active[..., None]
        pressed = wrist_at(sample, targets(sample, HINGE, step=step, press=0.05))[1]
        np.testing.assert_allclose(pressed - plain, 0.05 * fraction * direction, atol=1e-5)
        pressed = wrist_at(sample, targets(sample, HINGE, step=step, press=0.05, synergy=decided))[1]
        np.testing.assert_allclose(pressed - plain, (0.05 + 0.03) * fraction * direction, atol=1e-5)


def one_synergy(sample: Sample, name: str, value: float) -> np.ndarray:
    """[W, H, 14] decisions along one direction only."""
    synergy = np.zeros((*sample.part.shape, len(SYNERGIES)))
    synergy[..., SYNERGIES.index(name)] = value
    return synergy


def test_closed_fingers_squeeze(sample: Sample) -> None:
    """Flexion beyond the reference, from when they close, and more if decided."""
    flexion = finger_synergy_basis(HANDS)[:, 0]
    decided = one_synergy(sample, "squeeze", 2.0)
    for step, fraction in ((30, 0.0), (50, 0.5), (100, 1.0)):
        plain, squeezed = (targets(sample, HINGE, step=step, squeeze=squeeze)[..., 6:] for squeeze in (0.0, 0.2))
        np.testing.assert_allclose(squeezed - plain, np.broadcast_to(0.2 * fraction * flexion, plain.shape), atol=1e-5)
        more = targets(sample, HINGE, step=step, squeeze=0.2, synergy=decided)[..., 6:]
        np.testing.assert_allclose(more - plain, np.broadcast_to(0.4 * fraction * flexion, plain.shape), atol=1e-5)
    closed = targets(sample, TRANSPORT, step=0, squeeze=0.2, **SPEEDS)[..., 6:]
    np.testing.assert_allclose(closed, sample.finger_angles + 0.2 * flexion, atol=1e-5)


def test_a_hand_comes_in_with_palm_and_fingertips(sample: Sample) -> None:
    """Halfway its way bows by the whole arc to where no finger points and no palm looks; both ends are as before."""
    back = np.sqrt(0.5) * np.array([[-1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    for step, share in ((0, 0.0), (30, 1.0), (60, 0.0)):
        straight, bowed = (wrist_at(sample, targets(sample, HINGE, step=step, approach_arc=arc)) for arc in (0.0, 0.04))
        expected = numpy_reference.turned(straight[0], np.broadcast_to(back, straight[1].shape))
        np.testing.assert_allclose(bowed[1] - straight[1], 0.04 * share * expected, atol=1e-5)
    np.testing.assert_allclose(hand_backs(("right",)), back[1:], atol=1e-7)
