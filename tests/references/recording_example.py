"""A made-up recording whose interactions are known, in both layouts that extraction reads, and its assets.

The lidded box stands for ARCTIC's box, the open hands for MANO's. In the recording both hands hold the box from frame
30 on and carry it from 40 to 70; the right hand lies on the lid from frame 120 on and opens it from 130 to 160. From
frame 190 on the box slides, but nobody touches it.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial.transform import RigidTransform, Rotation

from artigrasp.assets.arctic_hand import mean_pose_path, save_mean_pose
from artigrasp.assets.hand import load_hand, write_hand
from artigrasp.assets.object import load_object, write_object
from artigrasp.kernels.layout import HANDS
from artigrasp.references.arctic_sequence import Recording
from artigrasp.references.mano_pose import WRIST_FROM_MANO
from tests.references.arctic_example import save

FRAME_COUNT = 220
RECORDING = Recording("s1", "box_use_01")
CARRIED, OPENED, SLID = (40, 70), (130, 160), (190, 210)
HELD, ON_LID = (30, 90), (120, 180)
MEAN_POSE = np.full(45, 0.01)
ASIDE = {"left": [-0.5, 0.0, 0.3], "right": [0.5, 0.0, 0.3]}
HOLDING = {"left": [-0.08, 0.09, 0.045], "right": [0.08, -0.09, 0.045]}
"""Wrists in the base whose fingers lie along the back and the front."""
LYING = [0.05, -0.02, 0.187]
"""Wrist in the lid's frame from which the lower edge of the right hand lies on the lid."""


def write_assets(folder: Path) -> None:
    """Assets as an import leaves them."""
    box = load_object("lidded-box")
    write_object(replace(box, name="box", path=folder / "objects" / "box.usda"))
    for side in HANDS:
        write_hand(replace(load_hand("open", side), name="mano", path=folder / "hands" / f"mano_{side}.usda"))
    save_mean_pose(mean_pose_path(folder), dict.fromkeys(HANDS, MEAN_POSE))


def write_recording(root: Path, layout: str, *, contacts: bool = True, reconstructed: bool = False) -> Path:
    """The recording in the layout ``"release"`` or ``"download"``, of which only the first has contacts."""
    states, hands = _states(), _hands()
    subject, sequence, _ = RECORDING
    if reconstructed:
        # The object stays where it is, in front of a camera that looks from aside.
        turn = Rotation.from_rotvec([0.3, -0.8, 0.2])
        for hand in hands.values():
            away = hand["trans"] + hand["offset"] - states[:, 4:] / 1000
            hand["trans"] = turn.apply(away) - hand["offset"] + np.array([0.0, 0.0, 1.5])
            hand["rot"] = (turn * Rotation.from_rotvec(hand["rot"])).as_rotvec()
        states[:, 1:4], states[:, 4:] = turn.as_rotvec(), [0.0, 0.0, 1500.0]
    mano = {side: {name: hands[side][name].astype(np.float32) for name in ("rot", "pose", "trans")} for side in HANDS}
    if layout == "download":
        template = root / "meta" / "object_vtemplates" / "box" / "mesh.obj"
        template.parent.mkdir(parents=True, exist_ok=True)
        template.touch()
        folder = root / "raw_seqs" / "s01"
        save(folder / f"{sequence}.mano.npy", mano)
        save(folder / f"{sequence}.object.npy", states)
        return root
    folder = f"{subject}_recon" if reconstructed else subject
    objects, double = root / "rsc" / "arctic" / "box", root / "rsc" / "mano_double"
    objects.mkdir(parents=True, exist_ok=True)
    (objects / "box.urdf").touch()
    save(objects / folder / f"{sequence}.object.npy", states)
    save(double / folder / f"{sequence}.mano.npy", mano)
    for hand, side in enumerate(HANDS) if contacts else ():
        name = "contact_recon" if reconstructed else "contact"
        save(double / name / subject / f"{sequence}_a_{side[0]}.npy", given_contacts()[:, hand].astype(float))
    return root


def given_contacts() -> np.ndarray:
    """Which links touch the lid, the base and either, shape (FRAME_COUNT, 2, 3, 16)."""
    result = np.zeros((FRAME_COUNT, 2, 3, 16), bool)
    result[slice(*HELD), :, 1, :12] = True
    result[slice(*ON_LID), 1, 0, 5:9] = True
    result[:, :, 2] = result[:, :, :2].any(axis=2)
    return result


def _ramp(frames: tuple[int, int], size: float) -> np.ndarray:
    first, last = frames
    return size * np.clip((np.arange(FRAME_COUNT) - first) / (last - first), 0, 1)


def _states() -> np.ndarray:
    states = np.zeros((FRAME_COUNT, 7))
    states[:, 0] = _ramp(OPENED, 1.2)
    rise = (_ramp(CARRIED, 1.0) * (1 - _ramp(CARRIED, 1.0))) * 4
    states[:, 4] = 40.0 + 300 * _ramp(CARRIED, 1.0) + 300 * _ramp(SLID, 1.0)
    states[:, 6] = 1000.0 + 200 * rise
    return states


def _hands() -> dict[str, dict[str, np.ndarray]]:
    box, states = load_object("lidded-box"), _states()
    hands: dict[str, dict[str, np.ndarray]] = {}
    for side in HANDS:
        rows = []
        for frame, state in enumerate(states):
            base = RigidTransform.from_translation(state[4:] / 1000)
            position, orientation = box.articulated_pose_in_base(state[0])
            lid = base * RigidTransform.from_components(position, Rotation.from_quat(orientation))
            pose = base * RigidTransform.from_translation(ASIDE[side])
            if HELD[0] <= frame < HELD[1]:
                pose = base * RigidTransform.from_translation(HOLDING[side])
            elif side == "right" and ON_LID[0] <= frame < ON_LID[1]:
                pose = lid * RigidTransform.from_translation(LYING)
            rows.append(np.concatenate([pose.rotation.as_rotvec(), pose.translation - WRIST_FROM_MANO[side]]))
        rotation, translation = np.split(np.array(rows), 2, axis=1)
        offset = WRIST_FROM_MANO[side]
        pose = np.tile(-MEAN_POSE, (FRAME_COUNT, 1))
        hands[side] = {"rot": rotation, "trans": translation, "pose": pose, "offset": offset}
    return hands
