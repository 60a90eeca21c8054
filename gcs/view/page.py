"""One desk's page: what stands in the scene and in the panels, and how often each is brought up to date."""

import asyncio
import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt
import viser

from gcs.desk import Desk, Details, Intent
from gcs.desk.intents import NewMission
from gcs.view import legend, words
from gcs.view.aiming import Aiming
from gcs.view.browser import Browser
from gcs.view.browsers import Browsers
from gcs.view.cameras import Cameras
from gcs.view.colours import BRAND, TARGET, Tone
from gcs.view.editing_panel import EditingPanel
from gcs.view.motion_scene import MotionScene
from gcs.view.observed_scene import ObservedScene
from gcs.view.overlay import FEW, Tag
from gcs.view.panels import Panels, Press
from gcs.view.plan_scene import PlanScene
from gcs.view.replay_panel import ReplayPanel
from gcs.view.seating import Seating
from gcs.view.sightings import Sighting, Sightings, sightings, vehicle_colours, vehicle_order
from gcs.view.theme import DARK, LIGHT, Theme
from gcs.view.vehicle_scene import MANY, least_span_px
from gcs.view.world_scene import OnPick, WorldScene, diagonal_m
from missions.mission import Mission
from missions.mission_file import to_yaml

Array = npt.NDArray[np.float64]

TITLE = "End-cloud GCS"
TELL_INTERVAL_S = 0.25
"""Panels and signs change this often, those of large fleets a part at every update; what moves, at every update."""

WATCHED_M = np.array([[-30.0, -30.0, 0.0], [30.0, 30.0, 15.0]])
"""What is framed where there is no mission, around where the first vehicle has its home."""
AROUND_M = np.array([10.0, 10.0, 3.0])
"""How much around the vehicles of a fleet without a mission is framed."""
FAR_SIZES = 12.0
"""How many times the size of the world a click may be off."""
TARGET_PX = 14.0
VEHICLE_FLATNESS = 0.6
"""A quadrotor is less high than wide in a picture from above."""
SELECTED, WARNING, ALARM = 1, 2, 3
"""How urgent a tag is."""
LOOKS = {Tone.BAD: (ALARM, "vehicle bad"), Tone.WARN: (WARNING, "vehicle warn")}
TRAIL_SPACING_SHARE, TRAIL_TOLERANCE_SHARE = 1 / 2000, 1 / 1000
"""Of the size of the world: what is not seen of trails where all of it is in the picture."""
POINT_SHARE = 1 / 350
LEAST_TRAIL_SPACING_M = 0.05


