"""What can be viewed: whatever has tracks with a timeline."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from artigrasp.motion.motion import Motion
from artigrasp.viewer.recording import Track


@dataclass(frozen=True)
class Picker:
    """A choice that a subject offers.

    Attributes:
        label: What is chosen.
        options: Among what, at least one.
        value: What is chosen now.
    """

    label: str
    options: tuple[str, ...]
    value: str


class Subject(Protocol):
    """A motion, references, or a task that is simulated while it is watched.

    Everything here returns at once: what takes long is done by a thread of the subject's own, and only as far as it is
    asked for.
    """

    @property
    def title(self) -> str:
        """What it is, in a few words."""
        ...

    @property
    def status(self) -> str:
        """What must be known about it now, such as what went wrong; empty if nothing."""
        ...

    @property
    def generation(self) -> int:
        """Counts up whenever other tracks, pickers or another duration are to be shown."""
        ...

    @property
    def pickers(self) -> Sequence[Picker]:
        """What can be chosen."""
        ...

    @property
    def tracks(self) -> Sequence[Track]:
        """What is shown side by side, on one timeline; empty while there is nothing yet."""
        ...

    @property
    def duration(self) -> float:
        """Length of the timeline [s]."""
        ...

    @property
    def is_live(self) -> bool:
        """Whether another episode follows at the end of this one."""
        ...

    @property
    def reward_terms(self) -> Sequence[str]:
        """Terms of the reward that samples tell as signals; the same for good."""
        ...

    def pick(self, label: str, option: str) -> None:
        """Choose an option of the picker with this label."""
        ...

    def demand(self, time: float) -> float:
        """Ask for samples up to a time [s].

        Returns:
            Up to where there are some [s].
        """
        ...

    def begin_anew(self) -> None:
        """Begin another episode, or the same again if there is only one."""
        ...

    def motion(self) -> Motion:
        """What is shown, as a motion to save.

        Raises:
            UserError: It is no motion.
        """
        ...

    def close(self) -> None:
        """End its threads."""
        ...
