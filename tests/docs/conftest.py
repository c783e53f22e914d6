"""The desk at which tests do what the documents say."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.controllers import library
from artigrasp.environment.environment import Environment
from artigrasp.references import arctic
from artigrasp.viewer.viewer import Viewer
from tests.docs.desk import lay_out
from tools import compare_open_set

EPISODE = 40
"""Control steps of an episode, at most: every trial fails, but is played, measured and written down."""


@pytest.fixture(scope="package")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where everybody works, with what is slow made quick."""
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(library, "SEARCH_ROLLOUTS", 2)
        patch.setattr(Environment, "episode_steps", property(lambda self: min(EPISODE, self._machine.episode_steps)))
        patch.setattr(arctic, "draw_skin", lambda hand: load_hand("open", hand.side).skin)
        patch.setattr(Viewer, "run", run_once)
        patch.setattr(compare_open_set, "VARIANTS", 1)
        lay_out(folder)
        yield folder


run_viewer = Viewer.run


def run_once(viewer: Viewer) -> None:
    """Serve, and stop at once."""
    viewer.stop()
    run_viewer(viewer)