class Page:
    """The page of one desk. All calls come on the event loop's thread.

    Args:
        server: an open viser server; the page fills it.
        desk: what is shown and commanded.
    """

    def __init__(self, server: viser.ViserServer, desk: Desk) -> None:
        self._server, self._desk, self._loop = server, desk, asyncio.get_running_loop()
        self._next_tell_s, self._updates = -np.inf, 0
        self._seen = Sightings()
        self._tags: list[Tag] = []
        self._theme = DARK
        server.gui.set_panel_label(TITLE)
        self._draw_scene()
        self._panels = Panels(server, desk, lambda client: self._aiming.begin(client), self._views())
        self._aiming = Aiming(
            desk,
            self._panels.presses,
            lambda: self._panels.selected,
            self._ground_height_m,
            lambda: FAR_SIZES * self._size_m,
            lambda: self._panels.go_to_height_m,
        )
        self._seating = Seating(server, desk.seat)
        if desk.mission is not None:
            self._panels.suit(desk.mission)
        self._replay = ReplayPanel(server.gui, desk.player) if desk.player is not None else None
        self._editing: EditingPanel | None = None
        if self._world is not None and desk.mission is not None and desk.player is None:
            self._editing = EditingPanel(server, desk.mission, self._show_draft, self._load_draft)
        self._browsers = Browsers(server, self._greet)
        self._use(DARK)

    def update(self, now_s: float) -> None:
        """Bring the page up to date; what is shown has the station's clock, which in a recording can be moved."""
        if self._replay is not None:
            self._replay.update()
        shown_s = self._desk.station.now_s
        if self._desk.mission is not self._mission and self._is_another(self._desk.mission):
            self._show_another()
        fleet_before = len(self._seen)
        self._seen = sightings(self._desk)
        if len(self._seen) > fleet_before:
            self._frame_fleet()
        self._updates += 1
        few, even = len(self._seen) <= MANY, self._updates % 2 == 0
        with self._server.atomic():  # around everything: what it sends is packed by another thread, from its end on
            self._motion.update(self._desk, self._seen, shown_s, lines=few or even)
            self._cameras.move(self._seen)
            self._tell(now_s, shown_s)
            places_m = np.concatenate((self._seen.positions_m, self._targets_m))
            tags = self._tags if len(self._tags) == len(places_m) else []
            self._browsers.update(self._seen, tags, places_m[: len(tags)], overlay=few or not even)

    def _tell(self, now_s: float, shown_s: float) -> None:
        """Bring up to date what is read, not watched, if it is time to: of a large fleet a part, so that none waits."""
        parts = (self._look_around, self._tag, *self._panels.parts)
        if len(self._seen) > MANY and self._tags:
            parts[self._updates % len(parts)](self._seen, shown_s)
        elif now_s >= self._next_tell_s:
            self._next_tell_s = now_s + TELL_INTERVAL_S
            for part in parts:
                part(self._seen, shown_s)

    def _look_around(self, _: Sightings, now_s: float) -> None:
        """See what has come of vehicles, browsers, plan and map."""
        self._desk.observe(now_s)
        self._seating.update()
        self._show_plan()
        self._observed.update(self._desk.station.fleet.observed, now_s)

    def _tag(self, seen: Sightings, now_s: float) -> None:
        """Write the name tags anew."""
        picked, span_px = self._panels.picked_out, least_span_px(len(seen)) * VEHICLE_FLATNESS
        brief = len(seen) > FEW
        vehicles = [_vehicle_tag(one, now_s, span_px, selected=one.state.sysid in picked, brief=brief) for one in seen]
        self._tags = [*vehicles, *self._target_tags()]

    def _is_another(self, mission: Mission | None) -> bool:
        """Whether a mission is drawn elsewise than the one that is shown; a moved origin changes nothing."""
        shown, self._mission = self._mission, mission
        return shown is None or mission is None or mission.moved_to(shown.origin) != shown

    def _show_another(self) -> None:
        """Another mission has been loaded."""
        self._server.scene.reset()
        theme, self._theme = self._theme, DARK
        self._draw_scene()
        self._use(theme)
        self._browsers.explain(self._legend())
        if self._mission is not None:
            self._panels.suit(self._mission)
            if self._editing is not None:
                self._editing.take(self._mission)
        for client in self._server.get_clients().values():
            client.camera.far = self._server.initial_camera.far
            self._cameras.overview(client)

    def _draw_scene(self) -> None:
        """Everything of the scene that all browsers share, dark."""
        scene = self._server.scene
        self._mission = self._desk.mission
        self._world: WorldScene | None = None
        self._targets_m = np.zeros((0, 3))
        self._size_m = self._draw_surroundings()
        self._plan = PlanScene(scene, self._size_m * POINT_SHARE)
        self._observed = ObservedScene(scene)
        spacing_m = max(LEAST_TRAIL_SPACING_M, self._size_m * TRAIL_SPACING_SHARE)
        tolerance_m = max(spacing_m / 2, self._size_m * TRAIL_TOLERANCE_SHARE)
        self._motion = MotionScene(scene, spacing_m, tolerance_m, self._ground_height_m)

    def _legend(self) -> str:
        return legend.render(self._desk.mission, self._theme, simulated=self._desk.simulated)

    def _greet(self, client: viser.ClientHandle) -> Browser:
        return Browser(client, self._pick, self._theme, self._legend())

    def _use(self, theme: Theme) -> None:
        """Draw everything dark or light from now on, in all browsers."""
        if theme is not self._theme and self._world is not None:
            self._world.draw(theme)
        self._theme = theme
        gui = self._server.gui
        gui.configure_theme(dark_mode=theme.dark, show_logo=False, show_share_button=False, brand_color=BRAND)
        _light(self._server.scene, theme)
        if self._world is None:
            _draw_plain(self._server.scene, theme)
        for drawn in (self._motion, self._plan, self._observed):
            drawn.use(theme)
        self._browsers.use(theme)

    def _show_draft(self, mission: Mission, on_pick: OnPick | None) -> None:
        """Draw a mission that is being edited, or the one that was loaded again."""
        assert self._world is not None
        self._world.show(mission, on_pick)
        self._targets_m = np.array([target.position_m for target in mission.targets]).reshape(-1, 3)

    def _load_draft(self, draft: Mission, client: viser.ClientHandle) -> None:
        """Ask for a draft to be loaded as if it were a file."""
        name = f"{draft.name}.yaml"
        self._panels.presses.ask(
            Intent.LOAD, client, Details(new=NewMission(draft, name, to_yaml(draft).encode())), sysids=()
        )

    def _pick(self, sysid: int, joins: bool) -> None:
        """A vehicle was clicked; called in a thread of viser."""
        self._loop.call_soon_threadsafe(self._panels.pick, sysid, joins)

    def _target_tags(self) -> list[Tag]:
        targets = self._desk.mission.targets if self._desk.mission is not None else ()
        return [Tag(f"target {target.name}", target.name, "", TARGET, TARGET_PX, -1, "target") for target in targets]

    def _draw_surroundings(self) -> float:
        """The world, or where there is no mission a plain; how large it is [m]."""
        mission = self._desk.mission
        if mission is None:
            self._cameras = Cameras(self._server, WATCHED_M[0], WATCHED_M[1], 1)
            return float(np.linalg.norm(WATCHED_M[1] - WATCHED_M[0]))
        self._targets_m = np.array([target.position_m for target in mission.targets]).reshape(-1, 3)
        self._world = WorldScene(self._server, mission, simulated=self._desk.simulated)
        bounds, beyond_m = mission.world.bounds, mission.site.fence_margin_m * np.array([1.0, 1.0, 0.0])
        low_m, high_m = bounds.low_enu_m - beyond_m, bounds.high_enu_m + beyond_m
        self._cameras = Cameras(self._server, low_m, high_m, len(mission.vehicles))
        return diagonal_m(bounds)

    def _show_plan(self) -> None:
        flight = self._desk.flight
        if flight is None or flight.plan is None or self._world is None:
            return
        by_sysid = vehicle_colours(vehicle_order(self._desk))
        if self._plan.show(flight.plan, by_sysid):
            parts = flight.plan.vehicles
            self._world.colour_targets({t.name: by_sysid[part.sysid] for part in parts for t in part.targets})

    def _ground_height_m(self, places_m: Array) -> Array:
        return self._world.ground_height_m(places_m) if self._world is not None else np.zeros(len(places_m))

    def _views(self) -> dict[str, tuple[viser.IconName, Press]]:
        return {
            "Overview": (viser.Icon.CUBE, self._view(self._overview)),
            "Top": (viser.Icon.MAP_2, self._view(self._from_above)),
            "Follow": (viser.Icon.FOCUS_2, self._view(self._follow)),
            "Light": (viser.Icon.SUN, self._view(lambda _: self._use(LIGHT))),
            "Dark": (viser.Icon.MOON, self._view(lambda _: self._use(DARK))),
        }

    def _view(self, act: Callable[[viser.ClientHandle], None]) -> Press:
        def press(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            client = event.client
            if client is not None:
                self._loop.call_soon_threadsafe(act, client)

        return press

    def _overview(self, client: viser.ClientHandle) -> None:
        self._frame_fleet()
        self._cameras.overview(client)

    def _from_above(self, client: viser.ClientHandle) -> None:
        self._frame_fleet()
        self._cameras.from_above(client)

    def _frame_fleet(self) -> None:
        """Without a mission, what is framed is where the vehicles are."""
        if self._world is None and self._seen:
            places_m = self._seen.positions_m
            self._cameras.frame(places_m.min(axis=0) - AROUND_M, places_m.max(axis=0) + AROUND_M)

    def _follow(self, client: viser.ClientHandle) -> None:
        """Follow the selected vehicle, or the first one."""
        chosen = [sighting for sighting in self._seen if sighting.sysid in self._panels.picked_out]
        if self._seen:
            self._cameras.follow(client, (chosen or self._seen)[0])


def _vehicle_tag(sighting: Sighting, now_s: float, span_px: float, *, selected: bool, brief: bool) -> Tag:
    """Name, mode, battery and height of a vehicle; those with something wrong stand out, and if brief tell it alone."""
    state, colour = sighting.state, sighting.colour
    mode, tone = words.mode_words(state, now_s)
    if words.battery_tone(state.battery_percent) is Tone.BAD:
        tone = Tone.BAD
    urgency, look = LOOKS.get(tone, (SELECTED if selected else 0, "vehicle"))
    details = "" if brief and not urgency else _details(sighting, mode)
    return Tag(f"vehicle {state.sysid}", sighting.name, details, colour, span_px, urgency, look, selected)


def _details(sighting: Sighting, mode: str) -> str:
    percent = sighting.state.battery_percent
    battery = f"{percent:.0f} %" if math.isfinite(percent) else ""
    return " · ".join(filter(None, (mode, battery, f"{words.number_words(sighting.position_m[2])} m")))


def _draw_plain(scene: viser.SceneApi, theme: Theme) -> None:
    scene.add_grid(
        "/world/plain",
        infinite_grid=True,
        cell_size=5.0,
        section_size=25.0,
        cell_color=theme.grid,
        section_color=theme.grid_main,
        fade_distance=250.0,
    )


def _light(scene: viser.SceneApi, theme: Theme) -> None:
    """Daylight from the south-west, and enough of the sky to see into the shade; no shadows, which cost most."""
    scene.configure_default_lights(enabled=False)
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/light/sky", sky_color=theme.sky, ground_color=theme.soil, intensity=1.5)
    scene.add_light_directional("/light/sun", color=(255, 246, 232), intensity=theme.sun, position=(-3.0, -5.0, 8.0))
