"""`ground report FOLDER`: report of a mission as one HTML file.

All facts come from the rover's record and the bench's files in the same folder; nothing else is computed.
"""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from ground.link.event_words import event_words
from ground.report import pictures as draw
from ground.report.page import Section, facts, numbers, page, paragraph, picture, table, verdict
from ground.report.run_files import Contact, RoverEvent, Run, read_run
from ground.report.words import ALWAYS, CONTACTS, EXPECTED_REFUSAL, RIM, RULES, SIGMA, TICKS, TIME_LINE, WHEELS

_TERRAINS = {"fbm": "fractal ground", "craters": "cratered ground", "real": "measured land", "flat": "flat ground"}
_QUIET_EVENTS = ("PHASE", "DECISION")
_UNKNOWN = (
    "Nothing here has met real hardware: rover, scanner, bus and radio are emulated, byte for byte, on one machine.",
    "The soil's parameters and the sensors' noise are assumptions; other ground and other sensors were not tried in "
    "this run.",
    "The link's settings are assumptions as well: those of the satellite in the paper are not public.",
    "One run says what happened once. How often a mission succeeds is a question for many seeds.",
)


def report(folder: Path, with_truth: bool = True) -> Path:
    """Write FOLDER/report.html and return its path. Raises NoRunError, OSError."""
    run = read_run(folder, with_truth)
    path, page = folder / "report.html", html(run)
    if path.is_symlink():  # of another person's folder: it could lead anywhere
        path.unlink()
    path.write_text(page, encoding="utf-8")
    return path


def write_paths(folder: Path, file: Path, with_truth: bool = True) -> Path:
    """Write the picture of the paths alone, a PNG file. Raises NoRunError, OSError."""
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_bytes(draw.paths_picture(read_run(folder, with_truth)))
    return file


def html(run: Run) -> str:
    """Return the page of a run."""
    title = f"Mission report: {_title(run)}"
    sections = (
        Section("Paths", picture(draw.paths_picture(run), _ways(run))),
        Section("Contacts", _contacts(run.contacts)),
        Section("The run", facts(_facts(run))),
        Section("Time line", picture(draw.time_line_picture(run), TIME_LINE)),
        Section("Decisions, stop by stop", _decisions(run)),
        Section("What the rover knew at each stop", _maps(run)),
        Section(
            "Orientation",
            picture(
                draw.orientation_picture(run),
                "Yaw, roll and pitch over bench time; the bands are the mission's phases. "
                "The line of yaw breaks where the rover turns past 180 degrees: the same heading as -180.",
            ),
        ),
        Section("Pose and motion", _motion(run)),
        Section(
            "Terrain",
            picture(
                draw.terrain_picture(run),
                "What lies there and what the orbiter knows of it; triangle: start, dot: goal.",
            ),
        ),
        Section("Link and tick", _link_and_tick(run)),
        Section("Events", _events(run.events)),
        Section("Certificate", _certificate(run.certificate)),
        Section("What is not known", "".join(paragraph(text) for text in _UNKNOWN)),
    )
    return page(title, _head(run, title), sections)


def _title(run: Run) -> str:
    terrain, seed = run.facts.get("terrain"), run.facts.get("seed")
    return run.folder.name if terrain is None else f"{_TERRAINS.get(terrain, terrain)}, seed {seed}"


