"""Damaged files: a few at every run of the tests, many where somebody asks for them (`make fuzz`)."""

import io
import json
import os
import pickle
import re
import traceback
import warnings
import zipfile
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import torch
import yaml
from hypothesis import event, settings
from hypothesis import strategies as st

from artigrasp.assets.mano_hand import CLASSES
from artigrasp.errors import UserError
from artigrasp.restricted_pickle import read_pickle

KINDS = ("missing", "cut", "bytes", "member", "array", "unit", "huge", "text", "line", "value", "pickle", "made up")
TRAPS = {
    ".json": ("[" * 100_000, '{"keypoints": ' * 50_000, "1" * 10_000, '{"format": "artigrasp.manifest", "version": 3}'),
    ".urdf": (
        '<!DOCTYPE r [<!ENTITY a "aaaaaaaaaa">'
        + "".join(f'<!ENTITY {x} "{10 * f"&{y};"}">' for y, x in pairwise("abcdefghij"))
        + "]><robot>&j;</robot>",
        "<robot>" + "<link>" * 50_000,
        "<robot/>",
    ),
    ".obj": ("v 0 0 0\n" * 20_000 + "f 1 2 3\n" * 20_000, "v 1 2 3\nf 1 1 1\n", "v 0 0 0\nf 999999999999 2 3\n"),
    ".txt": ("0.1 " * 100_000, "1e999 " * 45, "9" * 10_000),
    ".csv": ("x" * 1_000_000, "a,b\n" + "1,2,3\n" * 10, "a\0b\n1\n", '"'),
    ".yaml": (
        # a list of lists of lists of the same word, a billion times
        "format: artigrasp.story\nversion: 1\nobjects: &a0 [x]\n"
        + "".join(f"a{n + 1}: &a{n + 1} [{9 * f'*a{n}, '}]\n" for n in range(9))
        + "steps: *a9",
        "format: artigrasp.story\nversion: 1\nsteps: &a [*a]",
        "[" * 2_000,
        "? " * 2_000,
        "format: !!python/object/apply:os.getcwd []",
        "format: artigrasp.story\nversion: 1\nobjects: 2001-01-01\nsteps: [{? [a] : b}]",
    ),
    ".usda": (
        "#usda 1.0\n" + "def Xform " + "'a' { def Xform " * 5_000,
        "#usda 1.0\n(\n    subLayers = [@/etc/passwd@]\n)\n",
        "#usda 1.0\n" + 'def "a" (references = </a>) {}\n',
        "#usda 1.0\n",
    ),
}
"""Texts that take a simple reader long, or far."""
WORD = re.compile(r"""[^\s,;:=@"'()<>{}\[\]]+""")
OTHER_WORDS = (
    "",
    '"',
    "9" * 30,
    "nan",
    "inf",
    "-1",
    "1e300",
    "-1e999",
    "0",
    "1e-30",
    "99999",
    "é",
    "None",
    "true",
    "..",
)


def examples(count: int) -> settings:
    """So many inputs, the same at every run, or so many times the variable ``ARTIGRASP_FUZZ``, others at every run."""
    times = os.environ.get("ARTIGRASP_FUZZ")
    return settings(max_examples=count * int(times or "1"), derandomize=not times, deadline=None)


def note(kind: str, refusal: UserError | None) -> None:
    """Count in the statistics of a run how inputs of a kind ended."""
    event(f"{kind}: {'read' if refusal is None else 'refused'}")


