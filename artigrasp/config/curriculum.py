"""A curriculum: tasks that are trained one after the other, each from where those before it ended."""

from dataclasses import dataclass

from artigrasp.config.checks import FieldError, require_name
from artigrasp.config.task import TaskConfig


@dataclass(frozen=True)
class CurriculumConfig:
    """Stages that end in one policy."""

    name: str
    """Name on the command line: lower case words joined by hyphens."""
    description: str
    """One line for `artigrasp list tasks`."""
    stages: tuple[TaskConfig, ...]
    """Trained in this order. A network begins as the newest stage left it that has one of that name, else anew. The
    last stage's policy is the result; one without iterations only gathers the networks of those before."""
    objects: tuple[str, ...] = ()
    """Objects to train on where none are asked for; empty for the command's own default."""

    def __post_init__(self) -> None:
        require_name(self, "name")
        if not self.stages:
            raise FieldError.mismatch("stages", "at least one", self.stages)
        shapes = {(stage.ppo.hidden_sizes, stage.ppo.activation, tuple(stage.action.terms)) for stage in self.stages}
        if len(shapes) > 1:
            raise FieldError("stages", "expected networks and actions of one shape, found several")
