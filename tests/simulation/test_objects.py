"""Every object that can be imported, in every kind of scene, side by side with the others in one batch."""

import numpy as np
import pytest
import warp as wp
from scipy.spatial.transform import Rotation

from artigrasp.assets.hand import load_hand
from artigrasp.assets.library import list_assets
from artigrasp.assets.object import load_object
from artigrasp.config import PhysicsConfig
from artigrasp.kernels.layout import LINKS, PARTS
from artigrasp.references.reference import load_references
from artigrasp.simulation.backend import Simulation
from artigrasp.simulation.cpu import CpuSimulation
from artigrasp.simulation.newton import NewtonSimulation
from artigrasp.simulation.scene import Scene, object_label

ARCTIC_OBJECTS = (
    "box", "capsulemachine", "espressomachine", "ketchup", "laptop", "microwave", "mixer", "notebook", "phone",
    "waffleiron",
)  # fmt: skip


@pytest.fixture(scope="module")
def object_names() -> tuple[str, ...]:
    """The shipped object and all of ARCTIC's; skipped where these were not imported."""
    if missing := set(ARCTIC_OBJECTS) - set(list_assets("objects")):
        pytest.skip(f"import ARCTIC and set ARTIGRASP_ASSETS to run this test: {', '.join(sorted(missing))} not found")
    return ("lidded-box", *ARCTIC_OBJECTS)


@pytest.fixture(scope="module", params=[("right",), ("left", "right")], ids=["one-hand", "two-hands"])
def sides(request: pytest.FixtureRequest) -> tuple[str, ...]:
    """Hands of the scene."""
    return tuple(request.param)


@pytest.fixture(scope="module", params=[True, False], ids=["fixed", "free"])
def scenes(request: pytest.FixtureRequest, object_names: tuple[str, ...], sides: tuple[str, ...]) -> list[Scene]:
    """Scenes of all objects: one hand at a fixed base, two at a free one; of every fourth the other way round, too."""
    hands = tuple(load_hand("mano", side) for side in sides)
    names = object_names[:: 1 if request.param == (len(sides) == 1) else 4]
    return [Scene(hands, (load_object(name),), request.param, PhysicsConfig()) for name in names]


def masses_on_cpu(simulation: CpuSimulation) -> list[dict[str, float]]:
    """Mass of every body, world by world."""
    return [
        {model.body(body).name: float(model.body_mass[body]) for body in range(model.nbody)}
        for model in simulation.models
    ]


def masses_of_newton(simulation: NewtonSimulation) -> list[dict[str, float]]:
    """The masses that MuJoCo Warp computes with."""
    names = ["_".join(label.split("/")[-2:]) for label in simulation._model.body_label]
    bodies, masses = simulation._solver.mjc_body_to_newton.numpy(), simulation._solver.mjw_model.body_mass.numpy()
    return [
        {names[body]: float(mass) for body, mass in zip(*world, strict=True) if body >= 0}
        for world in zip(bodies, masses, strict=True)
    ]


def start(simulation: Simulation) -> None:
    """Objects as they stand in their first reference, open hands just over them."""
    hands, objects = simulation.state.hands, simulation.state.objects
    references = [load_references(scene.objects[0].name) for scene in simulation.scenes]
    poses = np.stack([each.object_pose[0] for each in references])
    angles = np.array([each.object_angle[0] for each in references])
    base = np.zeros((simulation.world_count, simulation.hand_count, 7))
    base[..., 6] = 1.0
    for world, (scene, pose, angle) in enumerate(zip(simulation.scenes, poses, angles, strict=True)):
        vertices = Rotation.from_quat(pose[3:]).apply(scene.objects[0].vertices_in_base(angle)) + pose[:3]
        # fingers reach sideways, so that each hand stands over the middle
        base[world, :, :3] = *vertices.mean(axis=0)[:2], vertices[:, 2].max() + 0.05
        base[world, :, 1] += 0.2 * np.arange(simulation.hand_count)
    hands.hand_base.assign(base.astype(np.float32))
    objects.pose.assign(poses.astype(np.float32))
    objects.hinge_q.assign(angles.astype(np.float32))
    simulation.write_state(wp.full(simulation.world_count, 1, dtype=int, device="cpu"))


def test_every_object_in_one_batch(scenes: list[Scene]) -> None:
    """Masses are the assets', hands press on what they find below them, nothing fails, and both backends agree."""
    cpu = CpuSimulation(scenes, [1] * len(scenes), thread_count=2)
    newton = NewtonSimulation(scenes, [1] * len(scenes), capture=False)
    for found in (masses_on_cpu(cpu), masses_of_newton(newton)):
        for scene, masses in zip(scenes, found, strict=True):
            for part, model in zip(PARTS, scene.objects[0].parts, strict=True):
                assert masses[f"{object_label(0)}_{part}"] == pytest.approx(model.mass, rel=1e-4), scene.objects[0].name
            for hand in scene.hands:
                for link, mass in zip(LINKS, hand.link_mass, strict=True):
                    assert masses[f"{hand.side}_{link}"] == pytest.approx(mass, rel=1e-4)
    ends = []
    for simulation in (cpu, newton):
        start(simulation)
        before = simulation.state.objects.pose.numpy().copy()
        torque = np.zeros(simulation.joint_torque.shape, dtype=np.float32)
        torque[..., 2] = -20.0
        simulation.joint_torque.assign(torque)
        for _ in range(6):
            simulation.step(lambda rows: None)
        state = simulation.state
        assert (state.diverged.numpy() == 0).all()
        for group, names in ((state.hands, ("joint_q", "contact_force")), (state.objects, ("pose", "hinge_q"))):
            for name in names:
                assert np.isfinite(getattr(group, name).numpy()).all(), name
        assert np.abs(state.objects.pose.numpy()[:, :3] - before[:, :3]).max() < 0.03, "objects stay where they stood"
        ends.append(state.objects.pose.numpy()[:, :3])
    assert (newton.state.overflow_count.numpy() == 0).all()
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-3)
