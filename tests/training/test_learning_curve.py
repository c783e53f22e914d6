"""Learning curves: kept exactly, and drawn for one run or for several with their seeds."""

import math
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from artigrasp.errors import UserError
from artigrasp.tasks import get_curriculum
from artigrasp.training import learning_curve
from artigrasp.training.learning_curve import (
    CURVE_FILE,
    CurvePoint,
    join_stages,
    plot_curves,
    read_curve,
    write_curve,
)
from artigrasp.training.run_folder import CurriculumDescription, write_curriculum_description
from tools import plot_learning_curves as plot_tool

CURVE = [
    CurvePoint(1, 600, 1.25, 2.5, -3.0, 0.5, 0.75),
    CurvePoint(3, 1800, 3.5, 7.0, -2.0, 0.625, 0.25),
]


def test_the_learning_curve_is_kept_and_drawn(tmp_path: Path) -> None:
    """Its numbers come back exactly, also what is no number; the plot is a picture, of a single point or none too."""
    assert read_curve(tmp_path) == []
    for points in ([], CURVE[:1], CURVE):
        write_curve(tmp_path, points, "right-fixed-synergy on lidded-box")
        found = read_curve(tmp_path)
        assert [point.iteration for point in found] == [point.iteration for point in points]
        for point, expected in zip(found, points, strict=True):
            np.testing.assert_array_equal(list(vars(point).values()), list(vars(expected).values()))
        with Image.open(tmp_path / "learning_curve.png") as picture:
            assert min(picture.size) > 500
    assert (tmp_path / CURVE_FILE).read_text().splitlines()[1] == "1,600,1.25,2.5,-3.0,0.5,0.75,nan"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["learning_curve.csv", "learning_curve.png"]


def test_older_curves_are_read(tmp_path: Path) -> None:
    """Columns that were not measured then are no numbers now."""
    (tmp_path / CURVE_FILE).write_text("iteration,control_steps,wall_time,success,angle_error\n1,600,1.25,0.5,0.75\n")
    (point,) = read_curve(tmp_path)
    assert (point.iteration, point.control_steps, point.success) == (1, 600, 0.5)
    assert math.isnan(point.cpu_time) and math.isnan(point.lifted)


@pytest.mark.parametrize("line", ["1,600,x,2.5,1,1,1,1", "1,600", "1,600,1,1,1,1,1,1,1"])
def test_a_damaged_curve_is_named(tmp_path: Path, line: str) -> None:
    """Words, missing and surplus columns."""
    write_curve(tmp_path, [], "")
    with (tmp_path / CURVE_FILE).open("a") as file:
        file.write(line + "\n")
    with pytest.raises(UserError, match=f"{CURVE_FILE}: .*expected (numbers in|a value for each)"):
        read_curve(tmp_path)


def test_seeds_make_a_band(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The mean and the range of seeds where all of them have been, whatever steps each was measured at."""
    drawn: dict[str, tuple] = {}

    def draw(panel: object, places: np.ndarray, values: np.ndarray, label: str) -> None:
        drawn[label] = (places.tolist(), values.tolist())

    monkeypatch.setattr(learning_curve, "_plot_band", draw)
    first = [CurvePoint(i, steps * 10**6, 0.0, success=value) for i, (steps, value) in enumerate(((1, 0.0), (3, 1.0)))]
    second = [CurvePoint(i, steps * 10**6, 0.0, success=0.5) for i, steps in enumerate((0, 2, 4))]
    plot_curves(tmp_path / "curves.png", {"ours": [first, second], "nothing": [[]]}, "")
    assert drawn["ours"] == ([1.0, 2.0, 3.0], [[0.0, 0.5, 1.0], [0.5, 0.5, 0.5]])
    assert drawn["nothing"][0] == []


def test_stages_follow_each_other() -> None:
    """Steps and times of a stage count from where the one before ended; a stage without points adds nothing."""
    joined = join_stages([CURVE, [], CURVE[:1]])
    assert [point.iteration for point in joined] == [1, 3, 4]
    assert [point.control_steps for point in joined] == [600, 1800, 2400]
    assert [point.wall_time for point in joined] == [1.25, 3.5, 4.75]
    assert [point.success for point in joined] == [0.5, 0.625, 0.5]


def test_the_tool_draws_runs_and_curricula(tmp_path: Path) -> None:
    """Seeds of one name are drawn together; what is no run is named."""
    for folder in ("a", "b", "c/1-right-fixed", "c/3-both-free"):
        write_curve(tmp_path / folder, CURVE, "")
    write_curriculum_description(tmp_path / "c", CurriculumDescription(get_curriculum("artigrasp"), (), "train", 0))
    runs = plot_tool.named_runs([f"ours={tmp_path}/a,{tmp_path}/b", f"paper={tmp_path}/c"], evaluations=False)
    assert [len(curves) for curves in runs.values()] == [2, 1] and len(runs["paper"][0]) == 4
    plot_curves(tmp_path / "both.png", runs, "", ("control_steps", "cpu_time"))
    for word, message in ((str(tmp_path), "expected NAME=RUN"), (f"x={tmp_path}", "expected a run with a learning")):
        with pytest.raises(UserError, match=message):
            plot_tool.named_runs([word], evaluations=False)
