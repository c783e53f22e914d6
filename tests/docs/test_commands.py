"""Every command in the documents does what it is there for, with little of everything."""

import importlib
import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from artigrasp.assets.hand import load_hand
from artigrasp.cli import main
from artigrasp.controllers import library
from artigrasp.references import arctic
from artigrasp.viewer.viewer import Viewer
from tests.docs.commands import DOCUMENTS, ROOT, Command, read_commands
from tests.docs.desk import ASSETS, LEARNED, lay_out
from tools import compare_open_set

HISTORY = ROOT / "CHANGELOG.md"

NOT_RUN = {
    "make demo": "tests/cli/test_demo.py carries and opens an object",
    "make test": "runs this",
    "tools.author_gallery": "writes the page and the pictures that are shown",
    "tools.fuzz_readers": "tests/test_readers.py does the same, less often",
    "tools.interrupt_commands": "kills processes for minutes; tests/training/test_interruptions.py kills one",
    "tools.interrupt_import": "kills processes for minutes",
    "tools.measure_ablations": "runs processes of its own, of verbs that are run here",
    "tools.measure_variants": "runs processes of its own, of verbs that are run here",
    "tools.measure_extraction": "measures recordings of ARCTIC itself, of which there is no likeness",
    "tools.measure_viewer": "needs a browser",
    "tools.search_readers": "needs atheris, which is to be installed by hand",
}
"""Commands, or programs of the tools, that are not run here, and why."""


def reason_not_to_run(command: Command) -> str:
    """Why a command is not run, or nothing."""
    return NOT_RUN.get(command.program) or NOT_RUN.get(" ".join([command.program, *command.words]), "")


STANDS_FOR = {
    "CATEGORY": "laptop",
    "OBJECT": "open-box",
    "STORY": "ketchup-into-box",
    "VARIANTS": "open-box",
    "build/release": "PATH",
    "check-asset FILE": "open-laptop-7.usda",
    "cuda:0": "cpu",
    "evaluate TASK": "right-fixed",
    "generate NAME": "grasp-then-articulate",
    "import-object FILE": str(ROOT / "docs/examples/toolbox/toolbox.urdf"),
    "import-object docs/examples/toolbox/toolbox.urdf": str(ROOT / "docs/examples/toolbox/toolbox.urdf"),
    "synthesize-references open-espresso-machine": "open-box",
    "synthesize-references open-ketchup-bottle": "open-box",
    "synthesize-references open-scissors": "open-box",
    "synthesize-references open-waffle-iron": "open-box",
    "synthesize-references waffleiron": "open-box",
    "tools.plot_learning_curves OUT": "curves.png",
    "train TASK": "right-fixed",
    "view FILE": "motion.npz",
}
"""Words, or words of one verb, that stand for others; what stands for files lies on the desk by its name."""

QUICK = (
    "--help",
    "check-asset",
    "compare",
    "export-mano",
    "export-policy",
    "export-usd",
    "extract-references",
    "import-object",
    "list",
    "make-object",
    "python",
    "tools.average_policies",
    "tools.compare_open_set",
    "tools.paper_tables",
    "tools.picture_hand",
    "tools.plot_learning_curves",
)
"""Programs and verbs that take little time as they are."""
ONE = "--threads 1"
FEWER = {
    **dict.fromkeys(QUICK, ""),
    "bench": f"{ONE} --hands 1 --bases fixed --worlds 2 --rounds 1 --seconds 0.01",
    "evaluate": f"{ONE} --per-object 1",
    "evaluate images": f"{ONE} --per-object 1 --targets 1",
    "generate": ONE,
    "import-arctic": "--destination made",
    "refine-references": "--iterations 2 --starts 1",
    "render motion": "--width 48 --height 48 --fps 1 --out motion.webp",
    "render objects": "--size 32",
    "render references": "lidded-box --size 32 --indices 0",
    "synthesize-references": f"{ONE} --out made --count 1 --candidates 2 --draws 4 --iterations 5 --tries 1 --trials 1 "
    "--rollouts 1 --overwrite",
    "tell": f"{ONE} --search 1",
    "tools.check_rollout_gradients": "--steps 1",
    "tools.compare_mesh_signs": "box",
    "tools.compare_references": "--most 1",
    "tools.measure_capacities": "box --references 1",
    "tools.measure_rest": "box",
    "tools.measure_story": "--starts 1",
    "tools.relearn": "--rounds 1",
    "tools.stress": "--steps 400 --worlds 4",
    "tools.survey_physics": "--references 1 --objects box",
    "train": f"{ONE} --iterations 1 --worlds 4",
    "view": "--port 0",
    "view motion": "motion.npz --port 0",
}
"""What else a program, a verb, or a verb and its first word is told, so that there is less of it."""
LESS = {
    "--object": "open-box",
    "--objects": "box",
    "--search": "1",
    "--targets": "1",
    "--seed": "0",
    "tools.relearn --objects": LEARNED,
}
"""What options, or those of one program, are instead, where they are said at all."""
NAMES = {"refine-references": 1, "synthesize-references": 1, "tools.compare_references": 2}
"""How many words before the options are taken where there may be any number; of those after an option it is one."""


