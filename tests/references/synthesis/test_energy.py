"""The energy of synthesised grips: its terms against plain NumPy, its gradient against differences of itself."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.object import load_object
from artigrasp.config import SynthesisConfig
from artigrasp.kernels.layout import TIP_LINKS
from artigrasp.references.energy import PosedHands, differentiate
from artigrasp.references.hand_distance import PartMeshes
from artigrasp.references.natural_pose import mirror_fingers, relaxed_pose
from artigrasp.references.synthesis.energy import SynthesisEnergy, press_weights, rotate
from artigrasp.references.synthesis.fingertips import Fingertips, start_poses, tip_centres
from artigrasp.references.synthesis.grip import GRIPS, Grip, rest
from artigrasp.references.synthesis.intents import THUMB, Intents, draw_intents
from artigrasp.references.synthesis.surface import sample_surface

RESTING = rest(load_object("lidded-box"))
SURFACE = sample_surface(RESTING, 600, seed=0)
MESHES = PartMeshes([RESTING.model], "cpu")
HANDS = {side: load_hand("open", side) for side in ("left", "right")}
CONFIG = SynthesisConfig(limits_scale=0.5)
MIRROR = np.array([-1.0, 1.0, 1.0])


def make_energy(grip: Grip, intents: Intents, start: tuple[np.ndarray, np.ndarray]) -> SynthesisEnergy:
    """The energy of a grip of the lidded box."""
    hands = [HANDS[side] for side in grip.sides]
    return SynthesisEnergy(grip, intents, start, RESTING, hands, relaxed_pose(), CONFIG, MESHES)


def draw(grip: Grip, count: int) -> tuple[Intents, tuple[np.ndarray, np.ndarray]]:
    """Some intents and where hands start with them."""
    intents = draw_intents(grip, RESTING, SURFACE, count, 0)
    assert intents is not None
    return intents, start_poses(intents, [HANDS[side] for side in grip.sides], relaxed_pose(), 0)


@pytest.mark.parametrize("name", ["articulate-left", "grasp-both"])
def test_the_gradient_is_that_of_the_energy(name: str) -> None:
    """Along random directions, with every term at work."""
    energy = make_energy(GRIPS[name], *draw(GRIPS[name], 6))
    start = energy.posed.hands.joint_q.numpy().copy()
    _, gradient = energy.evaluate()
    random, step = np.random.default_rng(0), 2e-4
    agree = []
    for _ in range(4):
        direction = random.normal(size=start.shape).astype(np.float32)
        direction[..., :3] *= 0.1
        ends = []
        for sign in (1, -1):
            energy.posed.hands.joint_q.assign(start + sign * step * direction)
            ends.append(energy.evaluate()[0].numpy())
        expected = (ends[0] - ends[1]) / (2 * step)
        found = np.einsum("whd,whd->w", gradient.numpy(), direction)
        agree.append(np.abs(found - expected) < 0.03 * np.abs(expected) + 0.01 * np.abs(expected).max())
    # where the nearest point of a link jumps from one to another, differences see both
    assert np.mean(agree) > 0.85


def test_terms_of_fingertips_are_what_numpy_says() -> None:
    """Anchors, pads, leverage and balance, from forward kinematics by itself."""
    grip = GRIPS["articulate-right"]
    intents, start = draw(grip, 5)
    energy = make_energy(grip, intents, start)
    found: dict[str, torch.Tensor] = {}

    def keep(posed: PosedHands) -> torch.Tensor:
        found.update(energy.terms(posed))
        return torch.stack(list(found.values())).sum(dim=0)

    total, _ = differentiate(energy.posed, keep)
    tips = Fingertips([HANDS["right"]])
    offset = tip_centres(*start, [HANDS["right"]], tips) - intents.target - intents.normal * tips.radius[..., None]
    expected = CONFIG.anchor * ((offset**2).sum(-1) * intents.busy / CONFIG.anchor_scale**2).sum(axis=(1, 2))
    np.testing.assert_allclose(found["anchor"].detach().numpy(), expected, rtol=1e-3)
    frames = energy.posed.hands.link_pose.numpy()[:, 0, list(TIP_LINKS)]
    pads = np.stack([Rotation.from_quat(each[:, 3:]).apply(tips.pad[0]) for each in frames])
    cosine = (pads * intents.normal[:, 0]).sum(-1)
    expected = CONFIG.pads * ((np.maximum(0.5 + cosine, 0) / 0.3) ** 2 * intents.busy[:, 0]).sum(axis=1)
    np.testing.assert_allclose(found["pads"].detach().numpy(), expected, rtol=1e-3, atol=1e-4)
    np.testing.assert_allclose(total, sum(term.detach() for term in found.values()), rtol=1e-5)
    assert "balance" not in found and (found["leverage"] >= 0).all()


def test_a_mirrored_hand_costs_the_same_on_the_mirrored_object() -> None:
    """The box is its own mirror image across x = 0: left grips cost what their mirror images cost right ones."""
    right, (wrist, fingers) = draw(GRIPS["articulate-right"], 8)
    left = replace(right, target=right.target * MIRROR, normal=right.normal * MIRROR, across=right.across * MIRROR)
    mirrored = (wrist * [-1, 1, 1, 1, -1, -1, 1], mirror_fingers(fingers))
    one, _ = make_energy(GRIPS["articulate-right"], right, (wrist, fingers)).evaluate()
    other, _ = make_energy(GRIPS["articulate-left"], left, mirrored).evaluate()
    np.testing.assert_allclose(other, one, rtol=0.02)


def test_fingers_of_a_hand_press_as_much_as_its_thumb() -> None:
    """Whichever are busy; idle ones do not press."""
    busy = np.zeros((1, 1, 5), bool)
    busy[0, 0, [THUMB, 1, 3]] = True
    assert press_weights(busy)[0, 0].tolist() == [1.0, 0.5, 0.0, 0.5, 0.0]


def test_vectors_turn_as_scipy_says() -> None:
    """By quaternions in the order x y z w."""
    random = np.random.default_rng(0)
    turns, vectors = Rotation.random(7, rng=random), random.normal(size=(7, 3))
    found = rotate(torch.tensor(turns.as_quat()), torch.tensor(vectors))
    np.testing.assert_allclose(found, turns.apply(vectors), atol=1e-12)
