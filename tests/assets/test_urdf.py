"""Reading URDF: its conventions, and files that are not to be trusted."""

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from artigrasp.assets.urdf import read_urdf
from artigrasp.errors import UserError

LINK = """<robot><link name="a"><inertial><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><mass value="2"/>
<inertia ixx="1" iyy="2" izz="2.5" ixy="0" ixz="0" iyz="0"/></inertial></link></robot>"""


def write(path: Path, text: str) -> Path:
    """Write a text file."""
    path.write_text(text)
    return path


def test_inertia_is_turned_into_the_link_axes(tmp_path: Path) -> None:
    """``rpy`` turns about fixed axes: R = Rz · Ry · Rx."""
    urdf = read_urdf(write(tmp_path / "a.urdf", LINK))
    mass, com, inertia = urdf.mass(urdf.link("a"))
    z, y, x = (Rotation.from_rotvec(angle * np.eye(3)[axis]) for axis, angle in ((2, 0.3), (1, 0.2), (0, 0.1)))
    axes = (z * y * x).as_matrix()
    assert mass == 2 and com.tolist() == [1, 2, 3]
    np.testing.assert_allclose(inertia, axes @ np.diag([1, 2, 2.5]) @ axes.T, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (None, "cannot read this file"),
        ("<robot>", "cannot read this as URDF"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><robot>&b;</robot>', "document types are not allowed"),
        (LINK.replace('name="a"', 'name="b"'), "link a: expected this, found none"),
        (LINK.replace("<mass value", "<weight value"), "expected <mass>, found none"),
        (LINK.replace('value="2"', 'value="two"'), "expected 1 numbers, found 'two'"),
        (LINK.replace("1 2 3", "1 2 nan"), "expected 3 numbers, found '1 2 nan'"),
    ],
    ids=["missing", "truncated", "doctype", "link", "mass", "number", "nan"],
)
def test_bad_urdf_is_named(text: str | None, message: str, tmp_path: Path) -> None:
    """Every malformed file gives one line that names it; document types, which can explode, are refused."""
    path = tmp_path / "a.urdf"
    if text is not None:
        write(path, text)
    with pytest.raises(UserError, match=r"^[^\n]*$") as caught:
        urdf = read_urdf(path)
        urdf.mass(urdf.link("a"))
    assert str(path) in str(caught.value) and message in str(caught.value)
