"""The pages: what they show runs, and their links lead somewhere."""

import importlib.util
import re
import sys
from pathlib import Path

import pytest

from marks import slow
from places import REPOSITORY

DOCS = REPOSITORY / "docs"
LINK = re.compile(r"\]\((?!https?:|mailto:)([^)#\s]*)(?:#([^)\s]+))?\)")
CODE = re.compile(r"^```.*?^```$", re.MULTILINE | re.DOTALL)
HEADING = re.compile(r"^#+ (.*)$", re.MULTILINE)
LARGEST_FIGURE = 100_000  # bytes of an SVG


def _load(name):
    spec = importlib.util.spec_from_file_location(name, DOCS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


pages = _load("pages")
PAGES = {page.name: page for page in pages.PAGES}
RUN = [name for name, page in PAGES.items()
       if any(each.kind in ("python", "sh") for each in pages.blocks_of(page))]  # fmt: skip


@pytest.fixture(scope="module")
def runner(tmp_path_factory):
    return pages.Runner(tmp_path_factory.mktemp("pages"))


@pytest.mark.parametrize("name", [n if n == "README.md" else slow(n) for n in RUN])
def test_what_a_page_shows_runs(runner, name, monkeypatch):
    monkeypatch.setattr("os.cpu_count", lambda: 1)  # others would load again what is loaded here
    runner.run(PAGES[name])


@pytest.mark.slow
@pytest.mark.parametrize("name", RUN)
def test_what_a_page_shows_runs_with_what_is_slow(tmp_path, name):
    if all(block.mark != "slow" for block in pages.blocks_of(PAGES[name])):
        pytest.skip("nothing in it is slow")
    pages.Runner(tmp_path, slow=True).run(PAGES[name])


def test_the_first_page_is_short():
    assert len((REPOSITORY / "README.md").read_text().splitlines()) <= 120


def _anchors(text):
    """As GitHub and the site make them of headings."""
    titles = HEADING.findall(CODE.sub("", text))
    plain = (re.sub(r"[^\w\- ]", "", title.lower()) for title in titles)
    return {title.strip().replace(" ", "-") for title in plain}


@pytest.mark.parametrize("name", [*PAGES, "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md"])
def test_links_lead_somewhere(name):
    page = PAGES.get(name, REPOSITORY / name)
    for target, anchor in LINK.findall(CODE.sub("", page.read_text(encoding="utf-8"))):
        path = (page.parent / target).resolve() if target else page
        assert path.exists(), target
        if anchor:
            assert anchor in _anchors(path.read_text(encoding="utf-8")), f"{target}#{anchor}"


@pytest.mark.parametrize("name", PAGES)
def test_figures_are_small_and_made_by_what_the_page_shows(name):
    text = PAGES[name].read_text(encoding="utf-8")
    for figure in re.findall(r"!\[[^\]]*\]\((?:docs/)?img/([\w-]+\.svg)\)", text):
        assert (DOCS / "img" / figure).stat().st_size < LARGEST_FIGURE
        made = f'savefig("{figure}")', f"python docs/{Path(figure).stem}.py"
        assert any(each in text for each in made)


@pytest.mark.parametrize("name", PAGES)
def test_files_of_the_source_are_called_so(name):
    text = PAGES[name].read_text(encoding="utf-8")
    if re.search(r"\b(examples|benchmarks|tests)/|^pytest ", text, re.MULTILINE):
        assert "source checkout" in text


def test_every_page_is_on_the_site():
    listed = set(re.findall(r"^[\w-]+$", (DOCS / "index.md").read_text(), re.MULTILINE))
    assert {page.stem for page in DOCS.glob("*.md")} - {"index"} <= listed


def test_every_room_of_the_reference_has_a_title(monkeypatch):
    monkeypatch.setattr(sys, "path", sys.path[:])
    conf = _load("conf")
    rooms = conf.public_names(REPOSITORY / "src" / "gmwm" / "__init__.pyi")
    assert set(rooms) <= set(conf.ROOMS)
