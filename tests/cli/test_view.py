"""Tests of `artigrasp view` up to where a browser would be needed."""

import json
import signal
import socket
import subprocess
import sys
import urllib.request
from functools import partial
from pathlib import Path

import pytest

from artigrasp.cli import main
from artigrasp.motion.file import save_motion
from tests.motion.example import example_motion


@pytest.fixture
def motion(work: Path) -> Path:
    """A motion file in the user's folder."""
    save_motion(work / "motion.npz", example_motion())
    return work / "motion.npz"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["motion"], "expected one or more motion files, found none"),
        (["motion", "nothing.npz"], "nothing.npz: no such file"),
        (["references", "liddedbox"], "unknown object 'liddedbox': did you mean 'lidded-box'"),
        (["task", "right-fixd"], "right-fixed"),
        (["task", "--policy", "liddedbox"], "unknown policy 'liddedbox': did you mean 'lidded-box'"),
        (["run", "nothing"], "expected the description of a run"),
        (["motion", "motion.npz", "--host", "not.a.host.invalid"], "expected a host and a port to listen at"),
    ],
)
def test_what_cannot_be(words: list[str], message: str, motion: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Mistakes end in one line and code 2."""
    assert main(["view", *words]) == 2
    error = capfd.readouterr().err.strip().splitlines()
    assert len(error) == 1 and message in error[0]


def test_port_in_use(motion: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """A port that somebody else listens at is no reason to take another one quietly."""
    with socket.create_server(("localhost", 0)) as server:
        port = server.getsockname()[1]
        assert main(["view", "motion", str(motion), "--port", str(port)]) == 2
    assert capfd.readouterr().err == (
        f"error: localhost:{port}: expected a host and a port to listen at, found that this port is in use\n"
    )


@pytest.mark.skipif(sys.platform == "win32", reason="needs Ctrl-C as a signal")
def test_serves_until_interrupted(motion: Path) -> None:
    """It says where it listens once it does, on this machine alone, and Ctrl-C ends it without a word."""
    program = Path(sys.executable).with_name("artigrasp")
    command = [str(program), "view", "motion", str(motion), "--port", "0", "--json"]
    # a shell lets what it runs in the background ignore Ctrl-C
    obey = partial(signal.signal, signal.SIGINT, signal.SIG_DFL)
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=obey
    ) as process:
        assert process.stdout is not None and process.stderr is not None
        text = "".join(process.stdout.readline() for _ in range(3))
        url = json.loads(text)["url"]
        with urllib.request.urlopen(url, timeout=30) as answer:
            assert b"<html" in answer.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
        assert "Traceback" not in process.stderr.read()
