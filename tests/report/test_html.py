"""The report as one file: it stands alone, says what the Markdown says, and is readable on a phone."""

import base64
import re
from html.parser import HTMLParser

import pytest

import limitsets as ls
from limitsets.face.report.pages import as_html
from limitsets.face.report.writing import FIGURES, write
from tests.browsers import browser

VOID = {"meta", "img", "br", "hr", "link", "input"}


class Reader(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.text, self.images, self.links = [], [], [], []

    def handle_starttag(self, tag, attributes):
        names = dict(attributes)
        self.images += [(names["alt"], names["src"])] if tag == "img" else []
        self.links += [value for name, value in attributes if name in ("href", "src")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "style" not in self.open:
            self.text.append(data)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("report")
    write(ls.analyse("paper-designed", cells=512), place, html=True)
    return place


def test_it_stands_alone_and_has_all_figures(folder):
    reader = Reader()
    reader.feed((folder / "report.html").read_text(encoding="utf-8"))
    assert reader.open == []
    assert all(link.startswith("data:") for link in reader.links)
    assert len(reader.images) == len(FIGURES)
    for caption, source in reader.images:
        assert caption
        assert b"<svg" in base64.b64decode(source.partition(",")[2])


def test_it_says_what_the_markdown_says(folder):
    reader = Reader()
    reader.feed((folder / "report.html").read_text(encoding="utf-8"))
    page = re.sub(r"!\[.*?\]\(.*?\)", "", (folder / "report.md").read_text(encoding="utf-8"))

    def words(text):
        return re.findall(r"[\w.]+", text)

    title = page.splitlines()[0].lstrip("# ")
    assert words(" ".join(reader.text)) == words(title) + words(page)


def test_text_of_a_scene_is_never_markup():
    page = as_html("# a <b> & c\n\n<script>alert(1)</script>\n\n[x](javascript:alert(1))\n", {})
    assert "<script>" not in page
    assert 'href="javascript' not in page
    assert "<title>a &lt;b&gt; &amp; c</title>" in page


@pytest.mark.sweep
@pytest.mark.parametrize("width", [1200, 390])
def test_no_page_is_wider_than_the_screen(width, folder):
    said = []
    with browser() as started:
        page = started.new_page(viewport={"width": width, "height": 800})
        page.on("console", lambda message: said.append(message.text))
        page.on(
            "request", lambda request: said.append(request.url) if request.url.startswith("http") else None
        )
        page.goto((folder / "report.html").as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width
        assert page.evaluate("[...document.images].every(each => each.naturalWidth > 0)")
    assert said == []
