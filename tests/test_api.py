"""The stable interface."""

import importlib
import subprocess
import sys

import pytest

import artigrasp


def test_every_name_is_there() -> None:
    """Each public name resolves to the object of that name in its home module."""
    for name, home in artigrasp._HOMES.items():
        assert getattr(artigrasp, name) is getattr(importlib.import_module(home), name)
    assert sorted(artigrasp._HOMES) == artigrasp.__all__
    with pytest.raises(AttributeError, match="no_such_name"):
        artigrasp.no_such_name  # noqa: B018


def test_importing_is_light() -> None:
    """The package alone brings in neither the simulator nor the learner."""
    code = "import artigrasp, sys; print([m for m in ('torch', 'newton', 'warp', 'mujoco') if m in sys.modules])"
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert result.stdout.strip() == "[]"
