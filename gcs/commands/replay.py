"""`gcs replay`: the page on a recording."""

import asyncio
from pathlib import Path
from typing import Annotated

import typer

from gcs.commands.options import PortOption
from gcs.errors import UsageError
from gcs.replay.player import GREATEST_SPEED, LEAST_SPEED


def replay(
    flight: Annotated[
        Path, typer.Argument(metavar="FLIGHT.tlog", help="a recording, ours or from another ground station")
    ],
    speed: Annotated[float, typer.Option(help="recorded seconds per second")] = 1.0,
    seek: Annotated[float, typer.Option(metavar="S", help="where to begin, in seconds")] = 0.0,
    port: PortOption = 8080,
) -> None:
    """Show a recorded flight in the web page: nothing is sent to anybody.

    Mission, plan and events are shown, too, where the files of the flight still lie beside the recording.

    Examples:

        gcs replay out/flight.tlog

        gcs replay out/flight.tlog --speed 5 --seek 60
    """
    if not LEAST_SPEED <= speed <= GREATEST_SPEED:
        raise UsageError(f"--speed {speed:g}: expected {LEAST_SPEED:g} to {GREATEST_SPEED:g}")
    from gcs.console import FlightConsole
    from gcs.flight.journal import JOURNAL_FILE, read_story
    from gcs.flight.told import read_told
    from gcs.replay.player import Player
    from gcs.replay.recording import read_recording
    from gcs.replay_session import ReplaySession
    from gcs.view.server import serve_page

    recording, console = read_recording(flight), FlightConsole()
    if not 0.0 <= seek <= recording.duration_s:
        raise UsageError(f"--seek {seek:g}: expected 0 to {recording.duration_s:.1f}, the length of the recording")
    console.say(f"{flight}: {recording.duration_s:.1f} s, {len(recording)} frames")
    if recording.skipped_bytes:
        console.say(f"{recording.skipped_bytes} bytes are damaged and left out", style="yellow")
    player = Player(recording)
    player.set_speed(speed)
    player.seek(seek)
    player.play()
    story = read_story(flight.with_name(JOURNAL_FILE))
    session = ReplaySession(player, read_told(flight.with_name("events.jsonl"), recording), story)
    console.say(f"page: http://127.0.0.1:{port}")
    asyncio.run(session.run(lambda desk, first: serve_page(desk, "127.0.0.1", port, first)))
