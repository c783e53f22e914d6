"""What acts in a task that is watched: a controller, or the newest policy of a run."""

from pathlib import Path
from typing import Protocol

from artigrasp.controllers.controller import Controller, PolicyController
from artigrasp.controllers.policy_file import load_policy
from artigrasp.training.runner import POLICY


class Pilot(Protocol):
    """Gives each episode its controller."""

    label: str
    """What acts, in words."""

    def controller(self) -> Controller:
        """What acts in the next episode.

        Raises:
            UserError: There is nothing that could, yet.
        """
        ...


class SteadyPilot:
    """The same controller in every episode."""

    def __init__(self, controller: Controller, label: str) -> None:
        """Let this one act."""
        self._controller, self.label = controller, label

    def controller(self) -> Controller:
        """The controller."""
        return self._controller


class RunPilot:
    """The policy of a training run as it is when an episode begins: a newer one is taken as soon as it is there."""

    def __init__(self, folder: Path) -> None:
        """Watch this run folder; it may be empty yet."""
        self._path = folder / POLICY
        self.label = "no policy yet"
        self._seen: tuple[int, int] | None = None
        self._controller: Controller | None = None

    def controller(self) -> Controller:
        """The newest policy.

        Raises:
            UserError: There is none yet, or it is malformed.
        """
        try:
            stat = self._path.stat()
            seen = (stat.st_mtime_ns, stat.st_ino)
        except OSError:
            seen = None
        if self._controller is None or seen not in (None, self._seen):
            policy = load_policy(self._path)
            self._controller, self._seen = PolicyController(policy), seen
            self.label = f"policy of iteration {policy.iteration}, {policy.control_steps:,} control steps"
        return self._controller
