"""The server of the page: viser on a port that is free."""

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
    """The page, served by threads of its own while the block lasts. Arguments: see `Page`.

    Args:
      host: address to listen to.
      port: 0: any that is free.

    Raises:
      InputError: viser is not installed, the address is not of this machine, or the port is taken.
    """
    require()
    import viser

    refuse_taken(host, port)
    with quiet():
        server = viser.ViserServer(host=host, port=port, label="jaxbiped", verbose=False)
    try:
        if port and server.get_port() != port:  # taken in between: viser goes on to the next one
            raise taken(port)
        page = Page(server, mission, missions, at)
        yield page
        page.close()
    finally:
        with quiet():
            server.stop()


def require() -> None:
    """Raise `InputError` when viser is not installed."""
    try:
        import viser  # noqa: F401
    except ImportError:
        raise InputError("`jaxbiped view` needs viser: pip install 'jaxbiped[view]'") from None


def refuse_taken(host: str, port: int) -> None:
    """Raise `InputError` unless a port can be listened to."""
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
    """The error of a port that something else listens to."""
    return InputError("is taken; choose another port, or 0 for any that is free", field="port", value=port)


@contextlib.contextmanager
def quiet() -> Iterator[None]:
    """Without what viser prints."""
    with contextlib.redirect_stdout(io.StringIO()):
        yield
