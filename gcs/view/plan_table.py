"""What each algorithm has made of the mission, side by side, as HTML; pure."""

from collections.abc import Mapping
from html import escape

from gcs.planner.plan import FleetPlan
from gcs.view.mission_card import chart

HEADINGS = ("Algorithm", "Objective", "Verdict", "Evaluations", "Time", "Course")


def render(candidates: Mapping[str, FleetPlan], flown: FleetPlan | None) -> str:
    """One row per algorithm, the best feasible plan first; the one that is flown is marked."""
    if not candidates:
        return _framed("<p>No plan yet: Plan makes one, Compare one by each algorithm.</p>")
    ranked = sorted(candidates.values(), key=lambda plan: (not plan.feasible, plan.objective))
    head = "".join(f"<th>{heading}</th>" for heading in HEADINGS)
    body = "".join(_row(plan, plan is flown) for plan in ranked)
    return _framed(f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>")


def _framed(contents: str) -> str:
    return f'<section class="gcs-fleet gcs-plans">{contents}</section>'


def _row(plan: FleetPlan, flown: bool) -> str:
    verdict = '<i class="good">feasible</i>' if plan.feasible else '<i class="warn">not feasible</i>'
    wrong = "; ".join(str(violation) for violation in plan.violations)
    mark = ' <i class="info">in use</i>' if flown else ""
    cells = (
        f'<td class="name">{escape(plan.algorithm)}{mark}</td>',
        f"<td>{plan.objective:.1f}</td>",
        f'<td title="{escape(wrong)}">{verdict}</td>',
        f"<td>{plan.evaluations}</td>",
        f"<td>{plan.wall_s:.2f}<small> s</small></td>",
        f'<td class="course">{chart([step.objective for step in plan.convergence])}</td>',
    )
    return f"<tr{' class=selected' if flown else ''}>{''.join(cells)}</tr>"
