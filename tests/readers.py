"""Every reader of the project with whole files to damage: a few times in tests, for minutes by `tools/fuzz_readers`."""

import atexit
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory, mkdtemp

import numpy as np
import pytest
import torch
import trimesh
import warp as wp
import yaml
from hypothesis import strategies as st
from pxr import Sdf

from artigrasp.arrays import save_arrays
from artigrasp.assets.arctic import ArcticSource
from artigrasp.assets.check import check_asset
from artigrasp.assets.fidelity import Fidelity
from artigrasp.assets.hand import load_hand, read_hand, write_hand
from artigrasp.assets.hand_skin import HandSkin
from artigrasp.assets.imported_object import MESHES, load_mesh, make_imported
from artigrasp.assets.library import packaged_root
from artigrasp.assets.mano_hand import read_mano
from artigrasp.assets.object import read_object, write_object
from artigrasp.assets.urdf_object import read_urdf_object
from artigrasp.assets.usd_object import read_usd_object
from artigrasp.config import CurriculumConfig, SimulatorConfig, read_task, write_task
from artigrasp.controllers.policy_file import load_policy, save_policy
from artigrasp.controllers.search import with_offsets
from artigrasp.environment.make import make_environment
from artigrasp.errors import UserError
from artigrasp.evaluation.articulation import ArticulationOutcomes
from artigrasp.evaluation.chunks import CHUNK_FORMAT, CHUNK_VERSION, load_chunk
from artigrasp.evaluation.comparison import compare, comparison_table, load_run
from artigrasp.evaluation.demonstrations import load_demonstrations
from artigrasp.evaluation.report import write_report
from artigrasp.evaluation.synthesis_file import MADE_BY, SynthesisFile
from artigrasp.kernels.layout import LINKS
from artigrasp.motion.file import load_motion, save_motion
from artigrasp.references import arctic
from artigrasp.references.arctic import import_arctic
from artigrasp.references.arctic_sequence import find_recordings, read_sequence
from artigrasp.references.manifest import Manifest
from artigrasp.references.reference import describe_provenance, read_references, save_references
from artigrasp.stories.file import read_story
from artigrasp.training.evaluation import EvaluationPoint, read_evaluations, write_evaluations
from artigrasp.training.learning_curve import CURVE_FILE, CurvePoint, read_curve, write_points
from artigrasp.training.run_folder import (
    CurriculumDescription,
    RunDescription,
    read_curriculum_description,
    read_run_description,
    write_curriculum_description,
    write_run_description,
)
from artigrasp.training.runner import CHECKPOINT, Runner
from tests.assets.foreign import foreign_urdf, foreign_usd
from tests.controllers.examples import example_policy
from tests.evaluation.examples import TASK, evaluation_of, found_by_search, outcomes_of
from tests.example_references import box_references
from tests.fuzzing import damage, draw_file
from tests.motion.example import example_motion
from tests.references import arctic_example
from tests.stories.test_file import STORY
from tests.training.examples import make_env, small_paper

TOOLBOX = Path(__file__).parents[1] / "docs/examples/toolbox"
SETTINGS = {"hand": "open", "settings": {"seed": 0}}


@dataclass(frozen=True)
class Reader:
    """Something that reads files that a user brings.

    Attributes:
        name: What it reads.
        write: Writes whole files into a folder that is there and empty; one of them will be damaged.
        read: Reads what is in such a folder.
        slow: Whether one input takes more than a tenth of a second.
    """

    name: str
    write: Callable[[Path], object]
    read: Callable[[Path], object]
    slow: bool = False


def _search_report(folder: Path) -> None:
    """What an evaluation of a search leaves."""
    found = found_by_search()
    outcomes = outcomes_of(4, goal_angle=[0.5, 1.0])
    task = with_offsets(TASK)
    write_report([evaluation_of(outcomes, controller="search", rollout_count=8, found=found, task=task)], folder)
    for path in folder.iterdir():
        if path.suffix in (".png", ".md"):
            path.unlink()


def _compare_with_itself(folder: Path) -> str:
    run = load_run(folder)
    return comparison_table(compare(run, run))


def _synthesis(path: Path) -> None:
    references = box_references(test_count=1)
    grips = {"articulate-left": {"count": {}, "references": [{"source": str(each)} for each in references.source]}}
    provenance = describe_provenance(MADE_BY, **SETTINGS, grips=grips)
    save_references(path, replace(references, provenance=provenance))


def _chunk(path: Path) -> None:
    columns = outcomes_of(3).columns()
    save_arrays(path, CHUNK_FORMAT, CHUNK_VERSION, {**columns, "wall_time": np.array([1.0])})


def _policy(path: Path) -> None:
    small = replace(TASK, ppo=replace(TASK.ppo, hidden_sizes=(4,)))
    save_policy(example_policy(small, learner={"processes": [], "cpu_time": 1.0}), path)


@cache
def _runner() -> Runner:
    """A learner that is resumed over and over, in worlds that are shared: what it reads is all that matters."""
    folder = Path(mkdtemp())
    atexit.register(shutil.rmtree, folder)
    return Runner(make_env(small_paper()), folder, seed=0)