def _head(run: Run, title: str) -> str:
    known, head = run.facts, f"<h1>{title}</h1>\n"
    end = next((e for e in reversed(run.events) if e.name in ("ARRIVED", "FAILED")), None)
    told = "no mission has ended in this record" if end is None else _end_words(end)
    if known:
        reached = bool(known.get("goal_reached"))
        words = [verdict(reached, "goal reached" if reached else "goal not reached")]
        if "replay" in known:
            words.append(verdict(known["replay"] == "identical", f"replay {known['replay']}"))
    else:
        words = [verdict(None if end is None else end.name == "ARRIVED", told)]
    if run.contacts is not None:
        words.insert(1, verdict(not run.contacts, _count(run.contacts)))
    head += f"<p>{' '.join(words)}</p>"
    head += paragraph(f"The rover reported, by its own estimate: {told}.", "soft")
    head += paragraph(_made(run), "soft")
    if len(run.boots_s) > 1:
        times = ", ".join(f"{time_s:.1f} s" for time_s in run.boots_s[1:])
        head += paragraph(
            f"The flight program was started {len(run.boots_s)} times, again at {times}. The clock of "
            "each start begins at zero; here all starts are on one axis of time.",
            "soft",
        )
    boxes = (
        ("true distance to the goal", "distance_to_goal_m", "{:.2f} m"),
        ("scans", "scans", "{}"),
        ("replans", "replans", "{}"),
        ("driven", "way_m", "{:.1f} m"),
        ("bench time", "bench_s", "{:.0f} s"),
        ("times real time", "rtf", "{:.1f}"),
    )
    return head + numbers([(name, shape.format(known[key])) for name, key, shape in boxes if key in known])


def _end_words(end: RoverEvent) -> str:
    """Return the end of a mission in words: `arrived, 1 cm off`."""
    text = event_words(end.text)
    return text if text.startswith(f"{end.name.lower()}, ") else f"{end.name.lower()}: {text}"


def _made(run: Run) -> str:
    """Return version, commit and date."""
    commit = run.versions.get("commit", "")
    flown = f"flight program of commit {commit[:12]}" if commit else "flight program of an unknown commit"
    written = datetime.fromtimestamp(run.written_utc_s, UTC)
    return f"El Dorado {version('el-dorado')}, {flown}; record written on {written:%Y-%m-%d at %H:%M} UTC."


def _ways(run: Run) -> str:
    """Return the caption of the paths, of what is drawn only."""
    words = ["The way from the start of the run."]
    if any(len(plan.global_path) for _, plan in run.plans):
        words.append("The global path was planned on the orbiter's map; at each stop a local path replaced it.")
    if len({tuple(plan.goal_m.tolist()) for _, plan in run.plans}) > 1:
        words.append("The rover was given several goals; the smaller dots are those before the last one.")
    return " ".join(words)


def _facts(run: Run) -> list[tuple[str, str]]:
    """Return names and values of the facts table; a fact that the run's files lack has no row."""
    known, ground = run.facts, run.facts.get("field", {})
    down, up = (known.get("link_by_direction", {}).get(name) for name in ("down", "up"))
    rows: list[tuple[str, Any]] = [
        ("El Dorado, commit", f"{version('el-dorado')}, {run.versions.get('commit', 'unknown')}"),
        ("terrain, seed", _filled("{terrain}, {seed}", known)),
        ("ground", _filled("median slope {median_slope_deg:.1f}°, 95th percentile {p95_slope_deg:.1f}°", ground)),
        (
            "rocks",
            _filled(
                "{rocks:.0f}, on {percent:.1f} % of the ground",
                {**ground, "percent": 100 * ground.get("rock_area_ratio", 0)},
            ),
        ),
        ("seeds passed over", "; ".join(f"{row['seed']}: {row['reason']}" for row in known.get("passed_over", ()))),
        ("scanner", _scanner(known.get("scanner", {}))),
        ("soil", known.get("soil")),
        ("sensor noise", known.get("sensor_noise")),
        ("goal", "x {:.2f} m, y {:.2f} m".format(*known["goal_m"]) if "goal_m" in known else None),
        ("true distance to the goal, from the bench", _filled("{distance_to_goal_m:.3f} m", known)),
        ("what the rover reported, by its own estimate", event_words(str(known.get("outcome", "")))),
        ("strategy", known.get("strategy")),
        ("scans, replans", _filled("{scans}, {replans}", known)),
        ("driven way", _filled("{way_m:.1f} m", known)),
        ("time", _filled("{bench_s:.0f} s of bench time in {wall_s:.0f} s: {rtf:.1f} times real time", known)),
        ("replay of the record", _filled("{replay} over {replay_ticks} ticks", known)),
        ("first difference", known.get("replay_difference")),
        ("CAN frames, SCIP bytes", _filled("{can_frames}, {scip_bytes}", known)),
        ("orbiter's map", known.get("gdem")),
        ("wall time of a tick", _laps(known.get("tick_wall_ms", {}))),
        ("link profile", _filled("{link_profile}: {link_note}", {"link_note": "see hil/link/profiles.toml", **known})),
        ("datagrams, rover to ground", _filled("{sent} sent, {lost} lost", down or {})),
        ("datagrams, ground to rover", _filled("{sent} sent, {lost} lost", up or {})),
        ("onboard's largest memory", _filled("{onboard_peak_rss_mb} MB", known)),
        ("injected faults", "; ".join(json.dumps(row) for row in known.get("faults", ()))),
    ]
    return [(name, str(text)) for name, text in rows if text not in (None, "")]


