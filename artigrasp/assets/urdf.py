"""The little of URDF that the release's hands and objects use.

A body's inertia is given in axes turned by ``rpy`` and placed at its centre of mass; collision shapes likewise.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from artigrasp.arrays import Array
from artigrasp.errors import UserError

LARGEST = 1e6
"""Numbers from this on are no sizes, masses, angles or forces."""


class _TreeBuilder(ElementTree.TreeBuilder):
    """Builds elements but no document types, through which entities could grow without bound."""

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise UserError("document types are not allowed")


@dataclass(frozen=True)
class Urdf:
    """A parsed URDF file: its elements by name, and errors that name the file."""

    path: Path
    root: ElementTree.Element

    def error(self, field: str, problem: str) -> UserError:
        """The error for one field of this file."""
        return UserError(f"{self.path}: {field}: {problem}")

    def link(self, name: str) -> ElementTree.Element:
        """The link of this name."""
        return self._named("link", name)

    def joint(self, name: str) -> ElementTree.Element:
        """The joint of this name."""
        return self._named("joint", name)

    def child(self, element: ElementTree.Element, path: str) -> ElementTree.Element:
        """The first element below another at this path."""
        found = element.find(path)
        if found is None:
            raise self.error(_label(element), f"expected <{path}>, found none")
        return found

    def number(self, element: ElementTree.Element, attribute: str) -> float:
        """A numeric attribute."""
        return float(self.numbers(element, attribute, 1)[0])

    def numbers(self, element: ElementTree.Element, attribute: str, count: int) -> Array:
        """An attribute of this many numbers of a size that bodies of any unit have."""
        text = element.get(attribute, "")
        try:
            values = np.array([float(word) for word in text.split()])
        except ValueError:
            values = np.array([np.nan])
        if values.shape != (count,) or not (np.abs(values) < LARGEST).all():
            raise self.error(f"{_label(element)} {attribute}", f"expected {count} numbers, found {text!r}")
        return values

    def origin(self, element: ElementTree.Element) -> tuple[Array, Rotation]:
        """The ``<origin>`` of an element: position [m] and rotation; the identity where it has none."""
        origin = element.find("origin")
        if origin is None:
            return np.zeros(3), Rotation.identity()
        angles = self.numbers(origin, "rpy", 3) if origin.get("rpy") else np.zeros(3)
        return self.numbers(origin, "xyz", 3), Rotation.from_euler("xyz", angles)

    def mass(self, link: ElementTree.Element) -> tuple[float, Array, Array]:
        """Mass [kg], centre of mass [m] and inertia about it in the link's axes [kg·m²], shape (3, 3)."""
        inertial = self.child(link, "inertial")
        element = self.child(inertial, "inertia")
        i: dict[str, float] = {key: self.number(element, key) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")}
        tensor = np.array(
            [[i["ixx"], i["ixy"], i["ixz"]], [i["ixy"], i["iyy"], i["iyz"]], [i["ixz"], i["iyz"], i["izz"]]]
        )
        com, rotation = self.origin(inertial)
        axes = rotation.as_matrix()
        mass = self.number(self.child(inertial, "mass"), "value")
        if mass <= 0 or np.linalg.eigvalsh(tensor)[0] <= 0:
            raise self.error(_label(link), f"expected a positive mass and inertia, found {mass:g} kg and {i}")
        return mass, com, axes @ tensor @ axes.T

    def _named(self, tag: str, name: str) -> ElementTree.Element:
        for element in self.root.iter(tag):
            if element.get("name") == name:
                return element
        raise self.error(f"{tag} {name}", "expected this, found none")


def read_urdf(path: Path) -> Urdf:
    """Parse a URDF file.

    Raises:
        UserError: there is no such file, it is not XML, or it has a document type.
    """
    parser: Any = ElementTree.XMLParser(target=_TreeBuilder())
    try:
        return Urdf(path, ElementTree.parse(path, parser).getroot())
    except OSError as error:
        raise UserError(f"{path}: cannot read this file: {error.strerror}") from None
    except (ElementTree.ParseError, UserError) as error:
        raise UserError(f"{path}: cannot read this as URDF: {error}") from None


def _label(element: ElementTree.Element) -> str:
    return f"{element.tag} {element.get('name', '')}".strip()