def _checkpoint(folder: Path) -> None:
    """A checkpoint in the middle of episodes, and its curves."""
    runner = _runner()
    runner.env.restart()
    runner.env.step(torch.zeros(runner.env.num_envs, runner.env.num_actions))
    runner.save()
    for path in runner.folder.iterdir():
        if path.name in (CHECKPOINT, CURVE_FILE):
            shutil.copy(path, folder)


def _resume(folder: Path) -> None:
    for path in folder.iterdir():
        shutil.copy(path, _runner().folder)
    _runner().resume()
    _runner().start_from(_runner().folder / CHECKPOINT)


def _hand(path: Path) -> None:
    """The open hand in hardly any skin: all of it takes a second to read."""
    hand = load_hand("open", "right")
    assert hand.skin is not None
    corners = np.array([[0, 0, 0], [0.01, 0, 0], [0, 0.01, 0], [0, 0, 0.01]])
    skin = HandSkin(
        vertices=corners,
        faces=np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]], np.int32),
        weights=np.eye(len(LINKS))[:4],
        colours=np.full((4, 3), 0.5),
        link_origin=hand.skin.link_origin,
    )
    write_hand(replace(hand, path=path, skin=skin))


def _assets(folder: Path) -> None:
    """Object, references and hand of a small world."""
    for name in ("objects/lidded-box.usda", "references/lidded-box.npz", "hands/open_right.usda"):
        (folder / name).parent.mkdir()
        shutil.copy(packaged_root() / name, folder / name)


def _simulate(folder: Path) -> None:
    """What is read is also good for something: worlds are made of it, and step."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ARTIGRASP_ASSETS", str(folder))
        environment = make_environment(small_paper(), ("lidded-box",))
    environment.reset()
    shape = (environment.world_count, environment.hand_count, environment.action_count)
    environment.step(wp.zeros(shape, dtype=float))
    assert np.isfinite(environment.observe().numpy()).all()


def _object(path: Path) -> None:
    with TemporaryDirectory() as folder:
        write_object(make_imported(read_urdf_object(foreign_urdf(Path(folder))), "case", path))


def _packed_usd(folder: Path) -> None:
    """A USD file of somebody else's in binary, and one that it refers to."""
    foreign_usd(folder / "part.usdc", "Z", 1.0)
    layer = Sdf.Layer.CreateNew(str(folder / "case.usda"))
    layer.subLayerPaths.append("./part.usdc")
    layer.Save()


def _meshes(folder: Path) -> None:
    solid = trimesh.creation.box((0.1, 0.2, 0.3))
    for suffix in MESHES:
        solid.export(folder / f"mesh{suffix}")


def _read_meshes(folder: Path) -> None:
    for suffix in MESHES:
        load_mesh(folder / f"mesh{suffix}", np.ones(3))


def _curves(folder: Path) -> None:
    write_points(folder / CURVE_FILE, [CurvePoint(each, 300 * each, 0.5, success=0.25) for each in (1, 2)], CurvePoint)
    write_evaluations(folder, [EvaluationPoint(1, 300, 0.5, 0.4, suc_a=0.5)])


@contextmanager
def uncut() -> Iterator[None]:
    """In imports meshes are their own only pieces, unmeasured, and hands get the open hand's skin: all that is slow."""
    skin = cache(lambda side: load_hand("open", side).skin)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arctic, "cut_meshes", lambda meshes, processes, progress: None)
        patch.setattr(arctic, "convex_pieces", lambda mesh: (mesh,))
        patch.setattr(arctic, "measure_fidelity", lambda mesh, pieces: Fidelity(1, 0, 1.0, 0.0, 0.0, 0.0, 0.0))
        patch.setattr(arctic, "draw_skin", lambda hand: skin(hand.side))
        yield


def _import(folder: Path) -> None:
    """Import a damaged copy of ARCTIC, and read every file that is left, in its own way."""
    with TemporaryDirectory() as name, uncut():
        assets = Path(name)
        try:
            import_arctic(folder, destination=assets)
        finally:
            check_imported(assets)


def _recordings(folder: Path) -> None:
    """The recordings of the release, and those of the download."""
    arctic_example.write_release(folder / "release", labels=False)
    arctic_example.write_download(folder / "download", objects=("box",))
    for path in folder.rglob("*"):
        if path.is_file() and path.suffix != ".npy":
            path.unlink()


def _read_recordings(folder: Path) -> None:
    found = ArcticSource(folder, folder / "release" / "rsc", folder / "download/arctic_data/data", None)
    for source in (replace(found, release=None), replace(found, download=None)):
        for reconstructed in (False, True):
            for recording in find_recordings(source, "box", reconstructed=reconstructed):
                read_sequence(source, recording)


