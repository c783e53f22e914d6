"""Arrays: what they are checked for, and files of named ones (`.npz`), written whole, read strictly, never pickles."""

import os
import sys
import warnings
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from artigrasp.errors import UserError
from artigrasp.files import atomic_write, check_format

Array = NDArray[np.float64]
"""What the project calculates with on the host; arrays of another type name it: ``NDArray[np.float32]``."""

QUATERNION_TOLERANCE = 1e-3
"""Largest difference from 1 of the norm of a quaternion that counts as a rotation."""

MAX_BYTES = 2**31
"""Archives that unpack to more than this are refused."""

_ACCEPTED_KINDS = {"f": "fiu", "i": "iu", "b": "b", "U": "U"}
_KIND_NAMES = {"f": "numbers", "i": "whole numbers", "b": "booleans", "U": "strings"}


def save_arrays(path: str | os.PathLike[str], format: str, version: int, arrays: Mapping[str, ArrayLike]) -> None:
    """Write named arrays and what kind of file they make.

    Args:
        path: The file to write or replace.
        format: Kind of the file, as in ``"artigrasp.motion"``.
        version: Version of that format.
        arrays: The arrays; none may be called ``format`` or ``version``.

    Raises:
        UserError: The place cannot be written to.
    """
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savez_compressed(file, format=np.asarray(format), version=np.asarray(version), **arrays)  # type: ignore[arg-type]


def load_arrays(path: str | os.PathLike[str], format: str, version: int) -> dict[str, NDArray[Any]]:
    """Read every array of a file of a known kind.

    Args:
        path: The file.
        format: Kind that the file must be of.
        version: Newest version that the caller reads.

    Returns:
        The arrays by name, without ``format`` and ``version``; none of them holds Python objects.

    Raises:
        UserError: There is no such file, it is no archive of plain arrays, or of another format or a newer version.
    """
    arrays = load_plain_arrays(path)
    check_format(arrays.pop("format", None), arrays.pop("version", None), format, version, path)
    return arrays


def load_plain_arrays(path: str | os.PathLike[str]) -> dict[str, NDArray[Any]]:
    """Read every array of an archive of any kind, none of which may hold Python objects.

    Raises:
        UserError: There is no such file, it is no archive of plain arrays, or it unpacks to more than ``MAX_BYTES``.
    """
    try:
        with zipfile.ZipFile(path) as packed:
            size = sum(member.file_size for member in packed.infolist())
        if size > MAX_BYTES:
            raise ValueError(f"expected at most {MAX_BYTES} bytes, found {size}")
        with np.load(path, allow_pickle=False) as archive, warnings.catch_warnings():
            # that a header might come from Python 2: it is read all the same
            warnings.simplefilter("ignore", UserWarning)
            return {str(name): np.asarray(archive[name]) for name in archive.files}
    except FileNotFoundError:
        raise UserError(f"{path}: no such file") from None
    except Exception as error:  # A damaged archive can fail in any way of zipfile, zlib, NumPy or the file system.
        detail = (str(error) or type(error).__name__).splitlines()[0]
        raise UserError(
            f"{path}: expected an .npz archive of plain arrays, found one that fails with: {detail}"
        ) from error


def check_array(
    name: str, value: ArrayLike, shape: tuple[int | str, ...], dtype: DTypeLike, sizes: dict[str, int] | None = None
) -> NDArray[Any]:
    """Turn a value into a contiguous array of a type, if it has the expected shape and only finite numbers.

    Args:
        name: Field that the value belongs to, for the message.
        value: The array.
        shape: Expected size of each axis. An axis given by a name, such as ``"T"``, has the size that ``sizes`` holds;
            a name that is not there yet is free and added to it.
        dtype: Type of the result. Whole numbers count as floats; nothing else is converted between kinds.
        sizes: Sizes of the named axes.

    Raises:
        ValueError: The shape, the kind or a number is not as expected. The message starts with the name.
    """
    array = np.asarray(value)
    kind = np.dtype(dtype).kind
    if array.dtype.kind not in _ACCEPTED_KINDS[kind]:
        raise ValueError(f"{name}: expected {_KIND_NAMES[kind]}, found an array of {array.dtype}")
    sizes = {} if sizes is None else sizes
    if array.ndim == len(shape):
        for axis, found in zip(shape, array.shape, strict=True):
            if isinstance(axis, str):
                sizes.setdefault(axis, found)
    expected = tuple(sizes.get(axis) if isinstance(axis, str) else axis for axis in shape)
    if array.shape != expected:
        axes = [f"{axis}={sizes[axis]}" if axis in sizes else str(axis) for axis in shape]
        raise ValueError(f"{name}: expected shape ({', '.join(axes)}), found {array.shape}")
    if kind == "U":
        return _check_strings(name, array)
    with np.errstate(over="ignore"):
        array = np.asarray(array, dtype=dtype, order="C")
    if kind == "f" and not np.isfinite(array).all():
        index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
        raise ValueError(f"{name}{list(index) if index else ''}: expected a finite number, found {array[index]}")
    return array


def check_poses(
    name: str, value: ArrayLike, shape: tuple[int | str, ...], sizes: dict[str, int] | None = None
) -> NDArray[np.float32]:
    """Turn poses (position, quaternion xyzw) into a contiguous array, if they are finite with unit quaternions.

    Args:
        name: Field that the value belongs to, for the message.
        value: The poses, shape ``[*shape, 7]``.
        shape: As for :func:`check_array`, without the last axis.
        sizes: As for :func:`check_array`.

    Raises:
        ValueError: As for :func:`check_array`, or a quaternion is not a unit quaternion.
    """
    poses = check_array(name, value, (*shape, 7), np.float32, sizes)
    error = np.abs(np.linalg.norm(poses[..., 3:].astype(np.float64), axis=-1) - 1)
    if (error > QUATERNION_TOLERANCE).any():
        index = tuple(int(i) for i in np.argwhere(error > QUATERNION_TOLERANCE)[0])
        found = np.array2string(poses[index][3:], precision=4, separator=", ")
        raise ValueError(f"{name}{list(index) if index else ''}: expected a unit quaternion, found {found}")
    return poses


def _check_strings(name: str, array: NDArray[np.str_]) -> NDArray[np.str_]:
    # by their codes: NumPy makes strings of what is no character, or fails in several ways
    codes = np.frombuffer(array.astype(array.dtype.newbyteorder("=")).tobytes(), np.uint32)
    if (codes > sys.maxunicode).any():
        raise ValueError(f"{name}: expected strings, found characters that are none: {codes.max():#x}")
    return array
