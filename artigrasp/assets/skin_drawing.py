"""Draws the skin of a hand: one closed mesh around its flesh, and how much each link holds of it."""

from typing import Any

import fast_simplification
import numpy as np
import trimesh
import warp as wp
import warp.geometry
from numpy.typing import NDArray
from scipy.ndimage import zoom
from scipy.sparse import coo_array, csr_array, eye_array
from scipy.sparse.linalg import factorized

from artigrasp.arrays import Array
from artigrasp.assets.hand_model import HandModel, mirror
from artigrasp.assets.hand_skin import SKIN_COLOUR, HandSkin, mirror_skin
from artigrasp.assets.skin_form import PALMAR, HandForm, hand_form, inner_side
from artigrasp.assets.skin_usd import INFLUENCES, WEIGHT_DIGITS
from artigrasp.kernels.layout import FINGERS, LINK_COUNT, LONG_FINGERS

CELL, STRIDE = 0.0015, 4
"""Edge length of the cells in which the surface is sought [m], and how many times that where it is not."""
SMOOTHING = 6
"""Rounds of smoothing of the fine mesh."""
AGGRESSIVENESS = (5.0, 5.5, 6.0, 6.5, 7.0)
"""Of the simplification, tried in turn: less does not reach the number of vertices, more has longer triangles."""
VERTEX_COUNT = 1900
"""About how many vertices a skin has."""
ROUNDS = 12
"""Of evening out the triangles."""
PROBE = 1e-4
"""Step by which the field's gradient is measured [m]."""
BEND = np.array([0.95, 0.75, 0.75])
"""Half the length over which the skin bends at the three joints of a finger, over the finger's radius there."""
MEMBERSHIP = 0.002
"""How fast neighbouring fingers lose hold of each other's skin [m]."""
SPREAD, WEB_SPREAD = 0.0022, 0.006
"""How far weights are spread over the surface, and before that the thumb's against the palm's [m]."""
PALE, FLUSH, NAIL = (0.80, 0.47, 0.34), (0.74, 0.31, 0.23), (0.87, 0.56, 0.47)
"""Linear RGB of the inner side, of tips and joints, and of nails."""
PALE_STRENGTH = 0.6
"""How much of it the inner side has."""


def draw_skin(hand: HandModel) -> HandSkin:
    """The skin of a hand in its zero pose; that of a left hand is the mirror image of a right one's."""
    if hand.side == "left":
        return mirror_skin(draw_skin(mirror(hand, hand.path)))
    form = hand_form(hand)
    vertices, faces = _mesh(form)
    return HandSkin(vertices, faces, _weights(form, vertices, faces), _colours(form, vertices), form.joints)


def _mesh(form: HandForm) -> tuple[Array, NDArray[np.int32]]:
    """A closed mesh of the flesh's surface, whose triangles are about even."""
    vertices, faces = _simplified(_fine_mesh(form))
    mean = _neighbour_mean(faces, len(vertices))
    for _ in range(ROUNDS):
        normal = _gradient(form, vertices)
        shift = mean @ vertices - vertices
        vertices = vertices + 0.5 * (shift - np.einsum("vi,vi->v", shift, normal)[:, None] * normal)
        vertices = vertices - form.distance(vertices)[:, None] * normal
    return vertices, faces


def _simplified(fine: trimesh.Trimesh) -> tuple[Array, NDArray[np.int32]]:
    """About the same closed surface, with about ``VERTEX_COUNT`` vertices unless that fails."""
    for aggressiveness in AGGRESSIVENESS:
        # A closed surface has about twice as many faces as vertices. In metres the tool would see degenerate ones only.
        vertices, faces = fast_simplification.simplify(
            np.asarray(1000 * fine.vertices, np.float32),
            np.asarray(fine.faces, np.int32),
            target_count=2 * VERTEX_COUNT,
            agg=aggressiveness,
        )
        coarse = trimesh.Trimesh(np.asarray(vertices, np.float64) / 1000, faces, process=False)
        # A ball's: now and then the tool folds an edge that must not be.
        if coarse.is_watertight and coarse.is_winding_consistent and coarse.euler_number == 2:
            return np.array(coarse.vertices), np.array(coarse.faces, np.int32)
    return np.array(fine.vertices), np.array(fine.faces, np.int32)


