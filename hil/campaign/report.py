"""Report of a campaign: one self-contained HTML page of outcomes, classes, failures and pictures."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Iterator, Sequence
from html import escape as escape_html

import numpy as np

from hil.campaign.case import OUTCOMES
from hil.campaign.plan import Plan
from hil.campaign.statistics import HEADLINES, arrived, by_class, counts, failures, knobs_of, spread
from hil.campaign.table import Row
from pictures.campaign import ShareBar
from pictures.campaign import errors as draw_errors
from pictures.campaign import shares as draw_shares
from pictures.campaign import spread as draw_spread
from pictures.style import png
from protocol.visible import visible_lines

MOST_CASES = 12  # named of one reason
MOST_PICTURES = 6  # of shares
FIGURES = {
    "way_ratio": ("way over optimum, of arrivals", ""),
    "s_per_m": ("time per metre, of arrivals", "s"),
    "distance_to_goal_m": ("true distance to the goal", "m"),
    "max_position_error_m": ("largest error of the reported place", "m"),
    "max_heading_error_rad": ("largest error of the heading", "rad"),
    "max_error_sigmas": ("largest error at a stop, over its sigma", ""),
    "nees": ("NEES of x, y, yaw at the stops: 3 if consistent", ""),
    "max_tilt_deg": ("largest tilt", "degrees"),
    "scans": ("scans", ""),
    "bench_s": ("time of the bench", "s"),
    "fault_delay_s": ("from an injection to the next fault", "s"),
    "wall_s": ("time of a flight on its machine", "s"),
    "peak_rss_mb": ("largest memory of a process that flies", "MB"),
}
_CSS = """
body { font: 16px/1.55 system-ui, "DejaVu Sans", sans-serif; color: #1d1f23; margin: 0 auto; max-width: 62rem;
  padding: 2rem 1.5rem 4rem; }