def check_imported(assets: Path) -> None:
    """Read every file that an import of ARCTIC left."""
    left = [path for path in assets.rglob("*") if path.is_file() and path.name != "manifest.json"]
    for path in left:
        name = path.relative_to(assets).as_posix()
        if name.startswith("objects"):
            model = read_object(path)
            assert all(0 < part.mass < 1e6 for part in model.parts)
        elif name.endswith("mean_pose.npz"):
            assert np.load(path)["left"].shape == (45,)
        elif name.startswith("hands"):
            assert np.isfinite(read_hand(path).link_mass).all()
        else:
            assert name == "references/box.npz" and len(read_references(path)) > 0


RUN = RunDescription(TASK, ("lidded-box",), "train", 0)
STAGES = CurriculumConfig("two-stages", "made by hand", (TASK, replace(TASK, name="right-free")))
CURRICULUM = CurriculumDescription(STAGES, ("lidded-box",), "train", 0)

READERS = (
    Reader("motion", lambda to: save_motion(to / "m.npz", example_motion(sample_count=2)),
           lambda at: load_motion(at / "m.npz")),
    Reader("references", lambda to: save_references(to / "r.npz", box_references(test_count=1)),
           lambda at: read_references(at / "r.npz")),
    Reader("synthesised references", lambda to: _synthesis(to / "r.npz"),
           lambda at: SynthesisFile(at / "r.npz", SETTINGS).made_of("articulate-left")),
    Reader("demonstrations, metrics and trials", _search_report,
           lambda at: (load_demonstrations(at / "demonstrations.npz"), _compare_with_itself(at))),
    Reader("evaluation chunk", lambda to: _chunk(to / "c.npz"),
           lambda at: load_chunk(at / "c.npz", ArticulationOutcomes, 3)),
    Reader("policy and checkpoint", lambda to: _policy(to / "p.pt"), lambda at: load_policy(at / "p.pt")),
    Reader("checkpoint to go on from", _checkpoint, _resume),
    Reader("task", lambda to: write_task(to / "task.json", TASK), lambda at: read_task(at / "task.json")),
    Reader("run folder", lambda to: (write_run_description(to, RUN, SimulatorConfig()), _curves(to)),
           lambda at: (read_run_description(at), read_curve(at), read_evaluations(at))),
    Reader("curriculum", lambda to: write_curriculum_description(to, CURRICULUM), read_curriculum_description),
    Reader("manifest", lambda to: Manifest(to).add(Path(shutil.copy(__file__, to / "file")), "hash"),
           lambda at: Manifest(at).has(at / "file", "hash")),
    Reader("story", lambda to: (to / "s.yaml").write_text(yaml.safe_dump(STORY)), lambda at: read_story(at / "s.yaml")),
    Reader("object, USD", lambda to: _object(to / "o.usda"), lambda at: check_asset(at / "o.usda"), slow=True),
    Reader("hand, USD", lambda to: _hand(to / "h.usda"), lambda at: read_hand(at / "h.usda"), slow=True),
    Reader("assets, simulated", _assets, _simulate, slow=True),
    Reader("foreign object, USD text", lambda to: foreign_usd(to / "case.usda", "Z", 0.01),
           lambda at: make_imported(read_usd_object(at / "case.usda"), "case", at / "o.usda"), slow=True),
    Reader("foreign object, USD binary", _packed_usd, lambda at: read_usd_object(at / "case.usda"), slow=True),
    Reader("foreign object, URDF and mesh", lambda to: shutil.copytree(TOOLBOX, to, dirs_exist_ok=True),
           lambda at: read_urdf_object(at / "toolbox.urdf"), slow=True),
    Reader("meshes", _meshes, _read_meshes),
    Reader("MANO model", lambda to: arctic_example.write_mano(to / "MANO_RIGHT.pkl", arctic_example.mano_model()),
           lambda at: read_mano(at / "MANO_RIGHT.pkl", "mano", "right", at / "h.usda")),
    Reader("ARCTIC, recordings", _recordings, _read_recordings),
    Reader("ARCTIC, release", arctic_example.write_release, _import, slow=True),
    Reader("ARCTIC, release with labelled frames", arctic_example.write_labelled_release, _import, slow=True),
    Reader("ARCTIC, download", lambda to: arctic_example.write_download(to, objects=("box",), parted=False), _import,
           slow=True),
)  # fmt: skip


def damage_and_read(data: st.DataObject, reader: Reader, whole: Path, folder: Path) -> tuple[str, UserError | None]:
    """Damage one file of a copy of a whole folder, and read the copy.

    Args:
        data: Draws what to do.
        reader: What reads.
        whole: Folder that the reader's files were written to.
        folder: A new folder, to work in.

    Returns:
        How it was damaged, and the error if it was refused.

    Raises:
        Exception: The reader raises what is no UserError, tells more than one line, or runs a pickle.
    """
    copy = shutil.copytree(whole, folder / "copy")
    kind = damage(data, draw_file(data, copy), folder / "sign")
    refusal = None
    try:
        reader.read(copy)
    except UserError as error:
        refusal = error
    assert not (folder / "sign").exists(), "a pickle was run"
    assert refusal is None or "\n" not in str(refusal), f"more than one line: {refusal}"
    return kind, refusal
