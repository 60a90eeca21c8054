"""What several commands have in common: their options, and the checks of these."""

from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated

import typer

from gcs.errors import UsageError
from gcs.folders import flights_folder, new_flight_folder
from gcs.settings import LOOPBACK

LEAST_TOKEN_LENGTH = 8

MissionArgument = Annotated[str, typer.Argument(metavar="MISSION", help="a mission file, or a shipped mission's name")]
LinkOption = Annotated[
    list[str] | None,
    typer.Option(
        "--link", metavar="URL", help="udpin, udpout, tcp, tcpin://HOST:PORT, serial://DEVICE:BAUD; repeatable"
    ),
]
SeedOption = Annotated[int, typer.Option(min=0, help="of planner and simulator: one seed, one plan")]
HostOption = Annotated[str, typer.Option(help="address of the web page; beyond loopback only with --token")]
PortOption = Annotated[int, typer.Option(min=1, max=65535, help="port of the web page")]
TokenOption = Annotated[
    str | None,
    typer.Option(envvar="GCS_TOKEN", help="whoever opens the page has to know it; better in $GCS_TOKEN than here"),
]
InstanceOption = Annotated[int, typer.Option("--instance-base", min=0, max=10_000, help="shifts all ports")]
KeysOption = Annotated[
    Path | None, typer.Option("--keys", metavar="DIR", help="signing keys; see `gcs key`, which has the same option")
]


def check_access(host: str, token: str | None) -> None:
    """A page beyond loopback can be reached by others: they have to know a token that is not guessed."""
    if token is not None and len(token) < LEAST_TOKEN_LENGTH:
        raise UsageError(f"--token: expected at least {LEAST_TOKEN_LENGTH} characters, found {len(token)}")
    if token is None and host not in LOOPBACK:
        raise UsageError(f"--host {host}: others can reach the page there: give a --token that they have to know")


def work_dir(report_dir: Path | None, name: str) -> Path:
    """The report's directory, or one among all flights, which are kept."""
    try:
        if report_dir is None:
            return new_flight_folder(name, datetime.now(UTC))
        report_dir.mkdir(parents=True, exist_ok=True)
    except OSError as problem:
        raise UsageError(f"{report_dir or flights_folder()}: cannot be made: {problem.strerror} (--report)") from None
    return report_dir
