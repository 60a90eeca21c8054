"""All browsers that show the page: one view for each, made when it comes and dropped when it goes."""

import asyncio
import contextlib
import warnings
from collections.abc import Callable, Generator, Sequence

import numpy as np
import numpy.typing as npt
import viser

from gcs.view.browser import Browser
from gcs.view.overlay import Tag
from gcs.view.sightings import Sightings
from gcs.view.theme import Theme

Array = npt.NDArray[np.float64]


class Browsers:
    """The browsers of one page.

    Args:
        server: of the page.
        make: makes the view of a browser.
    """

    def __init__(self, server: viser.ViserServer, make: Callable[[viser.ClientHandle], Browser]) -> None:
        self._server, self._make = server, make
        self._browsers: dict[int, Browser] = {}
        self._shown: tuple[Sightings, Sequence[Tag], Array] = (Sightings(), (), np.zeros((0, 3)))
        self._loop = asyncio.get_running_loop()
        server.on_client_connect(self._come)

    def update(self, seen: Sightings, tags: Sequence[Tag], places_m: Array, *, overlay: bool) -> None:
        """Bring every browser up to date: vehicles, and if it is its turn the overlay; (n, 3) places of the tags."""
        clients = self._server.get_clients()
        self._browsers = {key: browser for key, browser in self._browsers.items() if key in clients}
        self._shown = seen, tags, places_m
        for client in clients.values():
            self._show(client, overlay=overlay)

    def _come(self, client: viser.ClientHandle) -> None:
        """Called in a thread of viser."""
        self._loop.call_soon_threadsafe(self._welcome, client)

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Show the vehicles at once, not with the next update: so they are in a newcomer's first picture."""
        if client.client_id in self._server.get_clients():
            self._show(client, overlay=True)
            client.flush()

    def _show(self, client: viser.ClientHandle, *, overlay: bool) -> None:
        key = client.client_id
        with _writes_to_whoever_leaves():
            if key not in self._browsers:
                self._browsers[key] = self._make(client)
            self._browsers[key].update(*self._shown, overlay=overlay)

    def explain(self, legend: str) -> None:
        """Show this legend in all of them."""
        for browser in self._browsers.values():
            browser.explain(legend)

    def use(self, theme: Theme) -> None:
        """Draw everything dark or light from now on."""
        for browser in self._browsers.values():
            browser.use(theme)


@contextlib.contextmanager
def _writes_to_whoever_leaves() -> Generator[None]:
    """A browser may go at any moment: viser then warns of what is still written to it, which is nothing to tell."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Queued a", category=UserWarning)
        yield
