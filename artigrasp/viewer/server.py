"""Where browsers connect: on this machine only, unless another host is named."""

import contextlib
import errno
import io
import socket
import threading
from collections.abc import Callable

import viser
from viser import ClientHandle

from artigrasp.errors import UserError


class _PrivateServer(viser.ViserServer):
    """A server that no browser can ask for a public address."""

    def request_share_url(self, verbose: bool = True) -> str | None:
        """Refuse: what is viewed stays on this machine."""
        return None


class Server:
    """A viser server, and who watches.

    Attributes:
        viser: The server.
        url: Its address in a browser on this machine.
    """

    def __init__(self, host: str = "localhost", port: int = 8080) -> None:
        """Listen.

        Args:
            host: Name or address to listen at; ``0.0.0.0`` lets other machines in.
            port: Port to listen at; 0 takes a free one.

        Raises:
            UserError: The port is in use, or the host is not this machine's.
        """
        port = _free_port(host, port)
        # viser prints a banner; the verb says what there is to say
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser = _PrivateServer(host=host, port=port, verbose=False)
        shown = "localhost" if host in ("", "0.0.0.0", "::") else host
        self.url = f"http://{shown}:{self.viser.get_port()}"
        self._watched = threading.Event()
        self.viser.gui.set_panel_label("ArtiGrasp")
        self.viser.gui.configure_theme(show_share_button=False, show_logo=False, brand_color=(47, 127, 193))

    @property
    def is_watched(self) -> bool:
        """Whether a browser is connected."""
        return self._watched.is_set()

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self.viser.get_port())

    def on_change(self, call: Callable[[], None]) -> None:
        """Call this, in some thread, whenever a browser has come or gone."""

        def note(client: ClientHandle) -> None:
            if self.viser.get_clients():
                self._watched.set()
            else:
                self._watched.clear()
            call()

        self.viser.on_client_connect(note)
        self.viser.on_client_disconnect(note)

    def flush(self) -> None:
        """Send what has changed at once."""
        self.viser.flush()

    def notify(self, message: str) -> None:
        """Show a message in every browser for a while."""
        for client in self.viser.get_clients().values():
            client.add_notification("ArtiGrasp", message, auto_close_seconds=12.0, color="orange")

    def stop(self) -> None:
        """Let every browser go."""
        with contextlib.redirect_stdout(io.StringIO()):
            self.viser.stop()


def _free_port(host: str, port: int) -> int:
    """The port, found free; viser would quietly take another one."""
    try:
        address = socket.getaddrinfo(host or None, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)[0]
        with socket.socket(address[0], address[1]) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(address[4])
            return int(probe.getsockname()[1])
    except OSError as error:
        reason = "this port is in use" if error.errno == errno.EADDRINUSE else error.strerror or error
        raise UserError(f"{host}:{port}: expected a host and a port to listen at, found that {reason}") from error
