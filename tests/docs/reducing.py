"""How there is less of a command: words for its placeholders, and little to do."""

from dataclasses import replace

from tests.docs.commands import ROOT, Command
from tests.docs.desk import LEARNED

STANDS_FOR = {
    "CATEGORY": "laptop",
    "OBJECT": "open-box",
    "STORY": "ketchup-into-box",
    "VARIANTS": "open-box",
    "build/release": "PATH",
    "check-asset FILE": "open-laptop-7.usda",
    "cuda:0": "cpu",
    "evaluate TASK": "right-fixed",
    "export-policy POLICY": "lidded-box",
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
    "export-usd",
    "extract-references",
    "import-object",
    "list",
    "make-object",
    "python",
    "tools.average_policies",
    "tools.compare_open_set",
    "tools.paper_tables",
    "tools.plot_learning_curves",
)
"""Programs and verbs that take little time as they are."""
ONE = "--threads 1"
FEWER = {
    **dict.fromkeys(QUICK, ""),
    "bench": f"{ONE} --alternatives off --objects box --hands 1 --bases fixed --worlds 2 --rounds 1 --seconds 0.01",
    "evaluate": f"{ONE} --objects box --per-object 1",
    "evaluate images": f"{ONE} --objects box --per-object 1 --targets 1",
    "export-policy": "--out exported",
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
    "tools.measure_costs": "--rounds 1 --worlds 1",
    "tools.picture_frames": "--size 48",
    "tools.picture_hand": "--size 24",
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
NAMES = {"refine-references": 1, "render": 2, "synthesize-references": 1, "tools.compare_references": 2}
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
