"""`artigrasp list`: what a command line may name."""

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import tyro

from artigrasp.cli.output import show, show_columns, show_json


@dataclass(frozen=True)
class Options:
    """List tasks, objects, references and policies.

    With --json, references are counted as {"splits": {split: count}, "per_object": {object: {split: {kind: count}}},
    "other_objects": likewise}, where splits and per_object cover the paper's eight objects. Splits are those that each
    reference was given, as "train", and two schemes that part the same references anew, as "by-sequence/train", so that
    counts of all splits do not add up. Tasks and curricula are {name: description}; objects and policies are lists of
    names; all of them are one table with these four keys.
    """

    what: Annotated[Literal["all", "tasks", "objects", "references", "policies"], tyro.conf.Positional] = "all"
    """What to list."""
    json: bool = False
    """Print JSON."""


def run(options: Options) -> int:
    """Print the names."""
    wanted = list(_GATHER) if options.what == "all" else [options.what]
    found = {what: _GATHER[what]() for what in wanted}
    if options.json:
        show_json(found if options.what == "all" else found[options.what])
        return 0
    for what in wanted:
        if options.what == "all":
            show(f"{what.capitalize()}:")
        rows = _rows(what, found[what])
        show_columns(rows or [("  none",)])
    return 0


def count_references() -> dict[str, Any]:
    """The number of references per object, split and kind, as the help text describes it."""
    from artigrasp.assets.library import list_assets
    from artigrasp.references.reference import load_references
    from artigrasp.tasks.objects import PAPER_OBJECTS

    per_object: dict[str, dict[str, dict[str, int]]] = {}
    for name in list_assets("references"):
        references = load_references(name)
        of_split = {split: references.select(split=split) for split in references.splits()}
        per_object[name] = {split: dict(sorted(Counter(of.kind.tolist()).items())) for split, of in of_split.items()}
    of_paper = {name: per_object[name] for name in per_object if name in PAPER_OBJECTS}
    splits: Counter[str] = Counter()
    for per_split in of_paper.values():
        splits.update({split: sum(kinds.values()) for split, kinds in per_split.items()})
    others = {name: per_object[name] for name in per_object if name not in of_paper}
    return {"splits": dict(splits), "per_object": of_paper, "other_objects": others}


def _tasks() -> dict[str, str]:
    from artigrasp.tasks import CURRICULA, TASKS

    curricula = {name: curriculum.description for name, curriculum in CURRICULA.items()}
    return {name: task.description for name, task in TASKS.items()} | curricula


def _objects() -> list[str]:
    from artigrasp.assets.library import list_assets

    return list_assets("objects")


def _policies() -> list[str]:
    from artigrasp.assets.library import list_assets

    return list_assets("policies")


_GATHER: dict[str, Callable[[], Any]] = {
    "tasks": _tasks,
    "objects": _objects,
    "references": count_references,
    "policies": _policies,
}


def _rows(what: str, found: Any) -> list[tuple[str, ...]]:
    if what == "tasks":
        return [(f"  {name}", description) for name, description in found.items()]
    if what == "references":
        from artigrasp.references.reference import KINDS

        per_object: dict[str, dict[str, dict[str, int]]] = found["per_object"] | found["other_objects"]
        return [
            (f"  {name}", split, *(f"{kinds.get(kind, 0)} {kind}" for kind in KINDS))
            for name, per_split in per_object.items()
            for split, kinds in per_split.items()
        ]
    return [(f"  {name}",) for name in found]
