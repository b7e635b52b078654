"""The server of the page: viser on a free port."""

from __future__ import annotations

import contextlib
import errno
import io
import socket
from collections.abc import Iterator

from jaxbiped.errors import InputError
from jaxbiped.viewer.mission_choice import Missions, Place
from jaxbiped.viewer.mission_file import Shown
from jaxbiped.viewer.page import Page


@contextlib.contextmanager
def serving(
    mission: Shown, host: str, port: int, missions: Missions | None = None, at: Place | None = None
) -> Iterator[Page]:
    """Serve the page from other threads during the block. Arguments: see `Page`.

    Args:
      host: address to listen on.
      port: 0: any free one.

    Raises:
      InputError: viser is not installed, the address is not of this machine, or the port is in use.
    """
    require()
    import viser

    refuse_taken(host, port)
    with quiet():
        server = viser.ViserServer(host=host, port=port, label="jaxbiped", verbose=False)
    try:
        if port and server.get_port() != port:  # taken in between: viser uses the next one
            raise taken(port)
        page = Page(server, mission, missions, at)
        yield page
        page.close()
    finally:
        with quiet():
            server.stop()


def require() -> None:
    """Raise `InputError` if viser is not installed."""
    try:
        import viser  # noqa: F401
    except ImportError:
        raise InputError("`jaxbiped view` needs viser: pip install 'jaxbiped[view]'") from None


def refuse_taken(host: str, port: int) -> None:
    """Raise `InputError` unless it is possible to listen on a port."""
    try:
        family, kind, protocol, _, address = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)[0]
    except (OSError, UnicodeError):
        raise InputError("must be an address of this machine", field="host", value=host) from None
    with socket.socket(family, kind, protocol) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind(address)
        except PermissionError:
            raise InputError("may not be listened to; choose one above 1023", field="port", value=port) from None
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise taken(port) from None
            raise InputError("must be an address of this machine", field="host", value=host) from None


def taken(port: int) -> InputError:
    """The error about a port that is in use."""
    return InputError("is in use; choose another port, or 0 for any free one", field="port", value=port)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Suppress the output of viser."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
