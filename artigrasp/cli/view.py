"""`artigrasp view`: motions, references, tasks and training runs in a browser."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import tyro

from artigrasp.cli.output import show, show_json
from artigrasp.config import SimulatorConfig

if TYPE_CHECKING:
    from artigrasp.config import TaskConfig
    from artigrasp.viewer.pilot import Pilot
    from artigrasp.viewer.subject import Subject


@dataclass(frozen=True, kw_only=True)
class Serving:
    """What every view has."""

    port: int = 8080
    """Port to listen at; 0 takes a free one."""
    host: str = "localhost"
    """Host to listen at; 0.0.0.0 lets other machines in."""
    simulator: SimulatorConfig = field(default_factory=SimulatorConfig)
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""


@dataclass(frozen=True)
class Motion(Serving):
    """Play motion files, several of them side by side."""

    files: Annotated[tuple[Path, ...], tyro.conf.Positional]
    """Motion files, as `artigrasp generate` writes them."""


@dataclass(frozen=True)
class References(Serving):
    """Look at the references of objects; reference contacts are marked on them."""

    objects: Annotated[tuple[str, ...], tyro.conf.Positional] = ()
    """Objects to choose from; by default all that have references."""


@dataclass(frozen=True)
class Task(Serving):
    """Watch a task while it is simulated, under a policy or a baseline."""

    task: Annotated[str | None, tyro.conf.Positional] = None
    """Task to play; by default the policy's, else right-fixed."""
    objects: tuple[str, ...] = ("lidded-box",)
    """Objects to choose from."""
    controller: str | None = None
    """What acts: policy, pd-ik, d-grasp, search or zero; by default the policy if there is one, else pd-ik."""
    policy: str | None = None
    """Policy of the controller "policy": a file, or a name of `artigrasp list policies`."""
    split: str = "test"
    """Split whose references are played."""
    worlds: int = 4
    """Environments that are simulated at once, to choose from."""
    seed: int = 0
    """Seed of everything that is drawn."""


@dataclass(frozen=True)
class Run(Serving):
    """Watch what a training has learned so far; a newer policy takes over with the next episode."""

    folder: Annotated[Path, tyro.conf.Positional]
    """Run folder, as `artigrasp train` makes it."""
    split: str = "test"
    """Split whose references are played."""
    worlds: int = 4
    """Environments that are simulated at once, to choose from."""
    seed: int = 0
    """Seed of everything that is drawn."""


@dataclass(frozen=True)
class Options:
    """Show motions, references, a task or a training run in a browser.

    Over ssh, forward the port: ssh -L 8080:localhost:8080 HOST. Nothing leaves this machine, and nothing is computed
    while no browser is connected. Ctrl-C ends it.

    With --json: {"url": address to open}, as soon as it can be opened.
    """

    what: Annotated[
        Annotated[Motion, tyro.conf.subcommand("motion")]
        | Annotated[References, tyro.conf.subcommand("references")]
        | Annotated[Task, tyro.conf.subcommand("task")]
        | Annotated[Run, tyro.conf.subcommand("run")],
        tyro.conf.arg(name=""),
    ]


def run(options: Options) -> int:
    """Serve until the user has seen enough."""
    from artigrasp.cli.warp_start import start_warp

    start_warp()
    from artigrasp.assets.library import asset_files, list_assets
    from artigrasp.viewer.server import Server
    from artigrasp.viewer.viewer import Viewer

    what = options.what
    subjects = _SUBJECTS[type(what)](what)
    server = Server(what.host, what.port)
    viewer = Viewer(
        subjects, server, objects=list_assets("references"), policies=asset_files("policies"), simulator=what.simulator
    )
    if what.json:
        show_json({"url": server.url})
    else:
        show(f"{server.url} shows {next(iter(subjects))}; Ctrl-C ends it")
    try:
        viewer.run()
    except KeyboardInterrupt:
        return 0
    finally:
        server.stop()
    return 0


def _motions(what: Motion) -> "dict[str, Subject]":
    from artigrasp.errors import UserError
    from artigrasp.motion.file import load_motion
    from artigrasp.viewer.motion_subject import MotionSubject

    if not what.files:
        raise UserError("expected one or more motion files, found none")
    same = len({path.name for path in what.files}) < len(what.files)
    motions = [(str(path) if same else path.name, load_motion(path)) for path in what.files]
    alone: dict[str, Subject] = {name: MotionSubject([(name, motion)]) for name, motion in motions}
    return alone if len(motions) == 1 else {"side by side": MotionSubject(motions), **alone}


def _references(what: References) -> "dict[str, Subject]":
    from artigrasp.assets.library import list_assets
    from artigrasp.viewer.reference_subject import ReferenceSubject

    return {"references": ReferenceSubject(what.objects or list_assets("references"))}


def _task(what: Task) -> "dict[str, Subject]":
    from artigrasp.assets.library import find_file
    from artigrasp.cli.policies import played_task
    from artigrasp.controllers.library import make_controller
    from artigrasp.controllers.policy_file import load_policy
    from artigrasp.viewer.pilot import SteadyPilot

    policy = None if what.policy is None else load_policy(find_file("policies", what.policy))
    task = played_task(what.task, policy)
    name = what.controller or ("pd-ik" if policy is None else "policy")
    controller = make_controller(name, task=task, policy=policy, seed=what.seed)
    pilot = SteadyPilot(controller, what.policy if name == "policy" and what.policy else name)
    return {f"{task.name}, live": _live(what, task, pilot, what.objects)}


def _run(what: Run) -> "dict[str, Subject]":
    from artigrasp.training.run_folder import read_run_description
    from artigrasp.viewer.pilot import RunPilot

    run = read_run_description(what.folder)
    return {f"{what.folder}, live": _live(what, run.task, RunPilot(what.folder), run.objects)}


def _live(what: Task | Run, task: "TaskConfig", pilot: "Pilot", objects: tuple[str, ...]) -> "Subject":
    """Some worlds of a task, with plots of the terms of the reward that count in it."""
    from artigrasp.kernels.outcomes import OUTCOME_TERMS
    from artigrasp.kernels.rewards import TERMS
    from artigrasp.viewer.live_subject import LiveSubject

    return LiveSubject(
        task.name,
        pilot,
        objects,
        reward_terms=[term for term in (*TERMS, *OUTCOME_TERMS) if task.reward.counts(term)],
        split=what.split,
        world_count=what.worlds,
        seed=what.seed,
        simulator=what.simulator,
    )


_SUBJECTS: "dict[type[Serving], Callable[[Any], dict[str, Subject]]]" = {
    Motion: _motions,
    References: _references,
    Task: _task,
    Run: _run,
}
