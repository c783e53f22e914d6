"""Tests of the project as it is packaged, installed and checked."""

import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MAPPED = {"artigrasp": "artigrasp", "kernels": "artigrasp.kernels", "tasks": "artigrasp.tasks"}
MAPPED["assets_usd"] = "artigrasp.assets_usd"
PYPROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
ARCTIC = Path("assets_usd/arctic")


def test_listed_packages_are_the_folders() -> None:
    """Every folder with code is installed, under the package's own name."""
    found = {
        ".".join([MAPPED[top], *path.parent.relative_to(ROOT / top).parts])
        for top in MAPPED
        for path in (ROOT / top).rglob("__init__.py")
    }
    assert set(PYPROJECT["tool"]["setuptools"]["packages"]) == found
    assert PYPROJECT["tool"]["setuptools"]["package-dir"] == {package: top for top, package in MAPPED.items()}


def test_constraints_pin_every_dependency() -> None:
    """What the project and its tools need is installed in one exact version."""
    lines = [line for line in (ROOT / "constraints.txt").read_text().splitlines() if not line.startswith("#")]
    assert all(re.fullmatch(r"[\w.-]+==[\w.]+", line) for line in lines)
    pinned = {_normal(line.split("==")[0]) for line in lines}
    project = PYPROJECT["project"]
    needed = {_normal(name) for name in project["dependencies"] + project["optional-dependencies"]["dev"]}
    assert needed <= pinned


def _normal(requirement: str) -> str:
    name = re.match(r"[\w.-]+", requirement)
    assert name is not None
    return re.sub(r"[-_.]+", "-", name.group()).lower()


def test_readme_names_every_verb() -> None:
    """The table of commands and the command line agree."""
    from artigrasp.cli.app import VERBS

    table = re.findall(r"^\| `artigrasp ([a-z-]+)", (ROOT / "README.md").read_text(), flags=re.MULTILINE)
    assert table == list(VERBS)


@pytest.fixture(scope="module")
def source(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of what is installed, with a file where an ARCTIC import would put its own."""
    copy = tmp_path_factory.mktemp("source")
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    for top in MAPPED:
        shutil.copytree(ROOT / top, copy / top, ignore=shutil.ignore_patterns("__pycache__", "arctic"))
    for name in ("objects/box.usda", "references/box.npz"):
        (copy / ARCTIC / name).parent.mkdir(parents=True)
        (copy / ARCTIC / name).touch()
    return copy


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel built from that copy."""
    folder = tmp_path_factory.mktemp("wheel")
    _pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(folder), str(source))
    (built,) = folder.glob("*.whl")
    return built


def _pip(*arguments: str) -> None:
    subprocess.run(
        [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments],
        check=True,
        stdin=subprocess.DEVNULL,
    )


def test_wheel_holds_the_assets_but_no_imported_data(wheel: Path) -> None:
    """Hands, objects, references and policies of our own are shipped; what a user imported never is."""
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
    own = {
        f"artigrasp/{path.relative_to(ROOT).as_posix()}"
        for path in (ROOT / "assets_usd").rglob("*")
        if path.suffix in {".usda", ".usdc", ".npz", ".pt", ".json", ".yaml"} and ROOT / ARCTIC not in path.parents
    }
    assert own and own <= names
    assert "artigrasp/py.typed" in names
    assert not [name for name in names if "arctic/" in name]
    assert {name.split("/")[0] for name in names} == {
        "artigrasp",
        f"artigrasp-{PYPROJECT['project']['version']}.dist-info",
    }


