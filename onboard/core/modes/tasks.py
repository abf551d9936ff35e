"""The task that moves the rover, one at a time: a mission or an operator's move; and the maps that outlive it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from onboard.config import Config
from onboard.core.context import Context
from onboard.core.downlink import Downlink
from onboard.core.mission.mission import MISSION_JOBS, MOVING, Mission, SweepInMap
from onboard.core.mission.return_to_start import GoBack
from onboard.core.mission.return_track import Track
from onboard.core.mission.survey_and_tour import Survey, Tour
from onboard.core.modes.parameter_orders import ParameterOrders
from onboard.core.modes.teleop import Move, TurnTo, TwistMove
from onboard.planning.fences import Point, goal_refused
from onboard.planning.plan_records import PlanResult
from onboard.records import Gdem, Twist
from protocol.link.transactions import Order, RequestState

if TYPE_CHECKING:
    from onboard.perception.map.stop_map import StopMap
    from onboard.planning.prediction import Prediction

WAY, WAY_CODEC = "way", "json"
Say = Callable[[str, Context, str], None]  # (event, context, why)


class Tasks:
    """Owner of mission, move and maps.

    memory: the rover's map; None until the first stop unless one was saved.
    change: called with each event of the mode table.
    tell: called with each event for the ground.
    """

    def __init__(
        self, parameters: ParameterOrders, maps: tuple[Gdem | None, StopMap | None], downlink: Downlink
    ) -> None:
        self._parameters, self._downlink = parameters, downlink
        self._gdem, self.memory = maps
        self._from_orbit = self._gdem
        self.mission: Mission | None = None
        self.move: Move | None = None
        self.latest: PlanResult | None = None
        self.swept: SweepInMap | None = None
        self.standby_after_leg = False
        self.track = Track()
        self.change: Say = _nobody
        self.tell: Say = _nobody
        self._id: int | None = None  # request of the running mission or move
        self.orders = {
            "goto": self._goto,
            "mission": self._tour,
            "scan": self._scan,
            "turn": self._turn,
            "drive": self._drive,
            "map_clear": self._map_clear,
            "return": self._return,
        }

    @property
    def config(self) -> Config:
        """The configuration with the operator's parameters as set now."""
        return self._parameters.config

    @property
    def in_mission(self) -> bool:
        """True while a mission runs."""
        return self.mission is not None and self.mission.outcome is None

    def step(self, ctx: Context) -> Twist:
        """Process one tick of the running task; return the twist wanted."""
        self.track.note(ctx.localisation.pose)
        if self.move is not None:
            twist = self.move.step(ctx)
            self._follow_move(self.move, ctx)
            return twist
        if self.mission is None or not self.in_mission:
            return Twist()
        before = ctx.localisation.pose
        twist = self.mission.step(ctx)
        if ctx.localisation.pose != before:  # registered
            self.track.correct(ctx.localisation.pose)
        if self.mission.phase is not self.mission.phase_told:  # changed by its own step or by a fault response before
            self.tell("PHASE", ctx, f"{self.mission.phase.name} at stop {self.mission.stop}")
            self.mission.phase_told = self.mission.phase
        self._follow_mission(self.mission, ctx)
        return twist

    def cancel(self, ctx: Context, state: RequestState, reason: str) -> None:
        """End the running task, if any."""
        if self.move is not None:
            self.move = None
            self._finish(state, reason)
        elif self.in_mission:
            self.mission = None
            self._finish(state, reason)
            ctx.jobs.forget(MISSION_JOBS)
            ctx.lidar.stream(False)
            if ctx.nodes.tilt_angle_rad is not None:
                ctx.nodes.park_tilt(ctx.nodes.tilt_angle_rad)

    def digest_items(self) -> tuple[float, ...]:
        """Values of this state that go into the state digest."""
        return self.mission.seeing.digest_items() if self.mission else ()

    def _follow_move(self, move: Move, ctx: Context) -> None:
        self._report(move.progress)
        if move.ended:
            self.move = None
            self._finish(RequestState.FAILED if move.failed else RequestState.COMPLETED, move.ended)
            self.change("failed" if move.failed else "moved", ctx, move.ended)

    def _follow_mission(self, mission: Mission, ctx: Context) -> None:
        for name, text in mission.notes:
            self.tell(name, ctx, text)
        mission.notes.clear()
        self._report(mission.progress)
        self.memory, self._gdem, self.latest = mission.memory, mission.gdem, mission.result or self.latest
        self.swept = mission.swept or self.swept
        if mission.predicted is not None:
            self._tell_way(mission.predicted)
            mission.predicted = None
        if mission.outcome:
            ctx.lidar.stream(False)
            completed, reason = mission.outcome.completed, mission.outcome.reason
            self._finish(RequestState.COMPLETED if completed else RequestState.FAILED, reason)
            event = mission.done if completed else "failed"
            self.tell(event.upper(), ctx, reason)
            self.change("fault" if mission.outcome.broken else event, ctx, reason)
        elif self.standby_after_leg and mission.phase not in MOVING:
            self.standby_after_leg = False
            self._lost(mission, ctx)

    def _lost(self, mission: Mission, ctx: Context) -> None:
        """Respond to lost contact after the leg as `safety.command_lost` sets. A mission that returns goes on."""
        if isinstance(mission, GoBack):
            return
        back = self._parameters.config.safety.command_lost == "return"
        then = "returning" if back else "standing by"
        self.cancel(ctx, RequestState.FAILED, f"no authenticated contact: leg finished, {then}")
        if back:
            self.mission = self._way_back()
            self.tell("DECISION", ctx, "no authenticated contact: back to the start along the driven way")
        else:
            self.change("link_lost", ctx, "no authenticated contact")

    def _way_back(self) -> GoBack:
        return GoBack(self._parameters.config, self._gdem, self.track.back(), self.memory)

    # -- orders ------------------------------------------------------------------------------------------------

    def _goto(self, order: Order, ctx: Context) -> None:
        goal = (order.number("x_m"), order.number("y_m"))
        if self._may_go(order, (goal,), ctx):
            self._set_out(order, Mission(self._parameters.config, self._gdem, goal, self.memory), ctx)

    def _tour(self, order: Order, ctx: Context) -> None:
        goals = order.points("goals_m")
        if self._may_go(order, goals, ctx):
            self._set_out(order, Tour(self._parameters.config, self._gdem, goals, self.memory), ctx)

    def _scan(self, order: Order, ctx: Context) -> None:
        pose = ctx.localisation.pose
        here = (pose.x_m, pose.y_m)
        if self._may_go(order, (here,), ctx, fenced=False):
            self._set_out(order, Survey(self._parameters.config, self._gdem, here, self.memory), ctx)

    def _return(self, order: Order, ctx: Context) -> None:
        self._set_out(order, self._way_back(), ctx)

    def _may_go(self, order: Order, goals: tuple[Point, ...], ctx: Context, fenced: bool = True) -> bool:
        fences = ctx.fences if fenced else ()
        beyond = next(filter(None, (_beyond(self._gdem, goal) or goal_refused(fences, goal) for goal in goals)), "")
        if beyond:
            self._downlink.report(order.request_id, RequestState.FAILED, beyond)
        return not beyond

    def _set_out(self, order: Order, mission: Mission, ctx: Context) -> None:
        self.cancel(ctx, RequestState.CANCELLED, f"another {order.name} came")
        self.mission, self._id, self.standby_after_leg = mission, order.request_id, False
        self.change(order.name, ctx, f"goal {mission.goal[0]:.2f} {mission.goal[1]:.2f}")
        self._downlink.report(
            order.request_id, RequestState.STARTED, f"to {mission.goal[0]:.2f}, {mission.goal[1]:.2f}"
        )

    def _turn(self, order: Order, ctx: Context) -> None:
        self._set_moving(order, TurnTo(self._parameters.config, order.number("heading_rad")), ctx)

    def _drive(self, order: Order, ctx: Context) -> None:
        twist = Twist(order.number("vx_mps"), order.number("vy_mps"), order.number("yaw_radps"))
        bounds = order.number("duration_s"), order.number("distance_m")
        self._set_moving(order, TwistMove(self._parameters.config, twist, *bounds), ctx)

    def _set_moving(self, order: Order, move: Move, ctx: Context) -> None:
        if ctx.held:
            self._downlink.report(
                order.request_id, RequestState.FAILED, "the rover is held by a fault; see faults list"
            )
            return
        self.cancel(ctx, RequestState.CANCELLED, f"another {order.name} came")
        self.move, self._id = move, order.request_id
        self.change(order.name, ctx, f"station {order.station}")
        self._downlink.report(order.request_id, RequestState.STARTED)

    def _map_clear(self, order: Order, ctx: Context) -> None:
        self.memory, self._gdem = None, self._from_orbit
        self.tell("MAP_CLEARED", ctx, f"by station {order.station}")
        self._downlink.report(order.request_id, RequestState.COMPLETED, "no map; the next goto scans ahead and behind")

    # -- reports -----------------------------------------------------------------------------------------------

    def _report(self, progress: list[str]) -> None:
        if progress and self._id is not None:
            self._downlink.report(self._id, RequestState.PROGRESS, progress[-1])
        progress.clear()

    def _tell_way(self, way: Prediction) -> None:
        """Send the answer to a goto: the predicted path as a product, its figures in a report."""
        request = 0 if self._id is None else self._id
        who = {"station": request >> 32, "request_id": request & 0xFFFFFFFF}
        object_id = self._downlink.offer(WAY, way.to_json(**who), WAY_CODEC, priority=1)
        if self._id is not None:
            figures = (object_id, way.length_m, way.time_s) if way.leads else (object_id,)
            self._downlink.report(self._id, RequestState.PROGRESS, way.words, figures)

    def _finish(self, state: RequestState, reason: str) -> None:
        if self._id is not None:
            self._downlink.report(self._id, state, reason)
            self._id = None


def _nobody(_event: str, _ctx: Context, _why: str) -> None:
    """Default callback, until the executive sets its own."""


def _beyond(gdem: Gdem | None, goal_m: tuple[float, float]) -> str:
    """Return the reason why a goal is outside the map, or ''."""
    if gdem is None or gdem.grid.contains(*gdem.grid.cell(*goal_m)):
        return ""
    grid = gdem.grid
    (west, south), half = grid.centre(0, 0), grid.cell_m / 2
    east, north = grid.centre(grid.rows - 1, grid.columns - 1)
    return (
        f"({goal_m[0]:.1f}, {goal_m[1]:.1f}) is outside the orbiter's map: "
        f"x {west - half:.0f} to {east + half:.0f}, y {south - half:.0f} to {north + half:.0f} m"
    )
