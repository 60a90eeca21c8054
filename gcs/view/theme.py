"""What the scene looks like on a dark and on a light page. Vehicles have the same colours on both."""

from dataclasses import dataclass

from gcs.view.colours import Rgb, faded

AHEAD_SHARE, BEHIND_SHARE, PLANNED_SHARE = 0.2, 0.2, 0.35
"""How far the lines of a vehicle are from its own colour ..."""
BEHIND_SHARE_OF_MANY, PLANNED_SHARE_OF_MANY = 0.45, 0.8
"""... and in a large fleet, where they would hide everything."""


@dataclass(frozen=True)
class Theme:
    """The colours of the things of the world; those of words and panels are in `page.css`."""

    dark: bool
    ground: Rgb
    grid: Rgb
    grid_main: Rgb
    bounds: Rgb
    fence: Rgb
    obstacle: Rgb
    obstacle_edge: Rgb
    writing: Rgb
    valley: Rgb
    """Of the terrain where it is lowest ..."""
    slope: Rgb
    summit: Rgb
    """... and where it is highest."""
    contour: Rgb
    airframe: Rgb
    sky: Rgb
    """Light from above, and from the ground below."""
    soil: Rgb
    sun: float
    ahead: Rgb
    """What the line ahead of a vehicle tends to ..."""
    shade: Rgb
    """... and the lines behind it and of its plan."""
    observed: Rgb

    def line_ahead(self, vehicle: Rgb) -> Rgb:
        """Of what a vehicle of this colour flies next."""
        return faded(vehicle, self.ahead, AHEAD_SHARE)

    def line_behind(self, vehicle: Rgb, *, many: bool) -> Rgb:
        """Of what it has flown, as one of many or of a few."""
        return faded(vehicle, self.shade, BEHIND_SHARE_OF_MANY if many else BEHIND_SHARE)

    def line_planned(self, vehicle: Rgb, *, many: bool) -> Rgb:
        """Of what the cloud has planned for it, as one of many or of a few."""
        return faded(vehicle, self.shade, PLANNED_SHARE_OF_MANY if many else PLANNED_SHARE)


DARK = Theme(
    dark=True,
    ground=(58, 68, 86),
    grid=(66, 78, 96),
    grid_main=(92, 108, 130),
    bounds=(110, 140, 180),
    fence=(214, 168, 80),
    obstacle=(122, 136, 158),
    obstacle_edge=(184, 198, 220),
    writing=(150, 172, 204),
    valley=(52, 76, 78),
    slope=(112, 122, 96),
    summit=(206, 200, 184),
    contour=(152, 170, 168),
    airframe=(205, 214, 226),
    sky=(214, 226, 255),
    soil=(60, 62, 74),
    sun=2.0,
    ahead=(255, 255, 255),
    shade=(58, 68, 86),
    observed=(255, 120, 214),
)

LIGHT = Theme(
    dark=False,
    ground=(206, 212, 220),
    grid=(178, 188, 200),
    grid_main=(140, 152, 168),
    bounds=(92, 112, 140),
    fence=(176, 116, 20),
    obstacle=(150, 160, 176),
    obstacle_edge=(70, 84, 104),
    writing=(66, 84, 110),
    valley=(172, 192, 164),
    slope=(206, 196, 160),
    summit=(240, 236, 228),
    contour=(120, 118, 92),
    airframe=(72, 80, 92),
    sky=(255, 255, 255),
    soil=(150, 150, 150),
    sun=1.6,
    ahead=(0, 0, 0),
    shade=(20, 30, 50),
    observed=(176, 24, 124),
)
