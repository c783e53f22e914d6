"""Picture a hand: spread, at rest and as a fist; its skin from either side, and the links that collide.

    python -m tools.picture_hand docs/images/open-hand.webp [--hand open] [--side right] [--size 240]

Fists show whether the skin folds as it should, spread fingers whether it has gaps.
"""

import argparse
from pathlib import Path

import numpy as np

from artigrasp.arrays import Array
from artigrasp.assets.hand import load_hand
from artigrasp.cli.warp_start import start_warp
from artigrasp.export.camera import look_at
from artigrasp.export.hand_surface import hand_surface
from artigrasp.export.image_file import save_image
from artigrasp.export.raycaster import render_surface
from artigrasp.export.surface import rest
from artigrasp.kernels.layout import FINGERS, HANDS
from artigrasp.motion.kinematics import reference_link_poses
from artigrasp.motion.motion import MotionReference
from artigrasp.references.natural_pose import mirror_fingers, relaxed_pose

SPREAD = {"index": 0.25, "middle": 0.05, "ring": -0.12, "pinky": -0.3}
"""Turn of the fingers aside [rad]."""
CURL = (1.45, 1.65, 1.0)
"""Flexion of the joints of a finger in a fist [rad]."""
FIST_THUMB = ((0.75, -0.2, 0.45), (0.0, -0.6, 0.25), (0.0, -0.8, 0.0))
"""Turns of the thumb's joints in a fist [rad]."""
BACK, PALM = (0.7071068, 0.0, 0.0, 0.7071068), (-0.7071068, 0.0, 0.0, 0.7071068)
"""Turns of the wrist such that either side of the hand looks up, quaternion xyzw."""
DIRECTION = (np.radians(-70.0), np.radians(50.0))
"""Where the camera is: azimuth from x, elevation [rad]."""


def shown_angles() -> list[Array]:
    """Finger angles of right hands that spread, rest and make a fist [rad], shape [45]."""
    spread, fist = np.zeros((2, len(FINGERS), 3, 3))
    for finger, turn in SPREAD.items():
        spread[FINGERS.index(finger), 0, 1] = turn
        fist[FINGERS.index(finger), :, 2] = CURL
    fist[FINGERS.index("thumb")] = FIST_THUMB
    return [spread.ravel(), relaxed_pose().mean, fist.ravel()]


def main() -> None:
    """Render and write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("out", type=Path)
    parser.add_argument("--hand", default="open")
    parser.add_argument("--side", choices=HANDS, default="right")
    parser.add_argument("--size", type=int, default=240, help="width and height of each picture [px]")
    options = parser.parse_args()
    start_warp()
    hand = load_hand(options.hand, options.side)
    angles = np.array([each if options.side == "right" else mirror_fingers(each) for each in shown_angles()])
    rows = []
    for rigid, turn in ((False, BACK), (False, PALM), (True, BACK)):
        wrists = np.tile(np.array([0.0, 0.0, 0.0, *turn], np.float32), (len(angles), 1))
        posed = MotionReference(np.zeros(len(angles), np.int64), wrists, angles.astype(np.float32))
        surface = hand_surface(hand, rigid=rigid)
        links = reference_link_poses(posed, [hand] * len(angles))
        scenes = [rest(surface.posed(each)) for each in links]
        view = look_at(np.concatenate([each.vertices for each in scenes]), DIRECTION, 1.0)
        row = [render_surface(each, surface.colours, view, width=options.size, height=options.size) for each in scenes]
        rows.append(np.concatenate(row, axis=1))
    save_image(np.concatenate(rows), options.out)


if __name__ == "__main__":
    main()
