"""`artigrasp tell`: a story of several objects as one motion."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import tyro

from artigrasp.assets.library import find_file
from artigrasp.cli.output import show, show_json
from artigrasp.cli.progress import progress_bar
from artigrasp.cli.warp_start import start_warp
from artigrasp.config import SimulatorConfig
from artigrasp.errors import UserError
from artigrasp.files import check_target


@dataclass(frozen=True)
class Options:
    """Simulate a story: hands open, move and close several objects of one scene, step after step, without resets.

    Each step takes the scene as the last one left it. The references by which it may be done are tried in simulation,
    by policies and then by PD+IK, then a search around the nearest; if a later step cannot be done, the next best way
    of an earlier one is taken. Of a story that fails the motion shows as far as it went; the exit code is 1.

    With --json: {"motion": file or null, "done": whether all steps were done, "steps": [what became of each that was
    tried], "problem": which step was not done and why, or empty, "rollouts": episodes simulated, "metrics": {name:
    value}}.
    """

    story: Annotated[str, tyro.conf.Positional]
    """YAML file, or name of a shipped story."""
    policy: str | None = None
    """Policy that opens and closes, where hands do not hold the object already, before PD+IK does: a file, or a name of
    `artigrasp list policies`."""
    grasp_policy: str | None = None
    """The same for grasping and carrying."""
    out: Path = Path("story.npz")
    """Motion file to write."""
    search: int = 32
    """Rollouts of a search around a reference where no reference does a step by itself; 1 for none."""
    start_shift: float = 0.0
    """Objects stand anywhere up to so far from their places along x and along y [m]."""
    start_turn: float = 0.0
    """They are turned about the vertical by anything up to this from how they should stand [rad]."""
    seed: int = 0
    """Seed of where objects stand, and of the searches."""
    simulator: SimulatorConfig = SimulatorConfig()
    """Backend, device and threads."""
    json: bool = False
    """Print JSON."""

    def __post_init__(self) -> None:
        if self.search < 1:
            raise UserError(f"search: expected at least 1, found {self.search}")
        for name in ("start_shift", "start_turn"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise UserError(f"{name}: expected 0 or a positive number, found {getattr(self, name):g}")


def run(options: Options) -> int:
    """Tell the story."""
    from artigrasp.stories.file import read_story

    story = read_story(find_file("stories", options.story))
    asked = {"articulate": options.policy, "grasp": options.grasp_policy}
    files = {skill: find_file("policies", each) for skill, each in asked.items() if each is not None}
    check_target(options.out)
    start_warp()
    from artigrasp.controllers.controller import PolicyController
    from artigrasp.controllers.policy_file import load_policy
    from artigrasp.motion.file import save_motion
    from artigrasp.stories.recording import story_motion
    from artigrasp.stories.start import scatter_objects
    from artigrasp.stories.teller import Teller, TellerSettings

    story = scatter_objects(story, options.start_shift, options.start_turn, options.seed)
    policies = []
    for skill, file in files.items():
        policy = load_policy(file)
        if skill not in policy.task.kinds:
            found = " and ".join(policy.task.kinds)
            raise UserError(f"policy: expected one that learned to {skill}, found one for {found}")
        policies.append(PolicyController(policy))
    settings = TellerSettings(rollouts=options.search, seed=options.seed)
    with progress_bar("Telling", hidden=options.json) as progress:
        teller = Teller(story, settings, options.simulator, policies, on_progress=progress)
        tale = teller.tell()
    motion = story_motion(tale, teller) if tale.takes else None
    if motion is not None:
        save_motion(options.out, motion)
    steps = motion.provenance["steps"].splitlines() if motion is not None else []
    if options.json:
        show_json(
            {
                "motion": None if motion is None else str(options.out),
                "done": tale.is_whole,
                "steps": steps,
                "problem": tale.problem,
                "rollouts": tale.tried,
                "metrics": {} if motion is None else dict(motion.metrics),
            }
        )
    else:
        for number, line in enumerate(steps, start=1):
            show(f"{number}. {line}")
        end = "all steps done" if tale.is_whole else f"stopped at {tale.problem}"
        show(f"{end}; {tale.tried} episodes simulated")
        if motion is not None:
            show(f"wrote {options.out}")
    return 0 if tale.is_whole else 1