def _scanner(known: dict[str, Any]) -> str | None:
    """Return the rover's scanner and its losses in this run."""
    if not known:
        return None
    lost = ", ".join(f"{100 * ratio:.2f} % {name}" for name, ratio in known["lost_by"].items() if ratio)
    words = [f"{known['profile']}, {100 * known['lost_ratio']:.2f} % of the beams lost{f' ({lost})' if lost else ''}"]
    words.append(f"{100 * known['outlier_ratio']:.3f} % outliers, {100 * known['mixed_ratio']:.2f} % mixed")
    words.append(f"clock off by {known['rate_error_ppm']:g} ppm, motor jitter {1e6 * known['motor_jitter_s']:.0f} µs")
    return "; ".join(words)


def _filled(text: str, known: dict[str, Any]) -> str | None:
    """Return the text with its numbers; None if one is missing."""
    try:
        return text.format(**known)
    except KeyError:
        return None


def _count(contacts: Sequence[Contact]) -> str:
    return "1 contact" if len(contacts) == 1 else f"{len(contacts) or 'no'} contacts"


def _contacts(contacts: Sequence[Contact] | None) -> str:
    """Return the contacts with time and place; an empty list is reported as well."""
    if contacts is None:
        return ""
    if not contacts:
        return paragraph("None. " + CONTACTS)
    rows = [(f"{c.begin_s:.1f} s", f"{c.end_s:.1f} s", c.what, f"({c.x_m:.2f}, {c.y_m:.2f})") for c in contacts]
    return paragraph(CONTACTS) + table(("begin", "end", "what", "at, m"), rows)


def _decisions(run: Run) -> str:
    rows = [
        (
            str(number),
            f"{time_s:.1f} s",
            f"({plan.pose[0]:.2f}, {plan.pose[1]:.2f})",
            plan.kind,
            plan.rule,
            event_words(plan.reason),
        )
        for number, (time_s, plan) in enumerate(run.plans, 1)
    ]
    if not rows:
        told = (event for event in run.events if event.name == "DECISION")
        rows = [
            ("", f"{event.time_s:.1f} s", "", "", (event.text.split() or ["?"])[0], event_words(event.text))
            for event in told
        ]
    told = " ".join(" ".join(row[4:]) for row in rows)
    occur = [rule for rule in RULES if rule in ALWAYS or re.search(rf"\b{rule}\b", told)]
    rules = [(f"{rule} {RULES[rule][0]}", RULES[rule][1]) for rule in occur]
    return table(("stop", "time", "at, m", "decision", "rule", "reason"), rows) + (facts(rules) if rows else "")


def _maps(run: Run) -> str:
    if not run.plans:
        return ""
    caption = (
        "The local elevation map after the scans of each stop, in its four node sets; the star is where the rover goes "
        "next, the wedge what it will look at from there. " + RIM
    )
    chosen = [
        picture(draw.choice_picture(run, plan), f"Stop {number}: where the strategy would scan next, and why there.")
        for number, (_, plan) in enumerate(run.plans, 1)
        if plan.scoring
    ]
    return picture(draw.ldem_picture(run), caption) + "".join(chosen)