def test_installed_wheel_lists(wheel: Path, tmp_path: Path) -> None:
    """In a clean environment that has the dependencies, the installed command works away from the checkout."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "venv")], check=True)
    binaries = tmp_path / "venv" / ("Scripts" if os.name == "nt" else "bin")
    _pip("--python", str(binaries / "python"), "install", "--no-deps", "--no-index", str(wheel))
    # A path file makes the dependencies importable, but not this project's editable installation, which is a path
    # file too: only those in an environment's own folder are read.
    variables = {"base": str(tmp_path / "venv"), "platbase": str(tmp_path / "venv")}
    packages = Path(sysconfig.get_path("purelib", vars=variables))
    (packages / "dependencies.pth").write_text(sysconfig.get_path("purelib") + "\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ARTIGRASP"))}
    environment["XDG_DATA_HOME"] = str(tmp_path / "data")

    def run(*command: str) -> str:
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=tmp_path, env=environment)
        return done.stdout

    where = run(str(binaries / "python"), "-c", "import artigrasp.kernels; print(artigrasp.kernels.__file__)")
    assert Path(where.strip()).is_relative_to(packages)
    listed = run(str(binaries / "artigrasp"), "list")
    assert all(path.stem in listed for path in (ROOT / "assets_usd" / "objects").glob("*.usda"))


@pytest.fixture
def installed(source: Path, tmp_path: Path) -> Path:
    """The copy laid out as an installation is."""
    for top, package in MAPPED.items():
        shutil.copytree(source / top, tmp_path / package.replace(".", "/"))
    shutil.copy(source / "pyproject.toml", tmp_path)
    return tmp_path


def _check(folder: Path, *command: str) -> tuple[int, str]:
    tool = Path(sys.executable).with_name(command[0])
    done = subprocess.run(
        [tool, *command[1:]],
        capture_output=True,
        text=True,
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "COLUMNS": "200"},
    )
    return done.returncode, " ".join((done.stdout + done.stderr).split())


@pytest.mark.parametrize(
    ("place", "planted", "contract"),
    [
        ("assets", "artigrasp.training", "Layers import only what lies below them"),
        ("kernels", "artigrasp.assets", "Layers import only what lies below them"),
        ("kernels", "torch", "Kernels stand alone"),
        ("tasks", "numpy", "Tasks are pure data"),
        ("export", "artigrasp.simulation", "Export reads motion files, references and assets, and simulates nothing"),
    ],
)
def test_forbidden_imports_are_caught(place: str, planted: str, contract: str, installed: Path) -> None:
    """An import against the direction of the layers fails the check, in the mapped folders too."""
    (installed / "artigrasp" / place / "planted.py").write_text(f'"""Planted."""\n\nimport {planted}\n')
    code, output = _check(installed, "lint-imports", "--no-cache")
    assert code == 1
    assert f"{contract} BROKEN" in output
    assert f"artigrasp.{place}.planted -> {planted}" in output


def test_circles_are_caught(installed: Path) -> None:
    """Two modules of one package that import each other fail the check."""
    for one, other in (("first", "second"), ("second", "first")):
        code = f'"""Planted."""\n\nimport artigrasp.assets.planted_{other}\n'
        (installed / "artigrasp" / "assets" / f"planted_{one}.py").write_text(code)
    code, output = _check(installed, "lint-imports", "--no-cache")
    assert code == 1 and "No modules import each other in a circle BROKEN" in output


def test_packages_without_a_layer_are_caught(installed: Path) -> None:
    """A new package must take its place among the layers."""
    (installed / "artigrasp" / "novelty").mkdir()
    (installed / "artigrasp" / "novelty" / "__init__.py").touch()
    code, output = _check(installed, "lint-imports", "--no-cache")
    assert code == 1 and "novelty" in output


def test_wrong_types_are_caught_in_mapped_folders(installed: Path) -> None:
    """The type checker reads the folders that are mapped into the package."""
    (installed / "artigrasp" / "tasks" / "planted.py").write_text(
        '"""Planted."""\n\nfrom artigrasp.config import PhysicsConfig\n\nPHYSICS = PhysicsConfig(timestep="slow")\n'
    )
    code, output = _check(installed, "mypy", "--cache-dir", "cache", "-m", "artigrasp.tasks.planted")
    assert code == 1 and 'Argument "timestep" to "PhysicsConfig" has incompatible type "str"' in output