def more_words(command: Command) -> list[str] | None:
    """What a command is told besides, or None if nobody has said."""
    verb, *words = command.words if command.program == "artigrasp" else (command.program, *command.words)
    found = [FEWER[name] for name in (" ".join([verb, *words[:1]]), verb) if name in FEWER]
    return found[0].split() if found else None


def reduced(command: Command) -> Command:
    """A command with words for its placeholders and little to do."""
    words = list(command.words)
    verb = words.pop(0) if command.program == "artigrasp" else command.program
    options: dict[str, list[str]] = {"": []}
    option = ""
    for word in [*words, *(more_words(command) or [])]:
        if word.startswith("--"):
            option, options[word] = word, []
        else:
            word = STANDS_FOR.get(f"{verb} {word}", STANDS_FOR.get(word, word))
            options[option].append(LESS.get(f"{verb} {option}", LESS.get(option, word)))
    named = options.pop("")[: NAMES.get(verb)]
    few = [word for option, values in sorted(options.items()) for word in [option, *values[:1]]]
    start = [verb] if command.program == "artigrasp" else []
    return replace(command, document="", words=(*start, *named, *few))


EVERY = [each for document in DOCUMENTS if document != HISTORY for each in read_commands(document)]
RUN = [each for each in EVERY if not reason_not_to_run(each)]
CASES = dict.fromkeys(reduced(each) for each in RUN if more_words(each) is not None)


@pytest.fixture(scope="module")
def desk(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Where everybody works, with what is slow made quick."""
    folder = tmp_path_factory.mktemp("desk")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        patch.setattr(library, "SEARCH_ROLLOUTS", 2)
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


@pytest.mark.parametrize("command", CASES, ids=str)
def test_command(command: Command, desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It ends well."""
    for name, value in {"ARTIGRASP_ASSETS": ASSETS, "ARTIGRASP_CACHE": "cache", **dict(command.environment)}.items():
        monkeypatch.setenv(name, value)
    assert run(command, monkeypatch) == 0


def run(command: Command, monkeypatch: pytest.MonkeyPatch) -> int | str | None:
    """The exit code of a command that runs in this process."""
    if command.program == "artigrasp":
        return main(command.words)
    if command.program == "python":
        exec(command.words[1])
        return 0
    tool = importlib.import_module(command.program)
    monkeypatch.setattr(sys, "argv", [command.program, *command.words])
    try:
        return tool.main() or 0
    except SystemExit as end:
        return end.code or 0


def test_every_program_is_known() -> None:
    """Of each is said in FEWER or QUICK how to make it take seconds, or in NOT_RUN why it is not run."""
    assert not [str(each) for each in RUN if more_words(each) is None]


def test_what_is_not_run_is_there() -> None:
    """No reason is kept for a command that no document has any more."""
    assert not [start for start in NOT_RUN if not any(reason_not_to_run(each) == NOT_RUN[start] for each in EVERY)]
