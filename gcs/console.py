"""What a terminal shows of a flight or a plan: progress and events, plain lines where it is no terminal."""

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from gcs.flight.events import BEGAN, Event, Severity
from gcs.planner.plan import FleetPlan
from gcs.planner.plan import Progress as PlanProgress

STYLES = {Severity.INFO: "", Severity.WARNING: "yellow", Severity.ERROR: "bold red"}
QUIET_KINDS = {BEGAN, "command"}
"""Events that go to the log alone."""


class FlightConsole:
    """Prints events as they come."""

    def __init__(self, console: Console | None = None) -> None:
        self.console = console or Console(highlight=False, soft_wrap=True)

    def show(self, event: Event) -> None:
        if event.kind in QUIET_KINDS:
            return
        who = f"{event.vehicle}: " if event.vehicle else ""
        self.console.print(f"{event.t_s:7.1f} s  {who}{event.text}", style=STYLES[event.severity], markup=False)

    def say(self, text: str, style: str = "") -> None:
        self.console.print(text, style=style, markup=False)


class PlanConsole:
    """A progress bar for the planner; on no terminal, a line at each quarter of the work."""

    def __init__(self, console: Console) -> None:
        self._console = console
        self._last_quarter = 0
        columns = (
            TextColumn("planning"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f}%  best {task.fields[best]}"),
            TimeElapsedColumn(),
        )
        self._bar = Progress(*columns, console=console, transient=True) if console.is_terminal else None
        self._task = self._bar.add_task("planning", total=1.0, best="-") if self._bar else None

    def show(self, progress: PlanProgress) -> None:
        best = f"{progress.objective:.2f}" + ("" if progress.feasible else " (not feasible yet)")
        if self._bar is not None and self._task is not None:
            self._bar.update(self._task, completed=progress.share_done, best=best)
            return
        quarter = int(progress.share_done * 4)
        if quarter > self._last_quarter:
            self._last_quarter = quarter
            self._console.print(f"planning {quarter * 25:3d} %, best {best}", markup=False)

    def __enter__(self) -> "PlanConsole":
        if self._bar is not None:
            self._bar.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.stop()


def print_plan(console: Console, plan: FleetPlan) -> None:
    """A table of a plan, and what is wrong with it if it is not feasible."""
    table = Table(box=None, pad_edge=False)
    for title in ("vehicle", "target", "length", "time", "track points"):
        table.add_column(title, justify="left" if title in {"vehicle", "target"} else "right")
    for part in plan.vehicles:
        duration_s = part.times_s[-1] if len(part.times_s) else 0.0
        cells = (f"{part.length_m:.1f} m", f"{duration_s:.1f} s", str(len(part.track.points_m)))
        table.add_row(part.name, ", ".join(target.name for target in part.targets), *cells)
    console.print(table)
    if plan.staying:
        console.print(f"no target, and so on its pad: {', '.join(plan.staying)}", markup=False)
    verdict = "feasible" if plan.feasible else "NOT feasible"
    effort = f"{plan.evaluations} evaluations, {plan.wall_s:.2f} s"
    console.print(f"{verdict}, objective {plan.objective:.2f}, {plan.algorithm} seed {plan.seed}, {effort}")
    for violation in plan.violations:
        console.print(f"  {violation}", markup=False)
