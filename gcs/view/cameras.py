"""The browsers' cameras: the whole world at first, a view from above, or along with a vehicle."""

import numpy as np
import numpy.typing as npt
import viser

from gcs.view.framing import FOV_RAD, FROM_ABOVE, FROM_SOUTH_WEST, Margins, Pose, frame_box
from gcs.view.sightings import Sighting, Sightings

Array = npt.NDArray[np.float64]

FIRST_ASPECT = 1.35
"""Of a picture that is not known yet: rather too narrow than too wide."""
NEAR_M, FAR_SIZES = 0.05, 12.0
FOLLOW_M = 9.0
"""Distance at which a vehicle is followed, at first; then the operator's own."""
FOLLOW_TOWARDS = np.array([-0.75, -0.45, 0.5])
SIDE_SHARE, TOP_SHARE = 0.03, 0.08
FIRST_HEIGHT_PX = 780
TABLE_HEAD_PX, TABLE_ROW_PX = 100, 27
MOST_TABLE_SHARE = 0.38
"""Of the picture's height: the fleet table lies over its bottom."""


class Cameras:
    """All browsers' cameras.

    Args:
        server: of the page.
        low_m: (3,) lowest corner of what is framed.
        high_m: (3,) highest corner.
        vehicles: how many rows the fleet table will have.
    """

    def __init__(self, server: viser.ViserServer, low_m: Array, high_m: Array, vehicles: int) -> None:
        self._server, self._vehicles = server, vehicles
        self._followed: dict[int, int] = {}
        self.frame(low_m, high_m)

    def frame(self, low_m: Array, high_m: Array) -> None:
        """What `overview` and `from_above` show from now on, and browsers at first: a box by (3,) ENU corners."""
        self._low_m, self._high_m = low_m, high_m
        first = self._framed(FROM_SOUTH_WEST, FIRST_ASPECT, FIRST_HEIGHT_PX)
        camera = self._server.initial_camera
        camera.position, camera.look_at = first.position_m, first.look_at_m
        camera.fov, camera.near = FOV_RAD, NEAR_M
        camera.far = FAR_SIZES * float(np.linalg.norm(high_m - low_m))

    def overview(self, client: viser.ClientHandle) -> None:
        self._go(client, FROM_SOUTH_WEST)

    def from_above(self, client: viser.ClientHandle) -> None:
        self._go(client, FROM_ABOVE)

    def follow(self, client: viser.ClientHandle, vehicle: Sighting) -> None:
        """Go along with a vehicle; the operator still turns and zooms."""
        self._followed[client.client_id] = vehicle.sysid
        towards = FOLLOW_TOWARDS / np.linalg.norm(FOLLOW_TOWARDS)
        self._place(client, Pose(vehicle.position_m + FOLLOW_M * towards, vehicle.position_m))

    def move(self, seen: Sightings) -> None:
        """Take the cameras that follow a vehicle along with it."""
        if not self._followed:
            return
        places = {sighting.sysid: sighting.position_m for sighting in seen}
        clients = self._server.get_clients()
        for client_id, sysid in list(self._followed.items()):
            if client_id not in clients:
                del self._followed[client_id]
            elif sysid in places:
                camera = clients[client_id].camera
                offset_m = camera.position - camera.look_at
                self._place(clients[client_id], Pose(places[sysid] + offset_m, places[sysid]))

    def _go(self, client: viser.ClientHandle, towards_camera: Array) -> None:
        self._followed.pop(client.client_id, None)
        height_px = max(client.camera.image_height, 1)
        self._place(client, self._framed(towards_camera, client.camera.image_width / height_px, height_px))

    def _framed(self, towards_camera: Array, aspect: float, height_px: int) -> Pose:
        bottom = min((TABLE_HEAD_PX + TABLE_ROW_PX * self._vehicles) / height_px, MOST_TABLE_SHARE)
        margins = Margins(SIDE_SHARE, TOP_SHARE, bottom)
        return frame_box(self._low_m, self._high_m, towards_camera, aspect, margins)

    @staticmethod
    def _place(client: viser.ClientHandle, pose: Pose) -> None:
        with client.atomic():
            client.camera.up_direction = (0.0, 0.0, 1.0)
            client.camera.position = pose.position_m
            client.camera.look_at = pose.look_at_m
