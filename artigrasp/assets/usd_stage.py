"""The few USD operations that hand and object files share: stages, poses and masses, with errors a user can read."""

import contextlib
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from pxr import Ar, Gf, Sdf, Tf, Usd, UsdGeom, UsdPhysics, UsdUtils
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.errors import UserError
from artigrasp.files import check_format, check_inside, write_text

_TEXT = b"#usda"
_COMMENTARY = re.compile(r" in file \S+ : '(.+?)'\s*(?:Error in |$)", re.DOTALL)
"""What USD says of a file, between where in USD's own code that was and the next error."""


def new_stage(root: str, format: str, version: int) -> Usd.Stage:
    """A stage in metres, kilograms and Z up whose default prim is ``/<root>``."""
    stage = Usd.Stage.CreateInMemory()
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.z)
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.GetRootLayer().customLayerData = {"format": format, "version": version}
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, f"/{root}").GetPrim())
    return stage


def save_stage(stage: Usd.Stage, path: Path) -> None:
    """Write the stage's root layer as text, whole or not at all."""
    write_text(path, stage.GetRootLayer().ExportToString())


def set_pose(prim: Usd.Prim, position: ArrayLike, orientation: ArrayLike = (0.0, 0.0, 0.0, 1.0)) -> None:
    """Place a prim in its parent: position [m], orientation xyzw."""
    xform = UsdGeom.Xformable(prim)
    xform.AddTranslateOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Vec3d(*vector(position)))
    xform.AddOrientOp(UsdGeom.XformOp.PrecisionDouble).Set(Gf.Quatd(*_wxyz(orientation)))


def set_mass(prim: Usd.Prim, mass: float, com: ArrayLike, inertia: Array) -> None:
    """Make the prim a rigid body of this mass [kg], centre of mass [m] and inertia about it [kg·m²], shape (3, 3)."""
    UsdPhysics.RigidBodyAPI.Apply(prim)
    api = UsdPhysics.MassAPI.Apply(prim)
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    api.CreateMassAttr(float(mass))
    api.CreateCenterOfMassAttr(Gf.Vec3f(*vector(com)))
    api.CreateDiagonalInertiaAttr(Gf.Vec3f(*vector(moments)))
    api.CreatePrincipalAxesAttr(Gf.Quatf(*_wxyz(Rotation.from_matrix(axes).as_quat(canonical=True))))


def set_attribute(prim: Usd.Prim, name: str, type_name: Sdf.ValueTypeName, value: Any) -> None:
    """Author an attribute of Newton's schemas, or a custom one of ours."""
    prim.CreateAttribute(name, type_name, custom=name.startswith("artigrasp:")).Set(value)


def vector(values: ArrayLike) -> list[float]:
    """Values as the plain floats that USD takes, without rounding noise and negative zeros."""
    return [round(float(value), 14) + 0.0 for value in np.asarray(values, float).ravel()]


def _wxyz(orientation: ArrayLike) -> list[float]:
    x, y, z, w = vector(orientation)
    return [w, x, y, z]


class StageReader:
    """Reads a USD file of one of our formats; whatever is missing or malformed raises UserError naming file and field.

    Args:
        path: The file.
        format: Format it must have.
        version: Newest version that is understood.
    """

    def __init__(self, path: Path, format: str, version: int) -> None:
        self.path = path
        self.stage = open_stage(path)
        data = self.stage.GetRootLayer().customLayerData
        check_format(data.get("format"), data.get("version"), format, version, path)

    def error(self, field: str, problem: str) -> UserError:
        """The error for one field of this file."""
        return UserError(f"{self.path}: {field}: {problem}")

    def prim(self, path: str) -> Usd.Prim:
        """The prim at a path."""
        prim = self.stage.GetPrimAtPath(path)
        if not prim:
            raise self.error(path, "expected a prim, found none")
        return prim

    def value(self, prim: Usd.Prim, name: str) -> Any:
        """The value of an attribute."""
        value = prim.GetAttribute(name).Get() if prim.HasAttribute(name) else None
        if value is None:
            raise self.error(f"{prim.GetPath()}.{name}", "expected a value, found none")
        return value

    def array(self, prim: Usd.Prim, name: str, shape: tuple[int, ...]) -> Array:
        """A finite numeric attribute as an array of this shape; -1 stands for any length."""
        field = f"{prim.GetPath()}.{name}"
        try:
            array = np.array(self.value(prim, name), float)
        except (TypeError, ValueError) as error:
            raise self.error(field, "expected numbers") from error
        if array.ndim != len(shape) or any(n not in (-1, m) for n, m in zip(shape, array.shape, strict=True)):
            raise self.error(field, f"expected shape {shape}, found {array.shape}")
        if not np.isfinite(array).all():
            raise self.error(field, f"expected finite numbers, found {array[~np.isfinite(array)][0]}")
        return array

    def number(self, prim: Usd.Prim, name: str) -> float:
        """A finite number."""
        return float(self.array(prim, name, ()))

    def pose(self, prim: Usd.Prim) -> tuple[Array, Array]:
        """Position [m] and orientation (xyzw, w >= 0) of a prim in its parent."""
        xform = UsdGeom.Xformable(prim)
        with _quiet():
            expected, found = len(xform.GetXformOpOrderAttr().Get() or ()), len(xform.GetOrderedXformOps())
            matrix = xform.GetLocalTransformation().RemoveScaleShear()
        if found != expected or not np.isfinite(matrix).all():
            raise self.error(str(prim.GetPath()), "expected a transformation, found operations without finite values")
        quaternion = matrix.ExtractRotationQuat()
        orientation = np.array([*quaternion.GetImaginary(), quaternion.GetReal()])
        return np.array(matrix.ExtractTranslation()), np.copysign(1.0, orientation[3]) * orientation

    def rotation(self, prim: Usd.Prim, name: str) -> Rotation:
        """A quaternion attribute as a rotation."""
        value = self.value(prim, name)
        if not isinstance(value, Gf.Quatf | Gf.Quatd | Gf.Quath):
            raise self.error(f"{prim.GetPath()}.{name}", f"expected a quaternion, found {value}")
        quaternion = np.array([*value.GetImaginary(), value.GetReal()])
        if not abs(np.linalg.norm(quaternion) - 1) < 1e-3:
            raise self.error(f"{prim.GetPath()}.{name}", f"expected a unit quaternion, found {value}")
        return Rotation.from_quat(quaternion)

    def mass(self, prim: Usd.Prim) -> tuple[float, Array, Array]:
        """Mass [kg], centre of mass [m] and inertia about it [kg·m²], shape (3, 3), of a rigid body."""
        if not prim.HasAPI(UsdPhysics.MassAPI):
            raise self.error(str(prim.GetPath()), "expected a PhysicsMassAPI, found none")
        axes = self.rotation(prim, "physics:principalAxes").as_matrix()
        inertia = axes @ np.diag(self.array(prim, "physics:diagonalInertia", (3,))) @ axes.T
        return self.number(prim, "physics:mass"), self.array(prim, "physics:centerOfMass", (3,)), inertia