def _motion(run: Run) -> str:
    body = ""
    if run.truth:
        body = picture(draw.error_picture(run), "Where the rover believed itself to be, against where it was. " + SIGMA)
    of = f"true speed, wheel rates and steering angles ({WHEELS})" if run.truth else "estimated speed"
    return body + picture(draw.motion_picture(run), f"Over bench time: {of}.")


def _link_and_tick(run: Run) -> str:
    body = ""
    if run.link:
        body = picture(draw.link_picture(run), "Datagrams over the emulated space link, delivered and lost, by cause.")
    histogram = run.facts.get("tick_wall_ms", {}).get("histogram", {})
    if any(sum(counts) for name, counts in histogram.items() if name != "edges_ms"):
        body += picture(draw.tick_picture(histogram), TICKS)
    return body + _rhythm(run.rhythm)


def _rhythm(rhythm: dict[str, Any]) -> str:
    """Return jobs against their ticks; on the wall clock, where a run measures itself, also rate groups and slips."""
    ticks, body = rhythm.get("ticks", {}), ""
    if sum(ticks.get("lateness", ())):
        below = ticks["late_below_us"]
        body += paragraph(
            f"Ticks began less than {below['p50']} µs late in half of the cases, {below['p999']} µs in all but one of "
            f"1000, {ticks['late_worst_ms']:.2f} ms at worst; {ticks['slipped']} were left out."
        )
        body += table(
            ("rate group", "rate", "budget", "worst", "runs over it", "slips"),
            [
                (
                    row["name"],
                    f"{row['rate_hz']:g} Hz",
                    f"{row['budget_us']:.0f} µs",
                    f"{row['worst_us']:.0f} µs",
                    str(row["over_budget"]),
                    str(row["slips"]),
                )
                for row in rhythm["rate_groups"]
            ],
        )
        if ticks["slips"]:
            body += table(
                ("left out because of", "beside the job", "ticks", "longest"),
                [(row["cause"], row["job"], str(row["ticks"]), f"{row['worst_ms']:.1f} ms") for row in ticks["slips"]],
            )
    if jobs := rhythm.get("jobs", {}).get("kept"):
        body += table(
            ("job", "done", "late", "worst, in ticks"),
            [(name, str(row["done"]), str(row["late"]), str(row["worst_late_ticks"])) for name, row in jobs.items()],
        )
    return body


def _events(events: Sequence[RoverEvent]) -> str:
    rows = [
        (f"{e.time_s:.2f} s", e.severity, e.name, event_words(e.text)) for e in events if e.name not in _QUIET_EVENTS
    ]
    refused = any(e.name == "REGISTRATION_REFUSED" for e in events)
    return table(("time", "severity", "event", "text"), rows) + (paragraph(EXPECTED_REFUSAL, "soft") if refused else "")


def _certificate(known: dict[str, Any]) -> str:
    if not known:
        return ""
    rows = [
        (name, str(row.get("pieces", row.get("datagrams", ""))), str(row.get("bytes", "")), row["sha256"])
        for name, row in known.get("channels", {}).items()
    ]
    plant = known.get("plant", {})
    if plant:
        rows.append(("the plant's states", str(plant["states"]), "", plant["sha256"]))
    text = paragraph("The same seed gives these hashes again, run after run; make the demo twice and compare.")
    versions = ", ".join(f"{name} {version}" for name, version in known.get("versions", {}).items())
    lines = [
        ("scenario", str(known.get("scenario", ""))),
        ("its SHA-256", str(known.get("scenario_sha256", ""))),
        ("machine", str(known.get("machine", ""))),
        ("versions", versions),
    ]
    return (
        text
        + facts([line for line in lines if line[1]])
        + table(("channel", "pieces", "bytes", "SHA-256"), rows, hashes=True)
    )


def _laps(laps: dict[str, dict[str, Any]]) -> str:
    """Return the wall time of a tick in words."""
    return "; ".join(
        f"{name.replace('_', ' ')}: " + ", ".join(f"{share.replace('_', '.')} {ms:.2f} ms" for share, ms in row.items())
        for name, row in laps.items()
        if row and name != "histogram"
    )
