"""Reading pickles of others: data comes back, nothing runs, and nothing but a UserError comes out."""

import collections
import io
import os
import pickle
import struct
import tracemalloc
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from artigrasp.errors import UserError
from artigrasp.restricted_pickle import read_npy, read_pickle
from tests.fuzzing import examples

DATA = {
    "numbers": np.arange(6.0).reshape(2, 3),
    "columns": np.asfortranarray(np.arange(6).reshape(2, 3)),
    "single": np.float32(3),
    "words": np.array(["ab", "c"]),
    "flags": np.array([True, False]),
    "objects": np.array([{"k": [1, 2.5]}, None], object),
    "rest": [1, -(2**63), 2.5, True, None, "text", b"bytes", (1, ("x",))],
}


class Labels:
    """Stands for a class that only the author of a file has."""

    def __init__(self, frames: list[int]) -> None:
        self.frames = frames


class Mapping(dict[str, Any]):
    """Stands for somebody's own dictionary."""


class Runs:
    """Makes a folder when it is unpickled."""

    def __init__(self, path: Path, call: Any = os.mkdir) -> None:
        self.path, self.call = path, call

    def __reduce__(self) -> tuple[Any, tuple[str]]:
        return self.call, (str(self.path),)


def write(path: Path, value: Any, protocol: int | None = None) -> Path:
    """Pickle a value."""
    path.write_bytes(pickle.dumps(value, protocol))
    return path


def assert_same(found: Any, expected: Any) -> None:
    """Two values agree, arrays with their types."""
    if isinstance(expected, np.ndarray | np.generic):
        assert found.dtype == expected.dtype and found.shape == expected.shape
        assert found.tolist() == expected.tolist()
    elif isinstance(expected, dict):
        assert type(found) is dict and list(found) == list(expected)
        for key in expected:
            assert_same(found[key], expected[key])
    else:
        assert type(found) is type(expected) and found == expected


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_data_comes_back(protocol: int, tmp_path: Path) -> None:
    """Arrays of numbers, text and objects, containers and scalars survive in every protocol."""
    assert_same(read_pickle(write(tmp_path / "data", DATA, protocol)), DATA)


@pytest.mark.parametrize("protocol", [0, 2, 4])
def test_known_classes_become_dictionaries(protocol: int, tmp_path: Path) -> None:
    """Objects of the named classes give their attributes or items, in NumPy's own files too."""
    module = Labels.__module__
    value = [Labels([1, 2]), Mapping(a=np.ones(2))]
    names = (f"{module}.Labels", f"{module}.Mapping")
    labels, mapping = read_pickle(write(tmp_path / "data", value, protocol), names)
    assert labels == {"frames": [1, 2]} and mapping["a"].tolist() == [1, 1]
    assert type(labels) is type(mapping) is dict
    np.save(tmp_path / "data.npy", np.array(value, object), allow_pickle=True)
    assert read_npy(tmp_path / "data.npy", names)[0] == {"frames": [1, 2]}
    assert read_npy(tmp_path / "data.npy", (f"{module}.*",))[0] == {"frames": [1, 2]}
    with pytest.raises(UserError, match="expected arrays, dictionaries, lists, text and numbers, found 'tests"):
        read_pickle(tmp_path / "data")


def test_npy_files(tmp_path: Path) -> None:
    """Plain arrays, one object and a list of objects are read; an array of arrays is not what is expected."""
    np.save(tmp_path / "plain.npy", np.arange(6.0).reshape(2, 3))
    assert_same(read_npy(tmp_path / "plain.npy"), np.arange(6.0).reshape(2, 3))
    np.save(tmp_path / "one.npy", np.array({"a": 1}, object), allow_pickle=True)
    assert read_npy(tmp_path / "one.npy") == {"a": 1}
    np.save(tmp_path / "table.npy", np.array([[None, 1]], object), allow_pickle=True)
    with pytest.raises(UserError, match="expected one object or a list of them"):
        read_npy(tmp_path / "table.npy")


def malicious_programs(trace: Path) -> dict[str, bytes]:
    """Pickles that run, or change what reads them, in many ways."""
    word = b"X" + struct.pack("<I", len(str(trace))) + str(trace).encode()
    change = b"cnumpy\nndarray\n(}X\x0c\x00\x00\x00__setstate__cnumpy\ndtype\nstb."
    return {
        "reduce": pickle.dumps(Runs(trace)),
        "reduce among data": pickle.dumps([DATA, Runs(trace)]),
        "array of objects": pickle.dumps(np.array([Runs(trace)], object)),
        "eval": pickle.dumps(Runs(trace, eval)),
        "instance": b"(" + word + b"ios\nmkdir\n.",
        "dotted name": b"\x80\x04\x8c\x05numpy\x8c\x13ndarray.__init_subclass\x93.",
        "library": b"cnumpy\nload\n(" + word + b"tR.",
        "getattr": b"cbuiltins\ngetattr\n(cnumpy\nndarray\nX\x04\x00\x00\x00dumptR.",
        "persistent": b"Pos.mkdir\n.",
        "extension": b"\x82\x01.",
        "change of a class": change,
        "change of a name": b"cnumpy.core.multiarray\n_reconstruct\n(N}X\x05\x00\x00\x00_callI1\nstb.",
        "structure": pickle.dumps(np.zeros(2, [("a", "f8"), ("b", object)])),
        "dates": pickle.dumps(np.zeros(2, "datetime64[s]")),
        "a set": pickle.dumps({1, 2}),
        "a counter": pickle.dumps(collections.Counter("ab")),
    }