def open_stage(path: Path, root: Path | None = None) -> Usd.Stage:
    """Open a USD file, and with it the files that it is composed of.

    Args:
        path: The file.
        root: Folder that holds everything that it may be composed of. Without one it must be text and complete, as the
            files of our own formats are: so a damaged or hostile one reaches neither USD's reader of binary files,
            which is not made for them, nor other files.

    Raises:
        UserError: there is no such file, it is not USD, it refers to others that it may not, or has value clips.
    """
    if not path.is_file():
        raise UserError(f"{path}: expected a USD file, found {'a folder' if path.is_dir() else 'nothing'}")
    if root is None:
        with path.open("rb") as file:
            if file.read(len(_TEXT)) != _TEXT:
                raise UserError(f"{path}: cannot read this as USD: expected text that begins with {_TEXT.decode()}")
    try:
        with _quiet():
            layer = Sdf.Layer.FindOrOpen(str(path))
            if layer is not None:
                # A file that changed since it was last opened in this process.
                layer.Reload()
                _check_references(layer, path, root)
            stage = Usd.Stage.Open(layer) if layer is not None else None
    except (Tf.ErrorException, UnicodeDecodeError) as error:
        raise UserError(f"{path}: cannot read this as USD: {_reason(error)}") from None
    if stage is None:
        raise UserError(f"{path}: cannot read this as USD")
    for layer in stage.GetUsedLayers():
        if not layer.anonymous and layer != stage.GetRootLayer():
            _check_file(layer.identifier, path, root)
    return stage


def _reason(error: Exception) -> str:
    """What USD says first; a file that is no text lets it fail even to say something."""
    try:
        said = _COMMENTARY.search(str(error))
    except UnicodeDecodeError:
        said = None
    return " ".join(said[1].split()) if said else "not USD"


def _check_references(layer: Sdf.Layer, path: Path, root: Path | None) -> None:
    """Refuse references of a layer and of those that it refers to, before a stage follows them."""
    waiting, seen = [layer], {layer.identifier}
    while waiting:
        layer = waiting.pop()
        _check_clips(layer, path)
        for reference in layer.GetCompositionAssetDependencies():
            if reference.startswith("`"):
                raise UserError(f"{path}: expected references by name, found the expression {reference}")
            identifier = layer.ComputeAbsolutePath(reference)
            _check_file(identifier, path, root)
            if identifier not in seen and (found := Sdf.Layer.FindOrOpen(identifier)) is not None:
                waiting.append(found)
            seen.add(identifier)


def _check_clips(layer: Sdf.Layer, path: Path) -> None:
    """Refuse value clips: files that a stage opens where a value is asked for, which are none of the references."""

    def check(at: Sdf.Path) -> None:
        is_prim = at.IsPrimPath() or at.IsPrimVariantSelectionPath()
        if is_prim and layer.GetPrimAtPath(at).HasInfo("clips"):
            raise UserError(f"{path}: expected values in the file itself, found value clips at {at}")

    layer.Traverse(Sdf.Path.absoluteRootPath, check)


def _check_file(identifier: str, path: Path, root: Path | None) -> None:
    """Refuse a layer outside the folder; one in a package lies where the package does."""
    if root is None:
        raise UserError(f"{path}: expected a file that is complete, found a reference to {identifier}")
    file = Sdf.Layer.SplitIdentifier(identifier)[0]
    while Ar.IsPackageRelativePath(file):
        file = Ar.SplitPackageRelativePathOuter(file)[0]
    check_inside(file, root, path)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Keep USD's diagnostics off the terminal: what matters becomes an exception."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        delegate.TakeUncoalescedDiagnostics()