def crash_of(error: Exception) -> str:
    """What was raised, where, and how its message begins."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__} at {Path(place.filename).name}:{place.lineno}: {str(error)[:100]!r}"


def draw_file(data: st.DataObject, root: Path) -> Path:
    """One of the files below a folder."""
    return data.draw(st.sampled_from(sorted(path for path in root.rglob("*") if path.is_file())))


class MakesFolder:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return os.mkdir, (str(self.path),)


def damage(data: st.DataObject, path: Path, sign: Path) -> str:
    """Damage a file; how.

    Args:
        data: Draws what to do.
        path: The file.
        sign: A folder that pickles make when they are run.
    """
    content, is_array = path.read_bytes(), path.suffix in (".npy", ".npz")
    is_text = path.suffix in (".json", ".urdf", ".obj", ".txt", ".csv", ".yaml", ".usda")
    kind = data.draw(st.sampled_from(KINDS))
    if kind == "missing":
        path.unlink()
    elif kind == "cut":
        path.write_bytes(content[: data.draw(st.integers(0, max(len(content) - 1, 0)))])
    elif kind == "bytes":
        at = data.draw(st.integers(0, max(len(content) - 1, 0)))
        path.write_bytes(content[:at] + data.draw(st.binary(min_size=1, max_size=8)) + content[at + 1 :])
    elif kind == "member" and zipfile.is_zipfile(path):
        damage_member(data, path)
    elif kind == "line" and is_text:
        lines = content.decode().splitlines()
        first, second = (data.draw(st.integers(0, max(len(lines) - 1, 0))) for _ in range(2))
        lines[first : first + 1] = lines[second : second + data.draw(st.integers(0, 2))]
        path.write_text("\n".join(lines))
    elif kind == "value" and path.suffix in DOCUMENTS:
        damage_value(data, path)
    elif kind == "array" and is_array:
        damage_array(data, path)
    elif kind == "unit" and (is_array or path.suffix in (".obj", ".txt")):
        damage_unit(path, data.draw(st.sampled_from([1000.0, 1e-3, 180 / np.pi, -1.0])))
    elif kind == "huge":
        make_huge(data, path)
    elif kind == "pickle":
        program = pickle.dumps(MakesFolder(sign), data.draw(st.sampled_from([0, 2, 4])))
        if is_array and data.draw(st.booleans()):
            save_object(path, MakesFolder(sign))
        else:
            path.write_bytes(program)
    elif kind == "text" and is_text:
        damage_word(data, path)
    else:
        kind = "made up"
        path.write_bytes(data.draw(st.binary(max_size=50)))
    return kind


def damage_word(data: st.DataObject, path: Path) -> None:
    """Put another word, or another of its own, in the place of one of a text: punctuation and quotes stay."""
    text = path.read_text()
    words = list(WORD.finditer(text))
    if words:
        word = data.draw(st.sampled_from(words))
        other = data.draw(st.sampled_from(OTHER_WORDS) | st.sampled_from(words).map(lambda each: each[0]))
        path.write_text(text[: word.start()] + other + text[word.end() :])


def damage_member(data: st.DataObject, path: Path) -> None:
    """Change bytes of a file in an archive whose checksums are right: they reach whoever reads what is in it."""
    with zipfile.ZipFile(path) as archive:
        members = {name: archive.read(name) for name in archive.namelist()}
    name = data.draw(st.sampled_from(sorted(members)))
    changed = bytearray(members[name])
    for _ in range(data.draw(st.integers(1, 4))):
        at = data.draw(st.integers(0, max(len(changed) - 1, 0)))
        changed[at : at + data.draw(st.integers(0, 8))] = data.draw(st.binary(max_size=8))
    with zipfile.ZipFile(path, "w") as archive:
        for each, content in (members | {name: bytes(changed)}).items():
            archive.writestr(each, content)


def damage_value(data: st.DataObject, path: Path) -> None:
    """Put something else at a place of a document, be it JSON, YAML, a pickle or what PyTorch saves."""
    load, save, other = DOCUMENTS[path.suffix]
    document = load(path)
    save(path, replaced(data, document, {**VALUES, **other}))


def replaced(data: st.DataObject, value: Any, others: dict[str, Any]) -> Any:
    """A copy of a document with something else at one place of it, or of the JSON in one of its texts.

    Args:
        data: Draws the place and what comes there.
        value: The document.
        others: What may come there, by a name to draw it by: some of it is too much to be shown.
    """
    if isinstance(value, str) and value[:1] == "{":
        return json.dumps(replaced(data, json.loads(value), VALUES))
    if isinstance(value, dict | list | tuple) and len(value) and data.draw(st.integers(0, 5)):
        copy: Any = dict(value) if isinstance(value, dict) else list(value)
        keys = sorted(copy, key=str) if isinstance(copy, dict) else range(len(copy))
        key = data.draw(st.sampled_from(keys))
        copy[key] = replaced(data, copy[key], others)
        return tuple(copy) if isinstance(value, tuple) else copy
    return others[data.draw(st.sampled_from(sorted(others)))]


def lists_of_the_same(depth: int, width: int) -> list[Any]:
    """A list of a list of a list, and so on, each of which occurs more than once: short to write, endless to read."""
    value: list[Any] = [0.5]
    for _ in range(depth):
        value = [value] * width
    return value


def lists_of_itself() -> list[Any]:
    """A list that holds itself."""
    value: list[Any] = []
    value.append(value)
    return value


def _save_plain(path: Path, value: Any) -> None:
    path.write_bytes(pickle.dumps(value))


def _load_yaml(path: Path) -> Any:
    return yaml.safe_load(path.read_text())


def _save_yaml(path: Path, value: Any) -> None:
    path.write_text(yaml.safe_dump(value))


def _load_torch(path: Path) -> Any:
    return torch.load(path, weights_only=True)


VALUES: dict[str, Any] = {
    **{repr(value): value for value in (None, True, -1, 0, 10**400, 1e308, 2.5, "", "../../x", "\n", "\x1b[2J")},
    **{"nan": float("nan"), "inf": float("inf"), "long": "x" * 10**5},
    **{"list": [], "table": {}, "lists": [[]], "table of lists": {"a": [{}]}},
}
"""What may come in the place of something in a document, by name."""
SHARED: dict[str, Any] = {
    "pairs": lists_of_the_same(60, 2),
    "nines": lists_of_the_same(20, 9),
    "itself": lists_of_itself(),
    "digits": 10**5000,
    "bytes": b"\xff",
}
"""What pickles can hold beyond that."""
TENSORS: dict[str, Any] = {
    "tensor": torch.ones(3, 3),
    "nan tensor": torch.full((2,), torch.nan),
    "whole tensor": torch.ones(2, dtype=torch.int8),
    "complex tensor": torch.ones(2, dtype=torch.complex64),
    "sparse tensor": torch.eye(3).to_sparse(),
    "huge tensor": torch.zeros(1).expand(2**40),
    "empty tensor": torch.zeros(0),
}
DOCUMENTS: dict[str, tuple[Callable[[Path], Any], Callable[[Path, Any], object], dict[str, Any]]] = {
    ".json": (lambda path: json.loads(path.read_text()), lambda path, value: path.write_text(json.dumps(value)), {}),
    ".yaml": (_load_yaml, _save_yaml, {}),
    ".pkl": (lambda path: read_pickle(path, CLASSES), _save_plain, SHARED),
    ".pt": (_load_torch, lambda path, value: torch.save(value, path), SHARED | TENSORS),
}
"""How documents are loaded and saved, and what may come into them besides `VALUES`."""


def damage_unit(path: Path, factor: float) -> None:
    """Multiply the numbers of a file."""
    if path.suffix in (".npy", ".npz"):
        loaded: Any = np.load(path, allow_pickle=True)
        if path.suffix == ".npz":
            changed = {name: a * factor if a.dtype.kind == "f" else a for name, a in loaded.items()}
            np.savez(path, **changed)
        elif loaded.dtype.kind == "f":
            np.save(path, loaded * factor)
        elif isinstance(table := loaded.item() if loaded.ndim == 0 else None, dict):
            scaled = {side: {name: factor * values for name, values in of.items()} for side, of in table.items()}
            np.save(path, np.array(scaled, object), allow_pickle=True)
        return
    lines = [
        " ".join(str(float(word) * factor) if "." in word else word for word in line.split(" "))
        for line in path.read_text().splitlines()
        if not line.startswith("#")
    ]
    path.write_text("\n".join(lines))


def make_huge(data: st.DataObject, path: Path) -> None:
    """Let a file claim or be far more than it should."""
    if path.suffix in (".npy", ".npz"):
        shape = data.draw(st.sampled_from([(2**40,), (2**62, 2**62), (10**6, 10**6, 0), (-1,), (3,) * 40]))
        claim = {
            "descr": data.draw(st.sampled_from(["<f8", "|O", "<U1000000"])),
            "fortran_order": False,
            "shape": shape,
        }
        file = io.BytesIO()
        np.lib.format.write_array_header_1_0(file, claim)
        if path.suffix == ".npy":
            path.write_bytes(file.getvalue() + bytes(100))
        else:
            with zipfile.ZipFile(path, "a") as archive, warnings.catch_warnings():
                warnings.simplefilter("ignore")
                archive.writestr(data.draw(st.sampled_from(archive.namelist())), file.getvalue() + bytes(100))
    else:
        path.write_text(data.draw(st.sampled_from(TRAPS.get(path.suffix, ("x" * 10**6,)))))


def save_object(path: Path, value: object) -> None:
    """Write an array of one Python object, which is a pickle."""
    array = np.empty((), object)
    array[()] = value
    if path.suffix == ".npz":
        np.savez(path, split=array)
    else:
        np.save(path, array, allow_pickle=True)


def damage_array(data: st.DataObject, path: Path) -> None:
    """Replace a number by one that cannot be, or an array by one of another shape or type."""
    loaded: Any = np.load(path, allow_pickle=True)
    arrays = dict(loaded) if path.suffix == ".npz" else {"only": loaded}
    name = data.draw(st.sampled_from(sorted(arrays)))
    array = arrays[name]
    if array.dtype == object:
        target = array.item() if array.ndim == 0 else array[data.draw(st.integers(0, len(array) - 1))]
        if "left" in target:
            target = target[data.draw(st.sampled_from(["left", "right"]))]
        key = data.draw(st.sampled_from(sorted(target)))
        others = {**VALUES, **SHARED, "s1": "s1", "much": 10**9, "matrix": np.zeros((3, 3))}
        target[key] = others[data.draw(st.sampled_from(sorted(others)))]
    elif array.dtype.kind == "U" and array.size and str(array.flat[0])[:1] == "{" and data.draw(st.booleans()):
        arrays[name] = np.array([replaced(data, str(each), VALUES) for each in array.flat]).reshape(array.shape)
    else:
        extremes: list[Any] = [np.nan, np.inf, 1e300, -1, 0, 10**9] if array.dtype.kind in "fiu" else ["", "../x", "s5"]
        choice = data.draw(st.sampled_from(["value", "flat", "empty", "complex", "object"]))
        if choice == "value" and array.size:
            array = array.astype(float) if array.dtype.kind in "fiu" else array.astype("U10")
            array.flat[data.draw(st.integers(0, array.size - 1))] = data.draw(st.sampled_from(extremes))
        shapes = {"flat": array.ravel(), "empty": array.ravel()[:0], "value": array}
        arrays[name] = (
            shapes[choice] if choice in shapes else array.astype(choice if array.dtype.kind != "U" else "S10")
        )
    if path.suffix == ".npz":
        np.savez(path, **arrays)
    else:
        np.save(path, arrays["only"], allow_pickle=True)
