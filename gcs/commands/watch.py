"""`gcs watch`: the page on whatever is on the links."""

import asyncio
import time
from pathlib import Path
from typing import Annotated

import typer

from gcs.commands.options import (
    HostOption,
    InstanceOption,
    KeysOption,
    LinkOption,
    PortOption,
    TokenOption,
    check_access,
    work_dir,
)
from gcs.errors import UsageError
from gcs.folders import flights_folder
from gcs.link.url import parse_link_url
from gcs.settings import FlightSettings


def watch(
    link: LinkOption = None,
    host: HostOption = "127.0.0.1",
    port: PortOption = 8080,
    token: TokenOption = None,
    keys: KeysOption = None,
    flight: Annotated[
        Path | None, typer.Option(metavar="DIR", help="a flight's folder: its mission and plan are shown")
    ] = None,
    instance_base: InstanceOption = 0,
) -> None:
    """Show whatever is on the links in the web page, and command it from there.

    With --flight also a flight that another ground station has begun, where it is by its journal: what its vehicles
    have stored is downloaded and compared, and nothing is commanded by itself.

    Examples:

        gcs watch --link udpin://0.0.0.0:14550

        gcs watch --flight ~/.local/state/end-cloud-gcs/flights/2026-05-01T10-00-00-field
    """
    from gcs.console import FlightConsole
    from gcs.flight.events import BEGAN, EventLog
    from gcs.flight.journal import JOURNAL_FILE, read_story
    from gcs.flight.rejoining import newest_left_in_flight
    from gcs.view.server import serve_page
    from gcs.watch import watch as run_watch

    check_access(host, token)
    ground_links = tuple(parse_link_url(text) for text in link or ())
    settings = FlightSettings(
        mission="", links=ground_links, keys=keys, host=host, port=port, token=token, instance_base=instance_base
    )
    story = read_story(flight / JOURNAL_FILE) if flight is not None else None
    if flight is not None and story is None:
        raise UsageError(f"--flight {flight}: there is no journal of a flight in it")
    left = newest_left_in_flight(flights_folder()) if story is None else None
    console, folder = FlightConsole(), work_dir(None, "watch")
    if left is not None:
        console.say(f"a flight was left in the air: gcs watch --flight {left}", style="yellow")
    events = EventLog(time.monotonic, folder / "events.jsonl", listeners=[console.show])
    events.add(BEGAN, "gcs watch", unix_us=time.time_ns() // 1000)
    console.say(f"recorded in {folder}")
    console.say(f"page: {settings.page_url}")
    asyncio.run(
        run_watch(settings, events, folder, lambda desk, first: serve_page(desk, host, port, first, token), story)
    )
