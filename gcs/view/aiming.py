"""Sending vehicles to a place that is clicked at in the scene."""

from collections.abc import Callable, Iterable
from typing import cast

import numpy as np
import numpy.typing as npt
import viser

from gcs.desk import Desk, Details, Intent
from gcs.view.colours import BRAND
from gcs.view.pointing import ground_under, side_by_side
from gcs.view.presses import Presses, tell

Array = npt.NDArray[np.float64]

AIM_S = 8.0
LEAST_SPACING_M = 1.0


class Aiming:
    """One click at a time in each browser: armed by the button, it is over with the next click.

    Args:
        desk: what is commanded.
        presses: hands intents over.
        selected: whom the order concerns.
        ground_height_m: of the ground below (n, 2) places.
        far_m: how far off a click may be.
        height_m: above the ground of the place that is pointed at.
    """

    def __init__(
        self,
        desk: Desk,
        presses: Presses,
        selected: Callable[[], Iterable[int]],
        ground_height_m: Callable[[Array], Array],
        far_m: Callable[[], float],
        height_m: Callable[[], float],
    ) -> None:
        self._desk, self._presses = desk, presses
        self._selected, self._ground_height_m = selected, ground_height_m
        self._far_m, self._height_m = far_m, height_m

    def begin(self, client: viser.ClientHandle) -> None:
        """The next click of this browser in the scene is the place; called in a thread of viser.

        The click is awaited before the browser is told to click, and on the same connection: what it says then holds.
        """

        def click(event: viser.SceneClickEvent) -> None:
            stop_listening()
            self._go(event.client, np.array(event.ray_origin), np.array(event.ray_direction))

        # what such a callback returns is left open by viser
        stop_listening = cast(Callable[[], None], client.scene.remove_click_callback)  # pyright: ignore[reportUnknownMemberType]
        stop_listening()
        client.scene.on_click()(click)
        client.add_notification(
            "Click at the place", "The selected vehicles fly there and hold.", auto_close_seconds=AIM_S, color=BRAND
        )

    def _go(self, client: viser.ClientHandle, origin_m: Array, direction: Array) -> None:
        place_m = ground_under(origin_m, direction, self._ground_height_m, self._far_m())
        if place_m is None:
            tell(client, "Go to is not possible", "there is no ground at that place")
            return
        chosen = sorted(self._selected())
        for sysid, goal_m in zip(chosen, side_by_side(place_m, len(chosen), self._spacing_m()), strict=True):
            east_m, north_m = float(goal_m[0]), float(goal_m[1])
            up_m = float(self._ground_height_m(goal_m[None, :2])[0]) + self._height_m()
            self._presses.ask(Intent.GO_TO, client, Details(place_m=(east_m, north_m, up_m)), [sysid])

    def _spacing_m(self) -> float:
        mission = self._desk.mission
        return max(mission.limits.separation_m, LEAST_SPACING_M) if mission is not None else LEAST_SPACING_M
