"""Pickled data of others, read without running anything in it.

A pickle is a program. This reader knows arrays, dictionaries, lists, tuples, text, bytes, numbers, booleans and None,
and turns objects of the classes that the caller names into dictionaries of what they hold. Any other name in a file
ends the reading. Nothing of NumPy, of those classes or of any other library is called while the program runs: what it
builds are stand-ins of this module, which become arrays and dictionaries once it is over.
"""

import io
import itertools
import math
import pickle
import pickletools
import re
from collections.abc import Callable, Collection, Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from artigrasp.errors import UserError

MAX_BYTES = 2**30
"""Files larger than this are refused."""

_INTEGER_BITS = 64
"""Of a whole number; Python refuses to make text, such as that of an error, of one of a few thousand digits."""

_OBJECT_BYTES = 64
"""What a Python object takes at least, about."""

ENCODING = "latin1"
"""How text of Python 2 is read: the only way in which its arrays can be."""

_DTYPE = re.compile(r"[<>|=]?([biuf][1248]|[SU][0-9]{1,4}|O8?)")


def read_pickle(path: Path, classes: Collection[str] = ()) -> Any:
    """Read a pickle.

    Args:
        path: The file.
        classes: Classes, as in ``"module.Name"``, whose objects may occur; each becomes a dictionary of its attributes
            and items. A name that ends in ``.*`` stands for every class of a module and its submodules.

    Raises:
        UserError: there is no such file, or it holds anything else, or nothing whole.
    """
    return _load(path, _read(path), classes)


def read_npy(path: Path, classes: Collection[str] = ()) -> Any:
    """Read an ``.npy`` file: an array of numbers or text, or the Python object or list of objects that it holds.

    Args:
        path: The file.
        classes: As for :func:`read_pickle`.

    Raises:
        UserError: as for :func:`read_pickle`.
    """
    file = io.BytesIO(_read(path))
    try:
        version = np.lib.format.read_magic(file)
        first = version == (1, 0)
        read_header = np.lib.format.read_array_header_1_0 if first else np.lib.format.read_array_header_2_0
        shape, fortran_order, dtype = read_header(file)
        if not dtype.hasobject:
            return _array(shape, dtype.str, fortran_order, file.read())
    except Exception as error:  # A damaged header can fail anywhere in NumPy's reader.
        raise _refusal(path, error) from None
    array = _load(path, file.read(), classes)
    if not isinstance(array, np.ndarray) or array.ndim > 1:
        raise UserError(f"{path}: expected one object or a list of them, found something else")
    return array.tolist()


def _read(path: Path) -> bytes:
    try:
        if path.stat().st_size > MAX_BYTES:
            raise UserError(f"{path}: expected at most {MAX_BYTES} bytes, found {path.stat().st_size}")
        return path.read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot read this file: {error.strerror}") from None


def _load(path: Path, program: bytes, classes: Collection[str]) -> Any:
    try:
        _check_sizes(program)
        value = _plain(_Unpickler(io.BytesIO(program), classes).load(), {})
        check_bounded(value)
        return value
    except Exception as error:  # A damaged program can fail in any way.
        raise _refusal(path, error) from None


def _check_sizes(program: bytes) -> None:
    """Refuse a program that asks for more memory than it has use for."""
    for count, (opcode, argument, _) in enumerate(pickletools.genops(program)):
        limit = {"PUT": count, "BINPUT": count, "LONG_BINPUT": count, "FRAME": len(program)}.get(opcode.name)
        if limit is not None and int(argument or 0) > limit:
            raise pickle.UnpicklingError(f"expected at most {limit} in {opcode.name}, found {argument}")


def _refusal(path: Path, error: Exception) -> UserError:
    return UserError(f"{path}: cannot read this as plain data: {(str(error) or repr(error)).splitlines()[0]}")


class _Sealed(type):
    """Makes classes that a program can instantiate, but not change."""

    def __setattr__(cls, name: str, value: object) -> None:
        raise pickle.UnpicklingError(f"expected data, found a change of {cls.__name__}")


