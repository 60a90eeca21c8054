"""The soak as an experiment: a row per seed, a summary of what went wrong and what came of it."""

import gc
import hashlib
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from gcs.experiments.experiment import Experiment, Row, Run, product
from gcs.experiments.markdown import table
from gcs.flight.report import FlightReport
from tests.simulation.whole_system import WholeSystem
from tests.soak.invariants import violations
from tests.soak.scenario import Scenario, draw
from tests.soak.troubled_system import TroubledSystem


def fly(scenario: Scenario, seed: int) -> tuple[TroubledSystem, FlightReport, Row]:
    """One flight, its report, and its row."""
    system = TroubledSystem(
        scenario.mission,
        scenario.mode,
        seed=seed,
        faults=scenario.companion_faults,
        truth_mission=scenario.truth,
        mishaps=scenario.mishaps,
    )
    report = system.fly()
    broken = violations(scenario, system, report)
    return (
        system,
        report,
        {
            "story": scenario.story,
            "violations": " | ".join(broken),
            "success": report.success,
            "reason": report.reason,
            "simulated_s": round(system.simulator.time_s, 2),
            "fingerprint": fingerprint(system),
        },
    )


def fingerprint(system: WholeSystem) -> str:
    """Of every position and velocity: two runs of a seed are the same flight, to the bit."""
    digest = hashlib.sha256()
    for _, positions_m, velocities_m_s in system.truth:
        digest.update(positions_m.tobytes())
        digest.update(velocities_m_s.tobytes())
    return digest.hexdigest()[:12]


def runs(seeds: Sequence[int]) -> list[Run]:
    """One per seed."""
    return product(seed=list(seeds))


def work(run: Run) -> Row:
    """Fly one seed; a defect that raises is a violation, too."""
    seed = run.number("seed")
    scenario = draw(seed)
    try:
        with _collected_before():
            return fly(scenario, seed)[-1]
    except Exception as defect:
        raised = f"raised {_innermost(defect)}"
        nothing: Row = {"success": False, "reason": "", "simulated_s": 0.0, "fingerprint": ""}
        return {"story": scenario.story, "violations": raised, **nothing}


@contextmanager
def _collected_before() -> Iterator[None]:
    """Free what the flight before has left, and look for nothing during this one: it makes few cycles, many objects."""
    gc.collect()
    if not gc.get_freeze_count():
        gc.freeze()
    enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if enabled:
            gc.enable()


def _innermost(defect: BaseException) -> str:
    while isinstance(defect, BaseExceptionGroup):
        defect = defect.exceptions[0]
    return f"{type(defect).__name__}: {defect}"


def summary(rows: Sequence[Row]) -> str:
    """How many flights had which fault, arrived, and broke an invariant; then every violation with its seed."""
    kinds: dict[str, list[Row]] = {"all": list(rows)}
    for row in rows:
        for kind in {part.split()[0] for part in str(row["story"]).split("; ")}:
            kinds.setdefault(kind, []).append(row)
    lines = [
        [kind, str(len(of_kind)), str(sum(bool(row["success"]) for row in of_kind)), str(_broken(of_kind))]
        for kind, of_kind in sorted(kinds.items(), key=lambda item: (item[0] != "all", item[0]))
    ]
    broken = [f"* seed {row['seed']}: {row['violations']} ({row['story']})" for row in rows if row["violations"]]
    reasons = Counter(str(row["reason"]).split(": ", 1)[-1][:60] for row in rows if not row["success"])
    ended = [[reason, str(count)] for reason, count in reasons.most_common(20)]
    return "\n".join(
        [
            table(["what goes wrong", "flights", "arrived", "violations"], lines),
            "",
            *(broken or ["No invariant was violated."]),
            "",
            "Flights that did not arrive, by what their report says of the first vehicle:",
            "",
            table(["reason", "flights"], ended),
        ]
    )


def _broken(rows: Sequence[Row]) -> int:
    return sum(bool(row["violations"]) for row in rows)


def no_figures(rows: Sequence[Row], directory: Path) -> list[str]:
    """Pictures are drawn of single flights, by `--replay`."""
    return []


SOAK = Experiment(
    name="soak",
    title="Seeded flights with everything going wrong",
    default_runs=100,
    key=("seed",),
    values=("story", "violations", "success", "reason", "simulated_s", "fingerprint"),
    runs=runs,
    work=work,
    figures=no_figures,
    summary=summary,
)
