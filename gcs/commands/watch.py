"""`gcs watch`: the page on whatever is on the links."""

import asyncio
import time

from gcs.commands.options import HostOption, KeysOption, LinkOption, PortOption, TokenOption, check_access, work_dir
from gcs.link.url import parse_link_url
from gcs.settings import FlightSettings


def watch(
    link: LinkOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
    keys: KeysOption = None,
) -> None:
    """Show whatever is on the links in the web page, and command it from there.

    Example:

        gcs watch --link udpin://0.0.0.0:14550
    """
    from gcs.console import FlightConsole
    from gcs.flight.events import BEGAN, EventLog
    from gcs.view.server import serve_page
    from gcs.watch import watch as run_watch

    check_access(host, token)
    ground_links = tuple(parse_link_url(text) for text in link or ())
    settings = FlightSettings(mission="", links=ground_links, keys=keys, host=host, port=port, token=token)
    console, folder = FlightConsole(), work_dir(None, "watch")
    events = EventLog(time.monotonic, folder / "events.jsonl", listeners=[console.show])
    events.add(BEGAN, "gcs watch", unix_us=time.time_ns() // 1000)
    console.say(f"recorded in {folder}")
    console.say(f"page: {settings.page_url}")
    asyncio.run(run_watch(settings, events, folder, lambda desk, first: serve_page(desk, host, port, first, token)))