def _fine_mesh(form: HandForm) -> trimesh.Trimesh:
    """The flesh's surface by marching cubes."""
    low, high = form.bounds()
    count = np.ceil((high - low) / (STRIDE * CELL)).astype(int) + 3
    # Not such that a fingertip is in a corner of a cell: marching cubes make degenerate triangles there.
    low = low - 0.9 * STRIDE * CELL
    coarse = _grid(low, STRIDE * CELL, count)
    # Far from the surface a rough distance will do.
    rough = zoom(form.distance(coarse.reshape(-1, 3)).reshape(count), STRIDE, order=1, grid_mode=False)
    step = STRIDE * CELL * (count - 1) / (np.array(rough.shape) - 1)
    grid = _grid(low, step, np.array(rough.shape))
    near = np.abs(rough) < STRIDE * CELL
    rough[near] = form.distance(grid[near])
    corners, indices = wp.geometry.IsoSurfaceMarchingCubes.extract(
        wp.array(rough.astype(np.float32), dtype=float, device="cpu"),
        threshold=0.0,
        lower=wp.vec3(*grid[0, 0, 0]),
        upper=wp.vec3(*grid[-1, -1, -1]),
    )
    mesh = trimesh.Trimesh(corners.numpy(), indices.numpy().reshape(-1, 3))
    if mesh.volume < 0:
        mesh.invert()
    # Marching cubes leave slivers, on which a simplification would fold the surface.
    smooth: Any = trimesh.smoothing.filter_taubin
    smooth(mesh, iterations=SMOOTHING)
    return mesh


def _grid(low: Array, step: Array | float, count: NDArray[np.int64]) -> Array:
    """Points of a grid from a corner [m], shape (*count, 3)."""
    return np.asarray(low + step * np.moveaxis(np.indices(count.tolist()), 0, -1))


def _gradient(form: HandForm, points: Array) -> Array:
    """Unit gradients of the field, shape (P, 3)."""
    steps = PROBE * np.eye(3)
    slope = np.stack([form.distance(points + step) - form.distance(points - step) for step in steps], axis=1)
    return np.asarray(slope / np.linalg.norm(slope, axis=1, keepdims=True))


def _weights(form: HandForm, vertices: Array, faces: NDArray[np.int32]) -> Array:
    """How much of each link's motion a vertex takes part in, shape (V, 16)."""
    weights = np.zeros((len(vertices), LINK_COUNT))
    distances = np.stack([form.fingers[finger].distance(vertices) for finger in LONG_FINGERS], axis=1)
    member = np.exp(-(distances - distances.min(axis=1, keepdims=True)) / MEMBERSHIP)
    member /= member.sum(axis=1, keepdims=True)
    thumb = _spread(_thumb_share(form, vertices)[:, None], vertices, faces, WEB_SPREAD)[:, 0]
    for finger in FINGERS:
        first = 1 + 3 * FINGERS.index(finger)
        beyond = _beyond_joints(form, finger, vertices)
        if finger == "thumb":
            beyond[:, 0] = thumb
            beyond[:, 1:] *= thumb[:, None]
        else:
            beyond *= ((1 - thumb) * member[:, LONG_FINGERS.index(finger)])[:, None]
        # What is beyond a joint but not beyond the next follows the link between them.
        weights[:, first : first + 3] = beyond - np.pad(beyond[:, 1:], ((0, 0), (0, 1)))
    weights = np.maximum(weights, 0.0)
    weights[:, 0] = 1 - weights.sum(axis=1)
    weights = _spread(weights, vertices, faces, SPREAD)
    smallest_kept = np.sort(weights, axis=1)[:, -INFLUENCES, None]
    weights = np.where((weights >= smallest_kept) & (weights > 0.5 * 10.0**-WEIGHT_DIGITS), weights, 0.0)
    weights = np.round(weights / weights.sum(axis=1, keepdims=True), WEIGHT_DIGITS)
    # The largest takes what rounding has left.
    largest = (np.arange(len(weights)), weights.argmax(axis=1))
    weights[largest] += 1 - weights.sum(axis=1)
    return np.asarray(weights)


