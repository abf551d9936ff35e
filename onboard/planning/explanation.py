"""Explanation of a plan as a product: the decision, and the score of each candidate place."""

from __future__ import annotations

from onboard.config import Mission
from onboard.planning.plan_records import PlanResult
from protocol.conventions import cut
from protocol.products.nsp import MOST_TEXT_BYTES, Candidate, Explanation


def explain(result: PlanResult, mission: Mission) -> Explanation:
    """The decision and, if the strategy scored places, the best of them and its alternatives with their terms."""
    decision, found = result.decision, result.report.next_position
    end_x, end_y, _ = (float(part) for part in decision.path.stations[-1])
    choices = () if found is None or found.best is None else (found.best, *found.alternatives)
    places = tuple(
        Candidate(
            *c.cell,
            c.x_m,
            c.y_m,
            c.heading_rad,
            c.score,
            c.gain_term,
            c.distance_term,
            c.visibility,
            c.new_cells,
            c.cost_m,
        )
        for c in choices
    )
    pose, grid = result.pose, result.report.grid
    return Explanation(
        stop=result.state.number,
        pose=(pose.x_m, pose.y_m, pose.yaw_rad),
        goal_m=result.goal_m,
        end=(end_x, end_y, decision.heading_rad),
        way_m=decision.path.length_m,
        weights=(mission.weight_occlusion, mission.weight_distance),
        strategy=mission.strategy,
        kind=decision.kind,
        rule=decision.rule,
        reason=cut(decision.reason, MOST_TEXT_BYTES).decode(),
        scored=0 if found is None else found.scored,
        cells=grid.rows * grid.columns,
        places=places,
        rejected={} if found is None else dict(found.rejections),
    )