class _Record(dict[Any, Any], metaclass=_Sealed):
    """An object of a class that the caller named: what it holds, and no more."""

    __slots__ = ()

    def __init__(self, *_: object) -> None:
        super().__init__()

    def __setstate__(self, state: object) -> None:
        if isinstance(state, dict):
            self.update(state)


class _Dtype(metaclass=_Sealed):
    """A type of numbers or text; its byte order comes apart from its name."""

    __slots__ = ("byte_order", "name")

    def __init__(self, name: str, *_: object) -> None:
        self.name, self.byte_order = name, "="

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        _, byte_order, *more = state
        if any(detail is not None for detail in more[:3]):
            raise pickle.UnpicklingError("expected numbers or text, found a structured type")
        self.byte_order = byte_order

    def __str__(self) -> str:
        return self.name if self.byte_order == "|" else f"{self.byte_order}{self.name.lstrip('<>|=')}"


class _Array(metaclass=_Sealed):
    """An array, given by shape, type and bytes, or by a list of objects."""

    __slots__ = ("state",)

    def __init__(self, *_: object) -> None:
        self.state: tuple[Any, ...] = ()

    def __setstate__(self, state: tuple[Any, ...]) -> None:
        self.state = state[-4:]


class _Name(metaclass=_Sealed):
    """A name that may stand in a program, in place of what it names: calling it only keeps its arguments."""

    __slots__ = ("_call",)

    def __init__(self, call: Callable[..., Any]) -> None:
        self._call = call

    def __call__(self, *arguments: Any) -> Any:
        return self._call(*arguments)

    def __setattr__(self, name: str, value: object) -> None:
        if hasattr(self, "_call"):
            raise pickle.UnpicklingError("expected data, found a change of a name")
        object.__setattr__(self, name, value)


def _array_of_buffer(data: object, dtype: object, shape: object, order: object) -> _Array:
    array = _Array()
    array.state = (shape, dtype, order == "F", data)
    return array


def _scalar(dtype: object, data: object) -> _Array:
    return _array_of_buffer(data, dtype, (), "C")


def _record(cls: object, _: object, state: object) -> _Record:
    if cls is not _Record:
        raise pickle.UnpicklingError("expected an object of a known class")
    record = _Record()
    record.__setstate__(state)
    return record


def _bytes(text: str, encoding: str) -> bytes:
    if encoding != "latin1":
        raise pickle.UnpicklingError(f"expected the encoding latin1, found {encoding!r}")
    return text.encode("latin1")


_ARRAY_MAKERS: dict[str, Callable[..., Any]] = {
    "multiarray._reconstruct": _Array,
    "multiarray.scalar": _scalar,
    "numeric._frombuffer": _array_of_buffer,
}
_NAMES: dict[str, Any] = {
    "numpy.ndarray": _Array,
    "numpy.dtype": _Dtype,
    "_codecs.encode": _Name(_bytes),
    **{f"{builtins}.{name}": _Name(dict) for builtins in ("builtins", "__builtin__") for name in ("dict", "object")},
    **{f"{copyreg}._reconstructor": _Name(_record) for copyreg in ("copyreg", "copy_reg")},
    **{f"numpy.core.{name}": _Name(make) for name, make in _ARRAY_MAKERS.items()},
    **{f"numpy._core.{name}": _Name(make) for name, make in _ARRAY_MAKERS.items()},
}


class _Unpickler(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, classes: Collection[str]) -> None:
        super().__init__(file, encoding=ENCODING)
        self._classes = classes

    def find_class(self, module: str, name: str) -> Any:
        full_name = f"{module}.{name}"
        if full_name in _NAMES:
            return _NAMES[full_name]
        for known in self._classes:
            if full_name == known or (known.endswith(".*") and full_name.startswith(known[:-1])):
                return _Record
        raise pickle.UnpicklingError(f"expected arrays, dictionaries, lists, text and numbers, found {full_name!r}")

    def persistent_load(self, pid: object) -> Any:
        raise pickle.UnpicklingError("expected data, found a reference to another file")


