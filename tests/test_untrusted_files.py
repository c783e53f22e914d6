"""Files of strangers: nothing in them is run, and they reach no file outside their folder."""

import ast
import io
import pickle
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
import torch
import trimesh
from pxr import Sdf

from artigrasp.assets.imported_object import load_mesh
from artigrasp.assets.object import read_object
from artigrasp.assets.urdf_object import read_urdf_object
from artigrasp.assets.usd_object import read_usd_object
from artigrasp.errors import UserError
from artigrasp.stories.file import read_story
from tests.assets.foreign import foreign_urdf, foreign_usd
from tests.fuzzing import MakesFolder, save_object
from tests.readers import READERS, Reader

ROOT = Path(__file__).parents[1]
OUTSIDE = "expected files in .*case only, found a reference to .*secret"


@pytest.mark.parametrize("reader", READERS, ids=lambda reader: reader.name)
def test_a_program_in_a_file_is_not_run(reader: Reader, tmp_path: Path) -> None:
    """Each file of each kind in turn is a pickle that makes a folder, in every wrapping that its kind has."""
    whole, sign = tmp_path / "whole", tmp_path / "sign"
    whole.mkdir()
    reader.write(whole)
    for path in sorted(path for path in whole.rglob("*") if path.is_file())[:: 20 if reader.slow else 1]:
        content = path.read_bytes()
        for program in programs(path, sign):
            path.write_bytes(program)
            try:
                reader.read(whole)
            except UserError as error:
                assert "\n" not in str(error)
            assert not sign.exists(), path
        path.write_bytes(content)


def programs(path: Path, sign: Path) -> Iterator[bytes]:
    """Pickles as a file, as an array of one object and as what PyTorch saves, where a file of this name may be one."""
    yield pickle.dumps(MakesFolder(sign))
    if path.suffix in (".npz", ".npy"):
        other = sign.with_suffix(path.suffix)
        save_object(other, MakesFolder(sign))
        yield other.read_bytes()
    if path.suffix == ".pt":
        buffer = io.BytesIO()
        torch.save({"format": "artigrasp.policy", "version": 2, "task": MakesFolder(sign)}, buffer)
        yield buffer.getvalue()


def test_a_story_runs_nothing(tmp_path: Path) -> None:
    """YAML's tags for Python objects are unknown."""
    path = tmp_path / "story.yaml"
    path.write_text(f"!!python/object/apply:os.mkdir ['{tmp_path / 'sign'}']\n")
    with pytest.raises(UserError, match="expected YAML, found something else: could not determine a constructor"):
        read_story(path)
    assert not (tmp_path / "sign").exists()


@pytest.fixture
def case(tmp_path: Path) -> Path:
    """The folder of a stranger's file, beside one that is none of its business."""
    folder = tmp_path / "case"
    folder.mkdir()
    foreign_usd(tmp_path / "secret.usda", "Z", 1.0)
    return folder


@pytest.mark.parametrize("field", ["sublayer", "reference", "payload", "nested", "link"])
@pytest.mark.parametrize("absolute", [False, True])
def test_usd_reaches_no_file_outside_its_folder(field: str, absolute: bool, case: Path, tmp_path: Path) -> None:
    """However a file is composed of others, directly, by way of another one or by a link."""
    target = str(tmp_path / "secret.usda") if absolute else "../secret.usda"
    layer = Sdf.Layer.CreateNew(str(case / "case.usda"))
    if field == "link":
        (case / "link.usda").symlink_to(target)
        layer.subLayerPaths.append("./link.usda")
    elif field == "nested":
        inner = Sdf.Layer.CreateNew(str(case / "inner.usda"))
        inner.subLayerPaths.append(target)
        inner.Save()
        layer.subLayerPaths.append("./inner.usda")
    elif field == "sublayer":
        layer.subLayerPaths.append(target)
    else:
        prim = Sdf.PrimSpec(layer, "World", Sdf.SpecifierDef)
        arcs = prim.referenceList if field == "reference" else prim.payloadList
        arcs.Prepend((Sdf.Reference if field == "reference" else Sdf.Payload)(target, "/World"))
    layer.Save()
    with pytest.raises(UserError, match="link" if field == "link" else OUTSIDE):
        read_usd_object(case / "case.usda")
    with pytest.raises(UserError, match="expected a file that is complete, found a reference to"):
        read_object(case / "case.usda")
    if field == "sublayer":
        assert len(read_usd_object(case / "case.usda", tmp_path).parts) == 2, "where it is asked for"


def test_usd_may_be_composed_of_its_neighbours(case: Path) -> None:
    """A file beside it is its own; a name that is computed is nobody's."""
    foreign_usd(case / "part.usdc", "Z", 1.0)
    layer = Sdf.Layer.CreateNew(str(case / "case.usda"))
    layer.subLayerPaths.append("./part.usdc")
    layer.Save()
    assert len(read_usd_object(case / "case.usda").parts) == 2
    layer.subLayerPaths[0] = '`"./part.usdc"`'
    layer.Save()
    with pytest.raises(UserError, match="expected references by name, found the expression"):
        read_usd_object(case / "case.usda")