@pytest.mark.parametrize("name", malicious_programs(Path()))
def test_nothing_runs(name: str, tmp_path: Path) -> None:
    """Programs that call, import or change anything end in one line that names the file, bare and in NumPy's files."""
    trace = tmp_path / "trace"
    program = malicious_programs(trace)[name]
    (tmp_path / "data.pkl").write_bytes(program)
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(header, {"descr": "|O", "fortran_order": False, "shape": ()})
    (tmp_path / "data.npy").write_bytes(header.getvalue() + program)
    for read, path in ((read_pickle, tmp_path / "data.pkl"), (read_npy, tmp_path / "data.npy")):
        with pytest.raises(UserError, match=r"^[^\n]*cannot read this as plain data[^\n]*$") as caught:
            read(path)
        assert str(path) in str(caught.value)
    assert not trace.exists()
    assert_same(read_pickle(write(tmp_path / "good", DATA)), DATA)


@pytest.mark.parametrize("width", [2, 9])
def test_lists_of_the_same_lists_are_refused(width: int, tmp_path: Path) -> None:
    """A kilobyte that becomes all memory where an array or a message is made of it, and a list that holds itself."""
    lists: list[Any] = [0.5]
    for _ in range(60):
        lists = [lists] * width
    itself: list[Any] = []
    itself.append(itself)
    objects = np.empty(1, object)
    objects[0] = lists
    for value in (lists, {"k": lists}, (lists,), objects, itself):
        with pytest.raises(UserError, match="expected no list that holds itself, or the same lists over and over"):
            read_pickle(write(tmp_path / "data", value))
    shared = [1.0, "a"]
    assert read_pickle(write(tmp_path / "data", [shared] * 1000)) == [shared] * 1000


def test_huge_numbers_are_refused(tmp_path: Path) -> None:
    """No text can be made of them, nor any array."""
    with pytest.raises(UserError, match="expected whole numbers of at most 64 bits, found one of 16610"):
        read_pickle(write(tmp_path / "data", {"frame": 10**5000}))


def test_forged_arrays_are_refused(tmp_path: Path) -> None:
    """An array has exactly as many bytes as its shape and type ask for: neither too few nor a shape without end."""

    def forged(shape: Any, dtype: str, content: Any) -> Path:
        class Forged:
            def __reduce__(self) -> tuple[Any, ...]:
                return np._core.multiarray._reconstruct, (np.ndarray, (0,), b"b"), (1, shape, dtype, False, content)

        # The dtype goes as text, which the reader takes for a type of that name.
        return write(tmp_path / "data", Forged())

    assert read_pickle(forged((2,), "f8", bytes(16))).tolist() == [0, 0]
    for shape, dtype, content in (
        ((3,), "f8", bytes(16)),
        ((2**62, 2**62), "f8", b""),
        ((-1,), "f8", b""),
        ((2.0,), "f8", bytes(16)),
        ((1,), "O", bytes(8)),
        ((1,), "V8", bytes(8)),
        ((1,), "f8,O", bytes(16)),
        ((2**40,), "U0", b""),
        ((2,), "O", [1]),
    ):
        with pytest.raises(UserError):
            read_pickle(forged(shape, dtype, content))


def test_bombs_end(tmp_path: Path) -> None:
    """Lists within lists and giant lengths end at once."""
    program = b"]" * 100_000 + b"a" * 99_999 + b"."
    (tmp_path / "deep").write_bytes(program)
    with pytest.raises(UserError):
        read_pickle(tmp_path / "deep")
    giants = (
        b"\x8e" + struct.pack("<Q", 2**60),
        b"Nr\xff\xff\xff\x3f",
        b"Np999999999\n",
        b"\x95" + struct.pack("<Q", 2**33),
    )
    tracemalloc.start()
    for program in giants:
        (tmp_path / "giant").write_bytes(program + b".")
        with pytest.raises(UserError):
            read_pickle(tmp_path / "giant")
    assert tracemalloc.get_traced_memory()[1] < 2**20
    tracemalloc.stop()


def test_file_is_missing_or_no_file(tmp_path: Path) -> None:
    """What is not there, and a folder, are named."""
    for path in (tmp_path / "none", tmp_path):
        for read in (read_pickle, read_npy):
            with pytest.raises(UserError, match="cannot read this file") as caught:
                read(path)
            assert str(path) in str(caught.value)


@examples(300)
@given(data=st.data())
def test_damaged_files_end_in_one_line(data: st.DataObject, tmp_path_factory: pytest.TempPathFactory) -> None:
    """Whatever bytes are cut off, changed or made up: either data comes back or a UserError of one line."""
    path = tmp_path_factory.getbasetemp() / "damaged"
    good = pickle.dumps(DATA, data.draw(st.sampled_from([0, 2, 4])))
    kind = data.draw(st.sampled_from(["cut", "changed", "made up"]))
    if kind == "cut":
        program = good[: data.draw(st.integers(0, len(good) - 1))]
    elif kind == "changed":
        at = data.draw(st.integers(0, len(good) - 1))
        program = good[:at] + data.draw(st.binary(min_size=1, max_size=4)) + good[at + 1 :]
    else:
        program = data.draw(st.binary(max_size=60))
    for content, read in ((program, read_pickle), (program, read_npy), (b"\x93NUMPY" + program, read_npy)):
        path.write_bytes(content)
        try:
            read(path)
        except UserError as error:
            assert "\n" not in str(error) and str(path) in str(error)
