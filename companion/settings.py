"""How a companion flies, beyond what the mission says; one dataclass per part."""

from dataclasses import dataclass, field
from enum import Enum

from missions.mission import SensorKind


class PlanningMode(Enum):
    """Who plans, as chosen at the ground station."""

    END_CLOUD = "end-cloud"
    """The cloud's track points, and a local plan between them."""
    ONBOARD = "onboard"
    """The mission holds the target alone."""


@dataclass(frozen=True)
class Reserve:
    """How much of the mission's limits a plan uses: the rest is for tracking errors and noise."""

    nominal_share: float = 0.9
    """Speed that is aimed at, as a share of the limit."""
    limit_share: float = 0.93
    """No plan is faster than this share of the limit."""
    distance_share: float = 0.15
    """Required clearance and avoidance distance are planned larger by this share ..."""
    gnss_margin_m: float = 1.0
    """... and outdoors by this at least: about three standard deviations of a good position fix."""
    braking_share: float = 0.85
    """Acceleration along the path that speeds are laid out with, as a share of the limit."""
    jerk_per_acceleration_hz: float = 4.0
    """Highest jerk, as a multiple of the highest acceleration."""
    corridor_share: float = 0.03
    """Half width of the corridor around the track, as a share of the horizon."""


@dataclass(frozen=True)
class SearchSettings:
    """The multi-objective particle swarm and its tabu search; every part of the paper's method can be switched off."""

    control_points: int = 12
    """Of one local trajectory: three hold the start, three the end at rest, the others are free."""
    particles: int = 20
    iterations: int = 5
    stall_generations: int = 2
    """A search ends early when so many generations have found nothing better."""
    archive_size: int = 24
    patience_generations: int = 3
    """k of the leader rule."""
    weighted_dominance: bool = True
    """Off: Pareto dominance alone."""
    adaptive_leader: bool = True
    """Off: the leader is a random entry of the archive."""
    tabu_neighbours: int = 6
    """Size of the random neighbourhood subset; 0 switches the tabu search off."""
    tabu_length: int = 8


@dataclass(frozen=True)
class PilotSettings:
    """When the pilot does what; vehicle time unless said."""

    tick_s: float = 0.02
    """While setpoints are streamed, or soon will be."""
    resting_tick_s: float = 0.1
    """While nothing is flown: what is heard is taken in at once all the same."""
    status_interval_s: float = 0.2
    report_interval_s: float = 0.2
    """Between two looks at the map for what the ground does not know of yet."""
    replan_age_s: float = 1.0
    """A committed trajectory is replaced when it is this old."""
    retry_s: float = 0.3
    """Between a failed plan and the next attempt ..."""
    conflict_retry_s: float = 0.1
    """... where the committed trajectory meets something, or leads elsewhere than the newest order."""
    planning_allowance_wall_s: float = 0.06
    """A plan begins this much in the future: search and thread switches fit in (wall clock)."""
    lateness_wall_s: float = 0.06
    """A plan that arrives later than it begins is still taken up to this (wall clock)."""
    setpoint_lead_s: float = 0.03
    """Setpoints are sent so much ahead of time: for their way, and because each is used until the next one."""
    response_lead_s: float = 0.12
    """Velocity and acceleration are sent so much earlier still: a multirotor has to tilt before it accelerates."""
    standing_m_s: float = 0.7
    """Slower than this a vehicle stands: GNSS-grade estimates wander at 0.3 m/s."""
    standing_timeout_s: float = 8.0
    offboard_timeout_s: float = 3.0
    command_retry_s: float = 1.0
    start_guard_s: float = 1.0
    """A copy of MISSION_START that was on its way when a pilot took control does not take it back."""
    odometry_timeout_s: float = 1.0
    """Without odometry for so long the vehicle is braked."""
    arrived_m_s: float = 0.5
    """Faster than this a vehicle at its target has not arrived yet."""
    arrival_timeout_s: float = 5.0
    """At the end of the last trajectory, the vehicle is given so long to settle."""
    yaw_rate_rad_s: float = 0.8
    yaw_above_m_s: float = 0.4
    """Slower than this the heading is kept."""


@dataclass(frozen=True)
class CompanionSettings:
    """One companion's settings, as the command line gives them."""

    vehicle: int
    system_url: str
    speed: float = 1.0
    mode: PlanningMode = PlanningMode.END_CLOUD
    seed: int = 0
    sensor: SensorKind = SensorKind.LIDAR
    lidar_address: str = "127.0.0.1:56300"
    """HOST:PORT at which the lidar's packets come in."""
    fleet_link: str = "udpout://127.0.0.1:14980"
    """Where the other companions are reached."""
    fleet_port: int = 14700
    """Bound for a relay."""
    deadman_s: float = 0.5
    report_bytes_s: float = 3300.0
    """Of the link, for what was seen [bytes/s of vehicle time]; with status and trajectories it makes 4 kB/s."""
    reserve: Reserve = field(default_factory=Reserve)
    search: SearchSettings = field(default_factory=SearchSettings)
    pilot: PilotSettings = field(default_factory=PilotSettings)
