"""Build the documentation as a site, without a network: `python -m tools.site`, or `make site`.

    python -m tools.site                 build/site, from docs/
    python -m tools.site --out FOLDER    elsewhere, below a folder of its own

Exit codes: 0 built, 1 a fault of a page (each is named), 69 a part is not installed, 73 not writable, 130 Ctrl-C.
"""

from __future__ import annotations

import argparse
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterable
from pathlib import Path

from tools.site import check, pages

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
DOCS = ROOT / "docs"
CONFIG = HERE / "zensical.toml"
DRAWN = HERE / "diagrams"  # committed: who has not changed a diagram needs not draw one
ASSETS = ("site.css", "iframe-worker.js")
FAULTY, UNAVAILABLE, CANNOT_CREATE, INTERRUPTED = 1, 69, 73, 130


def draw(sources: Iterable[str], store: Path) -> list[str]:
    """Draw each Mermaid source into `store` as SVG, unless it is there. Returns what cannot be drawn, and why."""
    store.mkdir(parents=True, exist_ok=True)
    faults = []
    for name, source in {pages.diagram_name(source): source for source in sources}.items():
        picture = store / name
        if picture.exists():
            continue
        import mermaidx  # some seconds a diagram

        try:
            drawn = mermaidx.render(source).svg()
        except RuntimeError as error:
            faults.append(f"diagram `{source.splitlines()[0].strip()} ...`: {str(error).splitlines()[0]}")
            continue
        part = picture.with_suffix(".part")
        part.write_text(drawn, encoding="utf-8")
        part.rename(picture)
    return faults


def forget(sources: Iterable[str], store: Path) -> None:
    """Remove the drawings in `store` that belong to none of these sources."""
    wanted = {pages.diagram_name(source) for source in sources}
    for picture in store.glob("*.svg"):
        if picture.name not in wanted:
            picture.unlink()


def stage(docs: Path, work: Path, store: Path) -> list[str]:
    """Write the pages as the site has them below `work`. Returns the faults of navigation and diagrams."""
    texts = pages.read(docs)
    configured = tomllib.loads(CONFIG.read_text(encoding="utf-8"))["project"]
    faults = pages.unlisted(pages.navigation(configured["nav"]), texts)
    goal = work / "docs"
    shutil.rmtree(work, ignore_errors=True)
    shutil.copytree(docs, goal, ignore=shutil.ignore_patterns("*.md"))
    titles = {name: pages.title(text) for name, text in texts.items()}
    for name, text in texts.items():
        (goal / name).write_text(pages.staged(text, titles), encoding="utf-8")
    for name in pages.outside(texts.values()):
        (goal / pages.FILES / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, goal / pages.FILES / name)
    faults += draw([source for text in texts.values() for source in pages.diagrams(text)], store)
    shutil.copytree(store, goal / pages.DIAGRAMS)
    shutil.copy(CONFIG, work / CONFIG.name)
    for name in ASSETS:
        shutil.copy(HERE / name, goal / name)
    return faults


def build(docs: Path, out: Path) -> list[str]:
    """Build the site of `docs` in `out`, which is replaced. Returns its faults; with any, `out` is left as it was."""
    work = out.with_name(out.name + "-pages")
    if faults := stage(docs, work, DRAWN):
        return faults
    command = [sys.executable, "-m", "zensical", "build", "--strict", "--clean"]
    ended = subprocess.run(command, cwd=work, capture_output=True, text=True)
    if ended.returncode:
        return [line for line in (ended.stdout + ended.stderr).splitlines() if line.strip()]
    if faults := check.faults(work / "site"):
        return faults
    shutil.rmtree(out, ignore_errors=True)
    (work / "site").rename(out)
    shutil.rmtree(work)
    return []


def main(argv: list[str] | None = None) -> int:
    """Build, check, print where the site is."""
    parser = argparse.ArgumentParser(prog="python -m tools.site", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--out", type=Path, default=ROOT / "build" / "site", help="folder of the site (build/site)")
    out: Path = parser.parse_args(argv).out
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        faults = build(DOCS, out)
        forget((source for text in pages.read(DOCS).values() for source in pages.diagrams(text)), DRAWN)
    except ModuleNotFoundError as error:
        print(f"site: {error.name} is not installed: run `make site`, which installs it", file=sys.stderr)
        return UNAVAILABLE
    except OSError as error:
        print(f"site: {error.filename or out}: {error.strerror}", file=sys.stderr)
        return CANNOT_CREATE
    except KeyboardInterrupt:
        print("site: interrupted", file=sys.stderr)
        return INTERRUPTED
    for fault in faults:
        print(f"site: {fault}", file=sys.stderr)
    if faults:
        return FAULTY
    print(f"{len(list(out.glob('*.html')))} pages without a fault: open {out / 'index.html'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
