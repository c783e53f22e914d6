"""The desk of somebody who types what the documents say: it holds what their placeholders stand for, by those names."""

import shutil
from contextlib import chdir
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from artigrasp.assets.library import find_asset
from artigrasp.cli import main
from artigrasp.evaluation.report import write_report
from artigrasp.motion.file import save_motion
from artigrasp.references.reference import ReferenceSet, join_references, load_references, save_references
from artigrasp.references.splits import HELD_OUT_SUBJECT
from artigrasp.training.evaluation import EvaluationPoint, write_evaluations
from tests.docs.commands import EIGHT, ROOT
from tests.evaluation.examples import evaluation_of, outcomes_of
from tests.motion.example import example_motion
from tests.references.arctic_example import write_release

ASSETS = "imported"
"""The folder of what an import would have made."""
STAND_IN = "open-box"
"""What stands in for the objects of ARCTIC."""
LEARNED = "waffleiron"
"""What the policies learned on; they have not seen the others."""
STORY = "ketchup-into-box"
"""A story of which only the second step is told, the shortest, which is content with anything."""
TRAINED = {
    "right-fixed": (),
    "right-fixed-synergy": (),
    "right-free-replay": ("RUN0", "RUN1", "RUN2", "FIRST_RUN", "SECOND_RUN"),
    "both-grasp-replay": ("RUN",),
    "artigrasp": (),
}
"""Trainings that have been run, and the other names of their folders."""
POLICIES = {
    "opens.pt": "right-free-replay",
    "again0.pt": "right-free-replay",
    "again1.pt": "right-free-replay",
    "again2.pt": "right-free-replay",
    "some-variants.pt": "right-free-replay",
    "without-boxes.pt": "right-free-replay",
    "OUT": "right-free-replay",
    "POLICY": "right-free-replay",
    "grasps.pt": "both-grasp-replay",
    "FILE": "artigrasp",
}
"""Policies, and the trainings that they come from."""


def lay_out(desk: Path) -> None:
    """Put everything there that a command of the documents may begin with."""
    with pytest.MonkeyPatch.context() as patch, chdir(desk):
        patch.setenv("ARTIGRASP_ASSETS", ASSETS)
        for name in (*EIGHT.split(), "capsulemachine", "phone"):
            _stand_in(name, Path(ASSETS))
        for name in ("FOLDER", "IMPORTED", "FOLDER_OF_IMPORTED_ASSETS"):
            Path(name).symlink_to(ASSETS)
        for task, others in TRAINED.items():
            _train(task, Path("runs", task, "TIME"))
            for other in others:
                Path(other).symlink_to(Path("runs", task, "TIME"))
        write_evaluations(Path("runs", "right-fixed", "TIME"), [EvaluationPoint(1, 300, 0.5, 0.4, suc_a=0.5)])
        for policy, task in POLICIES.items():
            shutil.copy(Path("runs", task, "TIME", "policy.pt"), policy)
        write_report([evaluation_of(outcomes_of(4))], Path("RUN"))
        for name in ("motion.npz", "laptop.npz", "story.npz", "MOTION", "MOTION.npz"):
            save_motion(Path(name), example_motion(hands=("left", "right")))
        write_release(Path("PATH"))
        for side in ("left", "right"):
            for path in (Path("my", "hands", f"long_{side}.usda"), Path(f"NAME_{side}.usda")):
                path.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(find_asset("hands", f"open_{side}"), path)
        shutil.copy(find_asset("objects", "open-laptop"), "open-laptop-7.usda")
        assert main(["import-object", str(ROOT / "docs/examples/toolbox/toolbox.urdf")]) == 0
        _stand_in("box", Path("unseen"))
        _stand_in("waffleiron", Path("synthesised"))
        Path("runs", "TASK").symlink_to("right-fixed")
        Path("EVALUATION").symlink_to("RUN")
        Path("assets_usd").symlink_to(ROOT / "assets_usd")
        Path("demo").mkdir()
        shutil.copy("motion.npz", "demo")
        story = yaml.safe_load(find_asset("stories", STORY).read_text(encoding="utf-8"))
        opening = {**story["steps"][1], "tolerance": 2.0}
        Path(STORY).write_text(yaml.safe_dump({**story, "steps": [opening]}), encoding="utf-8")


def _train(task: str, folder: Path) -> None:
    """As little as can be."""
    few = ["--iterations", "1", "--worlds", "4", "--threads", "1", "--objects", LEARNED, "--out", "made"]
    assert main(["train", task, *few]) == 0
    (made,) = Path("made", task).iterdir()
    folder.parent.mkdir(parents=True, exist_ok=True)
    made.rename(folder)


def _stand_in(name: str, root: Path) -> None:
    """An object by a name of ARCTIC's, with references in all the splits that those have."""
    path = root / "objects" / f"{name}.usda"
    path.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy(find_asset("objects", STAND_IN), path)
    references = load_references(STAND_IN)
    references = replace(references, object=name, subject=np.full(len(references), HELD_OUT_SUBJECT))
    given = [_in_split(references, split) for split in ("recon", "recon-mocap", "recon-refined")]
    save_references(root / "references" / f"{name}.npz", join_references([references, *given]))


def _in_split(references: ReferenceSet, split: str) -> ReferenceSet:
    """Some of them once more, in another split."""
    some = references.select(split="test")
    return replace(some, split=np.full(len(some), split))
