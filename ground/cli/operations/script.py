"""Operator's script: commands at exact times, waits, products. Pure: time and news in, requests out.

    at 2.0: goto 12 3        # at bench time 2.0 s; heading in degrees as a third number
    wait goto                # until its outcome is reported
    get ldem                 # ask for a product and go on when it has arrived
    wait 5                   # seconds
At its end the script waits for every open request. It succeeds if every command was completed and every product
arrived.
"""

from __future__ import annotations

from typing import NamedTuple

from ground.link.session import Session
from protocol.link.transactions import RequestState
from protocol.tables import commands


class ScriptError(ValueError):
    """A line cannot be read. The text names the line and what is allowed."""


class ScriptStep(NamedTuple):
    """One line of a script.

    line, text: its number and content.
    verb: "command", "contacts" (the station's own windows), "wait" (for a command) or "pause".
    name, arguments: of the command.
    at_s: earliest time of the step, s; None: at once.
    """

    line: int
    text: str
    verb: str
    name: str
    arguments: dict[str, commands.Value]
    at_s: float | None
    pause_s: float = 0.0
    start_s: float = 0.0  # of a command: onboard time before which it may not begin
    start_utc_ns: int = 0  # likewise in UTC; requested once onboard time is known


def parse(text: str, where: str = "script") -> list[ScriptStep]:
    """Return the steps of a script.

    Raises ScriptError with file, line and what is allowed; also for an empty script.
    """
    steps: list[ScriptStep] = []
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.split("#", 1)[0].strip()
        if not line:
            continue
        try:
            steps.append(_step(number, line, [step.name for step in steps if step.verb == "command"]))
        except ValueError as error:
            raise ScriptError(f"{where}:{number}: {error}") from None
    if not steps:
        raise ScriptError(f"{where}: nothing in it; write lines like `at 2.0: goto 12 3`")
    return steps


def _step(number: int, line: str, asked: list[str]) -> ScriptStep:
    at_s, rest = None, line
    if line.startswith("at "):
        head, sign, rest = line.partition(":")
        try:
            at_s = float(head[3:])
        except ValueError:
            sign = ""
        if not sign or not rest.strip():
            raise ValueError(f"`{line}` should be `at SECONDS: COMMAND`")
    words = rest.split()
    if words[0] != "wait":
        name, arguments = commands.parse(words)
        return ScriptStep(number, line, "command", name, arguments, at_s)
    if len(words) != 2:
        raise ValueError("`wait` takes a command's name or seconds")
    if words[1] in asked:
        return ScriptStep(number, line, "wait", words[1], {}, at_s)
    try:
        pause_s = float(words[1])
    except ValueError:
        known = ", ".join(dict.fromkeys(asked)) or "none"
        raise ValueError(f"wait {words[1]}: no such command before this line; asked so far: {known}") from None
    return ScriptStep(number, line, "pause", "", {}, at_s, pause_s)


class Runner:
    """Executes the steps on a session. result: None while it runs, then True or False."""

    def __init__(self, steps: list[ScriptStep], lifetime_s: float = 60.0) -> None:
        self._steps, self._lifetime_s = steps, lifetime_s
        self._next = 0
        self._pause_until_ns: int | None = None
        self._waiting_for: int | None = None
        self.asked: list[tuple[int, ScriptStep]] = []
        self.result: bool | None = None

    def step(self, session: Session, now_ns: int) -> list[str]:
        """Execute the steps that are due. Returns the lines that have begun."""
        begun: list[str] = []
        while self.result is None and self._ready(session, now_ns):
            if self._next == len(self._steps):
                if all(self._settled(session, i) for i, _ in self.asked):
                    self.result = all(self._succeeded(session, i) for i, _ in self.asked)
                break
            step = self._steps[self._next]
            self._next += 1
            begun.append(step.text)
            self._begin(step, session, now_ns)
        return begun

    def next_due_ns(self, now_ns: int) -> int | None:
        """Return the next time at which a step is due without news of the link; None: none."""
        if self._pause_until_ns is not None and self._pause_until_ns > now_ns:
            return self._pause_until_ns
        if self._next < len(self._steps) and self._waiting_for is None:
            at_s = self._steps[self._next].at_s
            return None if at_s is None else round(at_s * 1e9)
        return None

    def _ready(self, session: Session, now_ns: int) -> bool:
        if self._pause_until_ns is not None and now_ns < self._pause_until_ns:
            return False
        if self._waiting_for is not None and not self._settled(session, self._waiting_for):
            return False
        self._pause_until_ns = self._waiting_for = None
        if self._next == len(self._steps):
            return True
        step = self._steps[self._next]
        if (step.start_utc_ns or step.verb == "contacts") and session.far_clock.onboard_ns(now_ns) is None:
            return False
        return step.at_s is None or now_ns >= round(step.at_s * 1e9)

    def _begin(self, step: ScriptStep, session: Session, now_ns: int) -> None:
        if step.verb == "pause":
            self._pause_until_ns = now_ns + round(step.pause_s * 1e9)
        elif step.verb == "wait":
            self._waiting_for = next(i for i, asked in reversed(self.asked) if asked.name == step.name)
        else:
            # A stop or safe must be executed however late it arrives, so it has no lifetime.
            lifetime_s = self._lifetime_s if commands.command(step.name).moves else 0.0
            start_s, arguments = step.start_s, step.arguments
            if step.start_utc_ns:
                start_s = (session.onboard_of_utc_ns(step.start_utc_ns, now_ns) or 0) / 1e9
            if step.verb == "contacts":
                arguments = {"windows_s": session.windows_for_rover(now_ns) or ()}
            request_id = session.request(step.name, arguments, now_ns, lifetime_s, start_s)
            self.asked.append((request_id, step))
            if step.name == "get" or commands.command(step.name).sends:
                self._waiting_for = request_id

    def _settled(self, session: Session, request_id: int) -> bool:
        request = session.requester.requests[request_id]
        if session.awaits_product(request_id):
            return session.product_of(request_id) is not None
        return request.state.final

    def _succeeded(self, session: Session, request_id: int) -> bool:
        return session.requester.requests[request_id].state == RequestState.COMPLETED