h1 { font-size: 1.9rem; margin: 0 0 .4rem; }
h2 { font-size: 1.25rem; margin: 2.4rem 0 .6rem; padding-top: .8rem; border-top: 1px solid #dfe2e6; }
table { border-collapse: collapse; width: 100%; font-size: .93rem; margin: .6rem 0 1.2rem; }
th, td { text-align: left; vertical-align: top; padding: .3rem .8rem .3rem 0; border-bottom: 1px solid #dfe2e6; }
.wide { overflow-x: auto; } .soft { color: #5f6670; font-size: .92rem; }
code { font-family: ui-monospace, "DejaVu Sans Mono", monospace; font-size: .85em; }
.pictures { display: flex; flex-wrap: wrap; gap: 1rem; } .pictures img { width: 29rem; max-width: 100%; height: auto; }
"""


def page(plan: Plan, rows: Sequence[Row], command: str) -> str:
    """Text of the page. command: `hil case PLAN` as the user types it."""
    versions = sorted({str(row.get("version")) for row in rows})
    head = (
        f"<h1>Campaign {_escape(plan.name)}</h1>\n<p>{_escape(plan.about)}</p>\n"
        f'<p class="soft">{_number(plan, rows)} cases, seed {plan.seed}, plan {plan.sha256[:12]}; flown by '
        f"{_escape(', '.join(versions))}{'; the cases are of several versions' if len(versions) > 1 else ''}</p>\n"
    )
    parts = (
        ("Outcomes", _outcomes(rows)),
        ("Failures", _failures(rows, command)),
        ("Figures", _figures(rows)),
        ("By class", _classes(rows)),
        ("Pictures", _pictures(rows)),
        ("The plan", _plan(plan)),
    )
    body = "".join(f"<section><h2>{title}</h2>\n{text}</section>\n" for title, text in parts if text)
    return (
        '<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>Campaign {_escape(plan.name)}</title><style>{_CSS}</style></head>\n"
        f"<body>\n{head}{body}</body></html>\n"
    )


def _number(plan: Plan, rows: Sequence[Row]) -> str:
    return str(len(rows)) if len(rows) == plan.cases else f"{len(rows)} of {plan.cases}"


def _outcomes(rows: Sequence[Row]) -> str:
    shares = _table(("", "cases, with the 95 % interval"), ((name, str(of(rows))) for name, of in HEADLINES.items()))
    of = counts(rows)
    return shares + _table(("outcome", "cases", ""), ((name, str(n), OUTCOMES[name]) for name, n in of.items()))


def _failures(rows: Sequence[Row], command: str) -> str:
    found = failures(rows)
    if not found:
        return "<p>None: every case arrived, without a contact.</p>\n"
    lines = []
    for group in found:
        some = " ".join(f"<code>{_escape(f'{command} {number}')}</code><br>" for number in group.cases[:MOST_CASES])
        more = f"and {len(group.cases) - MOST_CASES} more" if len(group.cases) > MOST_CASES else ""
        lines.append((_escape(group.outcome), _escape(group.example), str(len(group.cases)), some + more))
    return _html_table(("outcome", "reason of the first", "cases", "fly one again"), lines)


def _figures(rows: Sequence[Row]) -> str:
    lines = []
    for name, (means, unit) in FIGURES.items():
        found = spread(rows, name)
        if found:
            lines.append((f"{means}, {unit}" if unit else means, *(f"{value:.4g}" for value in found)))
    return _table(("", "median", "nine of ten", "largest"), lines)


def _classes(rows: Sequence[Row]) -> str:
    return "".join(
        f"<h3><code>{_escape(knob)}</code></h3>\n"
        + _table(
            ("class", "cases", "at the goal, of the reachable", "a contact, of the flights"),
            ((row.name, str(row.cases), str(row.arrivals), str(row.contacts)) for row in by_class(rows, knob)),
        )
        for knob in knobs_of(rows)
    )


def _pictures(rows: Sequence[Row]) -> str:
    images = "".join(
        f'<img alt="{_escape(text)}" src="data:image/png;base64,{base64.b64encode(drawing).decode()}">\n'
        for text, drawing in _drawings(rows)
    )
    return f'<div class="pictures">\n{images}</div>\n' if images else ""


def _drawings(rows: Sequence[Row]) -> Iterator[tuple[str, bytes]]:
    for knob in knobs_of(rows)[:MOST_PICTURES]:
        bars = [
            ShareBar(row.name, row.arrivals.ratio, row.arrivals.low, row.arrivals.high, row.arrivals.total)
            for row in by_class(rows, knob)
            if row.arrivals.total
        ]
        yield f"share at the goal by {knob}", png(draw_shares(bars, f"At the goal, by {knob}", knob))
    for name, mark in (("way_ratio", 1.0), ("s_per_m", None)):
        values = np.array([row[name] for row in rows if row.get(name) is not None], np.float64)
        if len(values):
            means = FIGURES[name][0]
            yield means, png(draw_spread(values, means.capitalize(), means, mark))
    ends = [(row["sigma_m"], row["position_error_m"]) for row in rows if _has(row, "sigma_m", "position_error_m")]
    if ends:
        sigma_m, error_m = np.array(ends, np.float64).T
        title = "Error of the place against its sigma, at the end"
        yield "errors against sigma", png(draw_errors(sigma_m, error_m, title))


def _has(row: Row, *names: str) -> bool:
    return all(row.get(name) is not None for name in names)


def _plan(plan: Plan) -> str:
    laws = ((name, str(law)) for name, law in plan.knobs.items())
    return _table(("knob", "law"), laws)


def _table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    return _html_table(heads, [[_escape(cell) for cell in line] for line in lines])


def _html_table(heads: Sequence[str], lines: Iterable[Sequence[str]]) -> str:
    top = "".join(f"<th>{_escape(head)}</th>" for head in heads)
    rest = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in line) + "</tr>\n" for line in lines)
    return f'<div class="wide"><table>\n<tr>{top}</tr>\n{rest}</table></div>\n'


def _escape(text: str) -> str:
    return escape_html(visible_lines(text))


def summary(rows: Sequence[Row]) -> list[str]:
    """Lines for the terminal: the headlines, and arrivals' ways."""
    lines = [f"{name:<50} {of(rows)}" for name, of in HEADLINES.items()]
    way = spread([row for row in rows if arrived(row)], "way_ratio")
    if way:
        lines.append(f"{'way over optimum: median, nine of ten, largest':<50} {way[0]:.2f}, {way[1]:.2f}, {way[2]:.2f}")
    return lines
