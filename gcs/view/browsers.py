"""All browsers that show the page: one view for each, made when it comes and dropped when it goes."""

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

    def update(self, seen: Sightings, tags: Sequence[Tag], places_m: Array, *, overlay: bool) -> None:
        """Bring every browser up to date: vehicles, and if it is its turn the overlay; (n, 3) places of the tags."""
        clients = self._server.get_clients()
        self._browsers = {key: browser for key, browser in self._browsers.items() if key in clients}
        with _writes_to_whoever_leaves():
            for key, client in clients.items():
                if key not in self._browsers:
                    self._browsers[key] = self._make(client)
                self._browsers[key].update(seen, tags, places_m, overlay=overlay)

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
