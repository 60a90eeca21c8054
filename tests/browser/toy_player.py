"""A recording's player that only remembers what was asked of it."""


class ToyPlayer:
    """One minute of nothing."""

    def __init__(self) -> None:
        self.speed, self.duration_s, self.position_s, self.playing = 1.0, 60.0, 0.0, False
        self.sought: list[float] = []

    def play(self) -> None:
        self.playing = True

    def pause(self) -> None:
        self.playing = False

    def set_speed(self, speed: float) -> None:
        self.speed = speed

    def seek(self, position_s: float) -> None:
        self.sought.append(position_s)
        self.position_s = position_s