def _colours(form: HandForm, vertices: Array) -> Array:
    """Linear RGB of the vertices: the inner side is paler, tips and joints are redder, nails shine."""
    normal = _gradient(form, vertices)
    colour = SKIN_COLOUR + PALE_STRENGTH * _step(normal @ PALMAR / 0.8)[:, None] * (np.array(PALE) - SKIN_COLOUR)
    flush, nail = np.zeros(len(vertices)), np.zeros(len(vertices))
    for finger, limb in form.fingers.items():
        inner = inner_side(limb.points[[0, 2, 4, 6]], is_thumb=finger == "thumb")
        for node, strength, reach in ((0, 0.30, 1.1), (2, 0.45, 1.0), (4, 0.40, 0.9)):
            centre = limb.points[node] - limb.radii[node] * inner
            flush += strength * np.exp(-((np.linalg.norm(vertices - centre, axis=1) / (reach * limb.radii[node])) ** 2))
        centre = form.tips[finger] + 0.5 * limb.radii[6] * inner
        flush += 0.75 * np.exp(-((np.linalg.norm(vertices - centre, axis=1) / (1.3 * limb.radii[6])) ** 2))
        # A nail is from the middle of the last bone almost to the tip, on the outer side.
        along = form.tips[finger] - limb.points[4]
        length = float(np.linalg.norm(along))
        place = (vertices - limb.points[4]) @ along / length**2
        turned = normal @ -inner
        near = limb.distance(vertices) < 0.004
        ends = _step((place - 0.48) / 0.05) * _step((0.97 - place) / 0.04)
        nail = np.maximum(nail, near * ends * _step((turned - 0.62) / 0.1))
    colour += np.minimum(flush, 1.0)[:, None] * (np.array(FLUSH) - colour)
    colour += 0.8 * nail[:, None] * (np.array(NAIL) - colour)
    return np.asarray(colour)


def _beyond_joints(form: HandForm, finger: str, vertices: Array) -> Array:
    """How far vertices are beyond the three joints of a finger: 0 before, 1 beyond, shape (V, 3)."""
    first = 1 + 3 * FINGERS.index(finger)
    nodes = np.stack([*form.joints[first : first + 3], form.tips[finger]])
    bones = np.diff(nodes, axis=0)
    bones /= np.linalg.norm(bones, axis=1, keepdims=True)
    radii = form.fingers[finger].radii[[0, 2, 4]]
    beyond = []
    for joint in range(3):
        axis = bones[joint] + (bones[joint - 1] if joint else bones[joint])
        along = (vertices - nodes[joint]) @ axis / np.linalg.norm(axis)
        beyond.append(_step(along / (BEND[joint] * radii[joint])))
    return np.minimum.accumulate(np.stack(beyond, axis=1), axis=1)


def _thumb_share(form: HandForm, vertices: Array) -> Array:
    """How much vertices belong to the thumb rather than to the palm: more the nearer they are to its bones."""
    base, joint, last = (form.joints[1 + 3 * FINGERS.index("thumb") + k] for k in range(3))
    tip = form.tips["thumb"]
    to_thumb = np.min([_to_segment(vertices, *ends) for ends in ((base, joint), (joint, last), (last, tip))], axis=0)
    palm = [(np.array([-0.008, 0.0, 0.5 * knuckle[2]]), knuckle) for knuckle in _knuckles(form)]
    fingers = [(form.joints[1 + 3 * FINGERS.index(f)], form.tips[f]) for f in LONG_FINGERS]
    to_palm = np.min([_to_segment(vertices, *ends) for ends in [*palm, *fingers]], axis=0)
    share = _step((to_palm / (to_palm + to_thumb) - 0.5) / 0.32)
    along = (vertices - base) @ (joint - base) / np.linalg.norm(joint - base)
    return np.asarray(share * _step((along - 0.004) / 0.018))


def _knuckles(form: HandForm) -> list[Array]:
    return [form.joints[1 + 3 * FINGERS.index(finger)] for finger in LONG_FINGERS]


def _to_segment(points: Array, start: Array, end: Array) -> Array:
    along = end - start
    share = np.clip((points - start) @ along / (along @ along), 0.0, 1.0)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))


def _step(value: Array) -> Array:
    """From 0 at -1 to 1 at 1, smoothly."""
    share = np.clip((value + 1) / 2, 0.0, 1.0)
    return np.asarray(share**2 * (3 - 2 * share))


def _spread(weights: Array, vertices: Array, faces: NDArray[np.int32], distance: float) -> Array:
    """Weights after they have flowed along the surface for a while, which takes kinks out of them."""
    mean = _neighbour_mean(faces, len(vertices))
    edge = float(np.mean(np.linalg.norm(vertices[faces] - vertices[np.roll(faces, 1, axis=1)], axis=2)))
    time = (distance / edge) ** 2 * 2
    solve = factorized(((1 + time) * eye_array(len(vertices)) - time * mean).tocsc())
    return np.stack([solve(column) for column in weights.T], axis=1)


def _neighbour_mean(faces: NDArray[np.int32], count: int) -> csr_array:
    """The matrix that takes the mean over the neighbours of each vertex."""
    start, end = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]).T
    # On a closed surface each edge is there once in each direction.
    ones = coo_array((np.ones(len(start)), (start, end)), shape=(count, count)).tocsr()
    return csr_array(ones / np.asarray(ones.sum(axis=1))[:, None])
