"""The viewer's server: who can reach it, and many who do."""

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
import viser
from websockets import Subprotocol
from websockets.sync.client import connect

from artigrasp.viewer.server import Server

CLIENTS = 10
LOOPBACK = {"0100007F", "00000000000000000000000001000000", "0000000000000000FFFF00000100007F"}
"""This machine as the kernel writes it, in IPv4 and IPv6."""


@pytest.fixture
def server() -> Iterator[Server]:
    """A server with nothing on it."""
    server = Server(port=0)
    yield server
    server.stop()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux tells where a process listens")
def test_only_this_machine_is_let_in(server: Server) -> None:
    """No socket listens at an address that others could reach."""
    rows = [line.split() for path in Path("/proc/net").glob("tcp*") for line in path.read_text().splitlines()[1:]]
    places = [row[1].split(":") for row in rows if row[3] == "0A"]
    addresses = {address for address, port in places if int(port, 16) == server.port}
    assert addresses and addresses <= LOOPBACK
    assert server.viser.request_share_url() is None


def test_ten_clients_at_once_get_the_scene(server: Server) -> None:
    """And so does the one that comes when they have gone."""
    server.viser.scene.add_frame("/seen by all")
    address, protocols = server.url.replace("http", "ws", 1), [viser_protocol()]
    with contextlib.ExitStack() as stack:
        clients = [stack.enter_context(connect(address, subprotocols=protocols, max_size=None)) for _ in range(CLIENTS)]
        assert all(len(client.recv(timeout=60)) > 16 for client in clients)
    with connect(address, subprotocols=protocols, max_size=None) as client:
        assert len(client.recv(timeout=60)) > 16


def viser_protocol() -> Subprotocol:
    """What browsers say that they speak."""
    return Subprotocol(f"viser-v{viser.__version__}")
