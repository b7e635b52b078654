"""`jaxbiped view`: missions in the browser."""

from __future__ import annotations

import time
import webbrowser

from jaxbiped.commands.options.view import ViewArgs
from jaxbiped.errors import InputError
from jaxbiped.viewer.mission_choice import Missions, Place, Study, missions
from jaxbiped.viewer.server import refuse_taken, require, serving


def main(args: ViewArgs) -> int:
    """Run the command; exit status 0.

    Raises:
      InputError: nothing to show, an arena, strategy or point that does not exist, viser is not installed, or
        the port is in use.
    """
    require()
    refuse_taken(args.host, args.port)
    found = missions(args.result)
    at = beginning(found, args)
    if isinstance(found, Study):
        print(f"playing arena {at[2]} again, {at[0]}; the first mission takes a minute to compile", flush=True)
    others = found if isinstance(found, Study) or len(found.choices(*at[:2])) > 1 else None
    with serving(found.open(*at), args.host, args.port, others, at) as page:
        url = f"http://{reached_at(args.host)}:{page.server.get_port()}"
        print(f"{page.mission.title}: {page.mission.ending}")
        print(f"{url}  (Ctrl-C ends)", flush=True)
        if args.browser and not args.once:
            webbrowser.open(url)
        if not args.once:
            wait()
    return 0


def reached_at(host: str) -> str:
    """The host name in the URL of a server that listens on an address."""
    if host in ("0.0.0.0", "::", ""):
        return "localhost"
    return f"[{host}]" if ":" in host else host


def wait() -> None:
    """Wait until Ctrl-C."""
    try:
        while True:
            time.sleep(3600)
    except KeyboardInterrupt:
        print()


def beginning(found: Missions, args: ViewArgs) -> Place:
    """Strategy, point and arena of the mission to start with."""
    if not isinstance(found, Study):
        for name in ("strategy", "point"):
            if getattr(args, name) is not None:
                raise InputError("goes with the folder of a study", field=name, value=getattr(args, name))
        return "", 0, args.arena or 0
    strategy, point = args.strategy or found.strategies[0], args.point or 0
    choices = found.choices(strategy, point)
    return strategy, point, choices[0].arena if args.arena is None else args.arena