def _plain(value: Any, done: dict[int, Any]) -> Any:
    """Replace stand-ins by what they stand for.

    Args:
        value: What a program built.
        done: Results by the identity of what they were made of: what occurs often is made once.
    """
    if value is None or isinstance(value, str | bytes | bytearray | bool | int | float):
        return value
    if id(value) in done:
        return done[id(value)]
    plain: Any
    if isinstance(value, dict):
        done[id(value)] = plain = {}
        plain.update((_plain(key, done), _plain(item, done)) for key, item in value.items())
    elif isinstance(value, list):
        done[id(value)] = plain = []
        plain.extend(_plain(item, done) for item in value)
    elif isinstance(value, tuple):
        done[id(value)] = plain = tuple(_plain(item, done) for item in value)
    elif isinstance(value, _Array) and value.state:
        shape, dtype, fortran_order, data = value.state
        if isinstance(data, list):
            data = [_plain(item, done) for item in data]
        done[id(value)] = plain = _array(shape, str(dtype), fortran_order, data)
    else:
        raise ValueError(f"expected arrays, dictionaries, lists, text and numbers, found {type(value).__name__}")
    return plain


def check_bounded(value: Any, limit: float = MAX_BYTES) -> None:
    """Refuse data that is short to write, and endless where somebody makes arrays or text of it.

    Args:
        value: Dictionaries, lists, tuples, arrays or tensors, text and numbers.
        limit: What it may take if everything in it was there as often as it occurs [bytes].

    Raises:
        ValueError: A number has too many digits, a list holds itself, or the same lists over and over.
    """
    if _unshared_size(value, {}) > limit:
        raise ValueError("expected no list that holds itself, or the same lists over and over")


def _unshared_size(value: Any, sizes: dict[int, float]) -> float:
    """What data would take if nothing in it was shared [bytes], infinity if it holds itself.

    Args:
        value: The data.
        sizes: Of containers by identity.
    """
    if isinstance(value, int) and value.bit_length() > _INTEGER_BITS:
        raise ValueError(f"expected whole numbers of at most {_INTEGER_BITS} bits, found one of {value.bit_length()}")
    if isinstance(value, str | bytes | bytearray):
        return _OBJECT_BYTES + len(value)
    is_objects = isinstance(value, np.ndarray) and value.dtype == object
    if not is_objects and not isinstance(value, dict | list | tuple):
        return _OBJECT_BYTES + int(getattr(value, "nbytes", 0))
    if id(value) not in sizes:
        sizes[id(value)] = math.inf
        if isinstance(value, dict):
            items: Iterable[Any] = itertools.chain(value, value.values())
        else:
            items = value.flat if isinstance(value, np.ndarray) else value
        sizes[id(value)] = _OBJECT_BYTES + sum(_unshared_size(item, sizes) for item in items)
    return sizes[id(value)]


def _array(shape: Any, dtype: str, fortran_order: Any, data: Any) -> NDArray[Any]:
    """The array of a shape and type that these bytes, or this list of objects, make exactly."""
    if not _DTYPE.fullmatch(dtype):
        raise ValueError(f"expected an array of numbers, text or objects, found one of {dtype!r}")
    if not isinstance(shape, tuple) or not all(type(size) is int and size >= 0 for size in shape):
        raise ValueError(f"expected the shape of an array, found {shape!r}")
    count = math.prod(shape)
    if "O" in dtype:
        if not isinstance(data, list) or len(data) != count:
            raise ValueError(f"expected a list of {count} objects")
        objects = np.empty(count, object)
        objects[:] = data
        return objects.reshape(shape)
    # Text of Python 2 is both bytes and text.
    content = data.encode("latin1") if isinstance(data, str) else bytes(data)
    if len(content) != count * np.dtype(dtype).itemsize:
        raise ValueError(f"expected {count} × {np.dtype(dtype).itemsize} bytes of an array, found {len(content)}")
    flat = np.frombuffer(content, dtype)
    return flat.reshape(shape, order="F" if fortran_order else "C").copy()
