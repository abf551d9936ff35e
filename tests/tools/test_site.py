"""The documentation as a site: what the pages become, what the check finds, and that the real site has no fault."""

import json
import tomllib

import pytest

from tools.site import __main__ as site
from tools.site import check, pages

pytestmark = pytest.mark.tool

TEXTS = pages.read(site.DOCS)
NAV = pages.navigation(tomllib.loads(site.CONFIG.read_text())["project"]["nav"])


def test_the_navigation_names_every_page_once():
    assert pages.unlisted(NAV, TEXTS) == []


@pytest.mark.parametrize(("named", "there", "word"), [
    (["a.md", "gone.md"], ["a.md"], "gone.md"), (["a.md"], ["a.md", "new.md"], "new.md"),
    (["a.md", "a.md"], ["a.md"], "2 times"),
])  # fmt: skip
def test_a_page_that_is_missing_unlisted_or_listed_twice_is_named(named, there, word):
    (fault,) = pages.unlisted(named, there)
    assert word in fault


def test_every_diagram_of_the_pages_is_drawn_and_no_other():
    wanted = {pages.diagram_name(source) for text in TEXTS.values() for source in pages.diagrams(text)}
    assert {path.name for path in site.DRAWN.glob("*.svg")} == wanted, "run `make site` and commit tools/site/diagrams"


def test_a_diagram_becomes_its_picture_and_a_file_outside_docs_is_copied():
    text = "# Title\n\n```mermaid\ngraph LR\n```\n\n[dbc](../protocol/rover.dbc) and [page](a.md#b)\n"
    made = pages.staged(text)
    assert f"![Diagram: Title](diagrams/{pages.diagram_name('graph LR' + chr(10))})" in made
    assert "](files/protocol/rover.dbc)" in made and "](a.md#b)" in made and "mermaid" not in made
    assert pages.outside([text]) == {"protocol/rover.dbc"}


def test_a_link_that_shows_a_file_name_shows_the_title_of_the_page():
    made = pages.staged("[a.md](a.md), [b.md](b.md), [own words](a.md)", {"a.md": "A title"})
    assert made == "[A title](a.md), [b.md](b.md), [own words](a.md)"


def write(folder, **files):
    for name, text in files.items():
        (folder / name.replace("_", ".")).write_text(text)
    return check.faults(folder)


def test_a_sound_site_has_no_fault(tmp_path):
    assert (
        write(
            tmp_path,
            a_html='<p id="x"><a href="b.html#y">b</a><a href="https://example.org">far</a>',
            b_html='<h2 id="y">y</h2><a href="#y">here</a><link rel="stylesheet" href="s.css">',
            s_css="p { background: url(data:image/png;base64,AA) }",
        )
        == []
    )


@pytest.mark.parametrize(("body", "word"), [
    ('<a href="gone.html">', "gone.html"), ('<a href="#gone">', "#gone"), ('<img src="gone.png">', "gone.png"),
    ('<script src="https://far.example/x.js">', "from the network"),
    ('<link rel="stylesheet" href="//far.example/x.css">', "from the network"),
])  # fmt: skip
def test_a_dead_link_a_missing_place_and_a_load_from_the_network_are_named(tmp_path, body, word):
    found = write(tmp_path, a_html=body)
    assert found and all(fault.startswith("a.html: ") for fault in found) and word in found[0]


def test_a_style_that_loads_a_font_from_the_network_is_named(tmp_path):
    (fault,) = write(tmp_path, a_html="<p>", s_css="@font-face { src: url('https://far.example/f.woff2') }")
    assert fault.startswith("s.css: ") and "from the network" in fault


def test_a_folder_without_pages_is_a_fault(tmp_path):
    assert check.faults(tmp_path) != []


@pytest.fixture(scope="module")
def built(tmp_path_factory):
    out = tmp_path_factory.mktemp("site") / "site"
    assert site.build(site.DOCS, out) == []
    return out


def test_the_site_of_the_real_pages_is_built_without_a_fault(built):
    assert {path.stem for path in built.glob("*.html")} >= {name.removesuffix(".md") for name in TEXTS}
    assert check.faults(built) == []


def test_the_search_finds_words_of_the_pages_without_a_server(built):
    index = json.loads((built / "search.json").read_text())
    assert any("glossary.html" in item["location"] for item in index["items"])
    assert (built / "search.js").is_file() and (built / "iframe-worker.js").is_file()


def test_a_broken_page_leaves_the_site_that_was_there(tmp_path):
    docs, out = tmp_path / "docs", tmp_path / "out" / "site"
    docs.mkdir()
    out.mkdir(parents=True)
    (out / "index.html").write_text("before")
    (docs / "index.md").write_text("# Alone\n")
    assert any("start.md" in fault for fault in site.build(docs, out))
    assert (out / "index.html").read_text() == "before"


def test_a_place_that_cannot_be_written_ends_with_one_line(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert site.main(["--out", str(tmp_path / "file" / "site")]) == site.CANNOT_CREATE
    assert "file" in capsys.readouterr().err