@pytest.mark.parametrize("inside", [False, True])
@pytest.mark.parametrize("variant", [False, True])
def test_usd_reaches_no_file_by_value_clips(inside: bool, variant: bool, case: Path) -> None:
    """They are none of the references of a layer, and are opened where a value is asked for."""
    layer = Sdf.Layer.CreateNew(str(case / "case.usda"))
    prim = Sdf.PrimSpec(layer, "World", Sdf.SpecifierDef)
    if variant:
        chosen = Sdf.VariantSpec(Sdf.VariantSetSpec(prim, "look"), "red")
        prim.variantSelections["look"] = "red"
        prim.variantSetNameList.Prepend("look")
        prim = chosen.primSpec
    clip = Sdf.AssetPath("../secret.usda")
    prim.SetInfo("clips", {"default": {"assetPaths": Sdf.AssetPathArray([clip]), "primPath": "/World"}})
    if inside:
        layer.Export(str(case / "inner.usda"))
        layer.Clear()
        layer.subLayerPaths.append("./inner.usda")
    layer.Save()
    with pytest.raises(UserError, match="expected values in the file itself, found value clips at /World"):
        read_usd_object(case / "case.usda")


def test_assets_of_our_own_are_text(case: Path) -> None:
    """USD's reader of binary files, which damaged ones may end or keep for ever, does not see them."""
    foreign_usd(case / "case.usdc", "Z", 1.0)
    (case / "case.usdc").rename(case / "case.usda")
    with pytest.raises(UserError, match="expected text that begins with #usda"):
        read_object(case / "case.usda")


@pytest.mark.parametrize("name", ["../secret.obj", "{folder}/secret.obj", "package:///{inside}", "link.obj"])
def test_urdf_reaches_no_mesh_outside_its_folder(name: str, case: Path, tmp_path: Path) -> None:
    """By no path, package or link; where it is asked for it does."""
    trimesh.creation.box((0.3, 0.2, 0.1)).export(tmp_path / "secret.obj")
    (case / "link.obj").symlink_to(tmp_path / "secret.obj")
    file = name.format(folder=tmp_path, inside=str(tmp_path / "secret.obj").lstrip("/"))
    path = foreign_urdf(case)
    path.write_text(path.read_text().replace('<box size=".3 .2 .1"/>', f'<mesh filename="{file}"/>'))
    with pytest.raises(UserError, match="link" if name == "link.obj" else OUTSIDE):
        read_urdf_object(path)
    assert len(read_urdf_object(path, tmp_path).parts) == 2


def test_meshes_read_no_other_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Materials that an .obj names are left alone."""
    trimesh.creation.box((0.3, 0.2, 0.1)).export(tmp_path / "mesh.obj")
    text = (tmp_path / "mesh.obj").read_text()
    (tmp_path / "mesh.obj").write_text(f"mtllib ../secret.mtl\nusemtl secret\n{text}")

    def refuse(self: object, name: str) -> bytes:
        raise AssertionError(f"read {name}")

    monkeypatch.setattr(trimesh.resolvers.FilePathResolver, "get", refuse)
    assert len(load_mesh(tmp_path / "mesh.obj", np.ones(3)).faces) == 12


def test_urdf_expands_no_entities(tmp_path: Path) -> None:
    """Which would read files, and grow without bound."""
    path = foreign_urdf(tmp_path)
    entity = f'<!DOCTYPE robot [<!ENTITY secret SYSTEM "{tmp_path / "secret"}">]>'
    path.write_text(entity + path.read_text().replace('name="case">', 'name="case">&secret;', 1))
    with pytest.raises(UserError, match="document types are not allowed"):
        read_urdf_object(path)


FORBIDDEN = {"pickle.load", "pickle.loads", "pickle.Unpickler", "marshal.loads", "shelve.open", "os.system", "os.popen"}
FORBIDDEN |= {"eval", "exec", "__import__", "yaml.unsafe_load", "yaml.full_load", "joblib.load", "np.fromfile"}
"""What runs, or may run, what it is given."""


def careless_calls(tree: ast.AST) -> Iterator[tuple[int, str]]:
    """Calls that may run data: line and what is wrong."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name, words = ast.unparse(node.func), {word.arg: ast.unparse(word.value) for word in node.keywords}
        if name in FORBIDDEN:
            yield node.lineno, name
        elif name == "torch.load" and words.get("weights_only") != "True":
            yield node.lineno, "torch.load without weights_only=True"
        elif name == "np.load" and words.get("allow_pickle") != "False":
            yield node.lineno, "np.load without allow_pickle=False"
        elif name == "yaml.load" and words.get("Loader") not in ("_Loader", "yaml.SafeLoader"):
            yield node.lineno, "yaml.load without a safe loader"
        elif words.get("shell") == "True":
            yield node.lineno, f"{name} in a shell"


def test_the_code_calls_nothing_that_runs_data() -> None:
    """Neither package nor tools; what would be found is shown to be found."""
    bad = "pickle.load(f)\ntorch.load(p)\nnp.load(p)\nyaml.load(t)\neval(x)\nsubprocess.run(c, shell=True)\n"
    assert [line for line, _ in careless_calls(ast.parse(bad))] == [1, 2, 3, 4, 5, 6]
    paths = [path for folder in ("artigrasp", "kernels", "tasks", "tools") for path in (ROOT / folder).rglob("*.py")]
    assert len(paths) > 200
    found = [
        f"{path.relative_to(ROOT)}:{line}: {problem}"
        for path in paths
        for line, problem in careless_calls(ast.parse(path.read_text(encoding="utf-8")))
    ]
    assert not found
