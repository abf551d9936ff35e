"""`ground shell`: an operator's lines in one open session of the link, with the verbs of the command line.

    line -> a request in the session, which goes on while the next line is typed; or a verb that queries the archive
    news of the link -> printed above the prompt

`OperatorShell` is the logic, without terminal, clock or socket. A terminal (`terminal`) adds history, completion and a
line with the rover's state; from a pipe each line waits for the outcome of the one before.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from pathlib import Path

from ground.cli.operations import show
from ground.cli.operations.open_requests import left
from ground.cli.verbs.table import ASKS
from ground.link.session import Session
from protocol.link.transactions import RequestState
from protocol.tables import commands

_ENDS = ("quit", "exit")
_ALONE = frozenset({"watch", "script", "shell", "gateway", "bridge", "serve"})
_HELP = (
    "what the rover does:   " + ", ".join(dict.fromkeys(row.typed.split()[0] for row in commands.TABLE)),
    "what the station has:  archive, preview, events, requests, link, plot, report; each with --help",
    "here:                  help, quit; --start S and --expires S with what moves the rover, --out FILE with get",
)


class OperatorShell:
    """Interpreter of the lines.

    verbs: runs a verb that needs no link, as the command line would; returns its exit code.
    codes: exit codes of the verbs so far.
    """

    def __init__(self, verbs: Callable[[list[str]], int], lifetime_s: float = 60.0) -> None:
        self._verbs, self._lifetime_s = verbs, lifetime_s
        self.asked: list[int] = []
        self._files: dict[int, Path] = {}
        self.ended = False
        self.codes: list[int] = []

    def line(self, text: str, session: Session, now_ns: int) -> list[str]:
        """Process one line and return the immediate answer.

        Typing errors never raise; they are answered with a line.
        """
        try:
            words = shlex.split(text, comments=True)
            if words and words[0] == "ground":
                words = words[1:]
            return self._begin(words, session, now_ns) if words else []
        except ValueError as error:
            self.codes.append(64)
            return [f"ground: {error}"]

    def _begin(self, words: list[str], session: Session, now_ns: int) -> list[str]:
        verb = words[0]
        if verb in _ENDS:
            self.ended = True
            still = sum(not self._settled(session, one) for one in self.asked)
            return ["; ".join([f"{still} requests are open", *left(session)])] if still else []
        if verb in ("help", "?"):
            return list(_HELP)
        if verb in _ALONE:
            raise ValueError(f"`{verb}` needs a terminal of its own: `ground {verb}`")
        if "--help" in words or not _asks_the_rover(verb):
            self.codes.append(self._verbs(words))
            return []
        return self._request(words, session, now_ns)

    def _request(self, words: list[str], session: Session, now_ns: int) -> list[str]:
        words, options = _options(words)
        name, arguments = commands.parse(words)
        if name in ASKS and "--yes" not in options and not (name == "fence_clear" and arguments):
            raise ValueError(f"{ASKS[name]}; add --yes to do it")
        moves = commands.command(name).moves
        lifetime_s = float(options.get("--expires", self._lifetime_s if moves else 0.0))
        request_id = session.request(name, arguments, now_ns, lifetime_s, float(options.get("--start", 0.0)))
        self.asked.append(request_id)
        if "--out" in options:
            self._files[request_id] = Path(options["--out"])
        if name != "status":
            return []
        known = show.status(session, now_ns)["items"]
        return [show.item_line(item, value) for item, value in known.items()]

    def arrived(self, session: Session) -> list[tuple[str, Path]]:
        """Return the arrived products of requests that named a file: (name, path), each once."""
        found = []
        for request_id, path in list(self._files.items()):
            product = session.product_of(request_id) if session.awaits_product(request_id) else None
            if product is not None:
                del self._files[request_id]
                found.append((product.name, path))
        return found

    def settled(self, session: Session) -> bool:
        """Return whether all requests have their outcome and their products have arrived."""
        return all(self._settled(session, request_id) for request_id in self.asked)

    def code(self, session: Session) -> int:
        """Return the exit code of the shell: the highest of the verbs', at least 1 if a request did not succeed."""
        done = all(session.requester.requests[one].state is RequestState.COMPLETED for one in self.asked)
        return max([0 if done else 1, *self.codes])

    def _settled(self, session: Session, request_id: int) -> bool:
        if session.awaits_product(request_id):
            return session.product_of(request_id) is not None
        return session.requester.requests[request_id].state.final


def _asks_the_rover(verb: str) -> bool:
    name = verb.replace("-", "_")
    return verb in commands.FAMILIES or any(row.name == name for row in commands.TABLE)


_MOST_S = 1e9
_TAKES = {"--start", "--expires", "--out", "--heading"}


def _options(words: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Return the words without options, and the options. Raises ValueError for an unknown one."""
    left: list[str] = []
    options: dict[str, str] = {}
    rest = iter(words)
    for word in rest:
        if word == "--yes":
            options[word] = ""
        elif word in _TAKES:
            value = next(rest, None)
            if value is None:
                raise ValueError(f"{word} needs a value")
            options[word] = value
        elif word.startswith("--"):
            raise ValueError(f"`{word}` is not known here; --yes, {', '.join(sorted(_TAKES))} are")
        else:
            left.append(word)
    for name in ("--start", "--expires"):
        if name in options and not _are_seconds(options[name]):
            raise ValueError(f"{name} should be seconds from 0 to {_MOST_S:g}, found `{options[name]}`")
    return left + ([options.pop("--heading")] if "--heading" in options else []), options


def _are_seconds(text: str) -> bool:
    try:
        return 0 <= float(text) <= _MOST_S
    except ValueError:
        return False


def completions() -> dict[str, object]:
    """Return the words that may follow each word, nested, for the prompt."""
    from onboard.parameters import TABLE as PARAMETERS
    from protocol.tables.telemetry import BY_NAME

    tree: dict[str, object] = {}
    for row in commands.TABLE:
        follows: dict[str, object] | None = None
        if row.arguments:
            first = row.arguments[0]
            known = first.choices or tuple(first.known)
            known = tuple(PARAMETERS) if first.name == "parameter" else known
            follows = dict.fromkeys(known) if known else None
        family, _, verb = row.typed.partition(" ")
        if verb:
            inner = tree.setdefault(family, {})
            assert isinstance(inner, dict)
            inner[verb] = follows
        else:
            tree[family] = follows
    tree |= dict.fromkeys(("events", "requests", "link", "report", "help", "quit"))
    tree["archive"] = dict.fromkeys(("info", "show", "gaps", "export", "prune", "fill"))
    tree["preview"] = {"goto": None}
    tree["plot"] = dict.fromkeys(BY_NAME)
    return tree
