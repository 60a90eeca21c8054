"""`gcs links`: who is heard over which link, and how well."""

import asyncio
from collections.abc import Iterator
from typing import Annotated

import typer

from gcs.commands.options import InstanceOption, KeysOption, LinkOption
from gcs.link.paths import LinkQuality
from gcs.link.url import LinkUrl, parse_link_url
from gcs.settings import FlightSettings
from gcs.station import Station

N_WORDS = 4
"""The first columns are words, the others numbers."""
TITLES = ("vehicle", "signing", "link", "from", "messages/s", "lost", "round trip", "heard")


def links(
    link: LinkOption = None,
    keys: KeysOption = None,
    seconds: Annotated[float, typer.Option(min=1.0, max=3600.0, help="how long to listen")] = 5.0,
    instance_base: InstanceOption = 0,
) -> None:
    """Listen for a while, and say who is heard over which link, and how well; vehicles get nothing but heartbeats.

    Example:

        gcs links --link udpin://0.0.0.0:14550 --link serial:///dev/ttyUSB0:57600 --seconds 10

    Exit codes: 0 a vehicle was heard, 1 none was, 2 bad input.
    """
    urls = tuple(parse_link_url(text) for text in link or ())
    settings = FlightSettings(mission="", links=urls, keys=keys, instance_base=instance_base)
    raise typer.Exit(0 if asyncio.run(_listen(settings, seconds)) else 1)


async def _listen(settings: FlightSettings, seconds: float) -> bool:
    from gcs.attachment import attached
    from gcs.security.key_ring import KeyRing

    opened, ring = settings.ground_links(), KeyRing(settings.key_folder())
    for url in opened:
        print(f"listening on {url} for {seconds:g} s")
    async with attached(opened, ring, print, audited=False) as station:
        begun_s = station.now_s
        await asyncio.sleep(seconds)
        rows = list(link_rows(station, opened, station.now_s - begun_s))
    print("\n".join(aligned([TITLES, *rows])) if rows else "no vehicle heard")
    if station.codec.malformed:
        print(f"{station.codec.malformed} malformed frames were dropped")
    for (sysid, refusal), count in sorted(station.codec.signing.refused.items(), key=str):
        print(f"{count} frames in the name of vehicle {sysid} were dropped: what came {refusal.value}")
    return bool(rows)


def link_rows(station: Station, urls: tuple[LinkUrl, ...], listened_s: float) -> Iterator[tuple[str, ...]]:
    """Yield the cells of every path to every vehicle, the best one of each first."""
    for sysid in sorted(station.fleet.vehicles):
        best = station.routes.best(sysid, station.now_s)
        qualities = station.routes.qualities(sysid, station.now_s)
        for way in sorted(qualities, key=lambda way: way != best):
            connection, address = way
            url = urls[station.connections.index(connection)]
            trust = station.codec.signing.trust(sysid).value
            yield (f"{sysid}", trust, str(url), f"{address[0]}:{address[1]}", *_words(qualities[way], listened_s))


def _words(quality: LinkQuality, listened_s: float) -> tuple[str, ...]:
    round_trip = "–" if quality.round_trip_s is None else f"{1e3 * quality.round_trip_s:.1f} ms"
    return (
        f"{quality.received / listened_s:.1f}",
        f"{100 * quality.loss:.1f} %",
        round_trip,
        f"{quality.age_s:.1f} s ago",
    )


def aligned(rows: list[tuple[str, ...]]) -> list[str]:
    """Lines with columns of equal width, numbers on the right."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.ljust(width) if column < N_WORDS else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]
