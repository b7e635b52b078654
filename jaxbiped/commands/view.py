"""`jaxbiped view`: missions in the browser."""

from __future__ import annotations

import time
import webbrowser
from pathlib import Path
from typing import Annotated

import pydantic
import tyro

from jaxbiped.config import Model
from jaxbiped.report.viewer.page import serve
from jaxbiped.report.viewer.shown import shown


class ViewArgs(Model):
    """Show a mission in the browser: arena, robot, points, maps, plan and pictures, at any time of it."""

    result: tyro.conf.Positional[Path]
    """A folder that `jaxbiped run` wrote."""
    port: Annotated[int, pydantic.Field(ge=0, le=65535)] = 8080
    """To serve the page on; 0: any that is free."""
    host: str = "127.0.0.1"
    """Address to listen to; 0.0.0.0 lets other machines look, too."""
    browser: bool = True
    """Open the page in the browser."""
    once: bool = False
    """End after the page has been made, without waiting for Ctrl-C."""


def main(args: ViewArgs) -> int:
    """Run the command; exit status 0.

    Raises:
      InputError: no result, viser is not installed, or the port is taken.
    """
    page = serve(shown(args.result / "mission.npz"), args.host, args.port)
    url = f"http://{args.host}:{page.server.get_port()}"
    print(f"{page.mission.title}: {page.mission.ending}")
    print(f"{url}  (Ctrl-C ends)", flush=True)
    try:
        if args.browser and not args.once:
            webbrowser.open(url)
        while not args.once:
            time.sleep(3600)
    except KeyboardInterrupt:
        print()
    finally:
        page.close()
    return 0
