"""The page from outside: well-formed, alone, small, honest on what is missing."""

import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import pytest

from hrcneuro.config import settings as config
from hrcneuro.pipeline.item import Item, State
from hrcneuro.pipeline.workdir import FIGURES
from hrcneuro.report import _layout, write_report
from hrcneuro.report.album import Album
from hrcneuro.report.provenance import plain

ROOT = Path(__file__).parents[2]
VOID = {"meta", "link", "img", "br", "hr"}


class Reader(HTMLParser):
    """Collects anchors, links, sources and what is not closed."""

    def __init__(self, text):
        super().__init__()
        self.ids, self.targets, self.sources, self.open, self.faults = [], [], [], [], []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        at = dict(attrs)
        self.ids += [at["id"]] if "id" in at else []
        self.targets += [at["href"]] if tag == "a" else []
        self.sources += [at[n] for n in ("src", "href", "srcset", "poster", "data") if n in at and tag != "a"]
        if tag == "img" and not at.get("alt"):
            self.faults.append("a picture without text")
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(f"</{tag}>")


@pytest.fixture(scope="module")
def written(smoke_items, tmp_path_factory):
    settings = config.load(ROOT / "configs/smoke.toml")
    path = tmp_path_factory.mktemp("report") / "report.html"
    write_report(settings, smoke_items, path)
    return settings, smoke_items, path


@pytest.fixture(scope="module")
def page(written):
    return written[2].read_text(encoding="utf-8")


def test_page_is_well_formed_and_every_link_leads_somewhere(page):
    found = Reader(page)
    assert found.faults == []
    assert found.open == []
    assert len(found.ids) == len(set(found.ids))
    inside = [t.removeprefix("#") for t in found.targets if t.startswith("#")]
    assert len(inside) > 20
    assert set(inside) <= set(found.ids)
    assert {t for t in found.targets if not t.startswith("#")} == {"https://doi.org/10.1371/journal.pone.0287958"}


def test_page_loads_nothing_from_outside(page):
    sources = Reader(page).sources
    assert sources
    assert all(s.startswith("data:") for s in sources)
    style = page[page.index("<style>") : page.index("</style>")]
    assert "url(" not in style
    assert "@import" not in style


def test_page_holds_the_papers_figures_and_says_what_is_synthetic(page):
    found = Reader(page)
    for anchor in ("fig2", "fig3", "simulate-group-fig4", "confound_panel", "decode-group-decoding", "quality_group"):
        assert anchor in found.ids
    assert page.index("<nav") < page.index("SYNTHETIC") < page.index("id='task'") < page.index("id='published'")


def test_page_draws_the_task_and_explains_its_words(page):
    found = Reader(page)
    assert page.count("<svg") == 2
    assert {"task-sC", "task-iC", "glossary", "verdicts"} <= set(found.ids)
    for term in ("sc", "rh", "tr-1", "tnr", "lobo"):
        assert f"term-{term}" in found.ids
        assert f"#term-{term}" in found.targets


def test_the_contents_come_first_and_dark_mode_spares_print(page):
    style = page[page.index("<style>") : page.index("</style>")]
    assert "position: sticky" in style
    assert "@media screen and (prefers-color-scheme: dark)" in style
    assert "<span class='scrolls'>Wider than this screen: it scrolls sideways. </span>" in page


def test_page_names_no_path_of_the_machine(page, smoke):
    text = re.sub(r"data:[^']*", "", page)
    assert str(ROOT) not in text
    assert str(smoke) not in text
    assert str(Path.home()) not in text


def test_page_is_small(written):
    # Three subjects; twelve must stay below 25 MB.
    assert written[2].stat().st_size < 10_000_000


def test_a_smoke_study_claims_no_agreement_on_brains(page):
    table = page[page.index("id='published'") : page.index("</section>", page.index("id='published'"))]
    brain = table[table.index("Signal quality") : table.index("The robot that learns")]
    assert "not testable" in brain
    assert "class='not-testable'" in brain
    assert "class='agrees" not in brain
    assert "class='by-construction'" not in brain


def test_the_page_says_how_much_of_table_2_a_guess_would_agree_with(page):
    said = re.findall(r"at exactly 50 % would agree with (\d+) of the 12 numbers of Table 2", page)
    assert len(said) == 2  # beside the verdicts and beside the table
    assert len(set(said)) == 1


def test_figures_lie_beside_the_page(written):
    folder = written[2].parent / "figures"
    for name in ("fig2", "fig3", "confound_panel", "moves", "quality_group"):
        assert (folder / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        assert (folder / f"{name}.pdf").read_bytes()[:4] == b"%PDF"
    assert (folder / "simulate_fig4.png").is_file()
    assert (folder / "s01" / "robot_robot.png").is_file()
    assert {p.stem for p in folder.rglob("*.png")} == {p.stem for p in folder.rglob("*.pdf")}


def test_an_unchanged_report_is_left_alone_and_a_changed_one_redraws_only_what_changed(written):
    settings, items, path = written
    page, figure = path.stat().st_mtime_ns, (path.parent / "figures/fig2.png").stat().st_mtime_ns
    write_report(settings, items, path)
    assert path.stat().st_mtime_ns == page
    fewer = [i for i in items if (i.stage.removesuffix(FIGURES), i.unit) != ("robot", "s03")]
    write_report(settings, fewer, path)
    assert path.stat().st_mtime_ns != page
    assert (path.parent / "figures/fig2.png").stat().st_mtime_ns == figure
    assert not list((path.parent / "figures/s03").glob("robot_robot.*"))


def test_the_same_results_give_the_same_bytes(written, tmp_path):
    settings, items, _ = written
    first, second = (write_report(settings, items, tmp_path / name / "report.html") for name in ("first", "second"))
    assert first.read_bytes() == second.read_bytes()


def test_a_changed_template_style_or_script_writes_the_page_anew():
    package = ROOT / "hrcneuro/report"
    assert set(_layout()) == {p for p in package.rglob("*") if p.suffix in (".html", ".css", ".js")}


def test_what_failed_or_has_not_run_is_said(written, tmp_path):
    settings, items, _ = written
    left = [i for i in items if i.stage in ("acquire", "simulate")]
    failed = [Item("preprocess", "s02", state=State.FAILED, why=["/some/where/s02_raw.fif is truncated"])]
    text = write_report(settings, [*left, *failed], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "preprocess s02: failed (s02_raw.fif is truncated)" in text
    assert "not run" in text
    assert "id='fig2'" not in text
    found = Reader(text)
    assert {t.removeprefix("#") for t in found.targets if t.startswith("#")} <= set(found.ids)


def test_an_album_over_budget_gives_up_the_subjects_pictures_first(written, tmp_path):
    pictures = sorted((written[2].parent / "figures").glob("*.png"))[:3]
    whole, small = Album(), Album(budget=1)
    for album in (whole, small):
        page = "".join(album.mark(p, subject=i > 0) for i, p in enumerate(pictures))
        album.text = album.fill(page)
    assert whole.text.count("data:image/png") == 3
    assert len(small.text) < len(whole.text)
    assert small.text.count("data:image/gif") == 2


def test_paths_are_cut_to_their_last_part():
    assert plain(["/home/someone/data/s01.vhdr cannot be read"]) == ["s01.vhdr cannot be read"]
    assert plain([r"C:\Users\someone\s01.vhdr is empty"]) == ["s01.vhdr is empty"]
    assert plain(["1/2 of 3 m/s"]) == ["1/2 of 3 m/s"]


def test_a_browser_has_nothing_to_complain_of_and_marks_the_tables_that_scroll(written, tmp_path):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium here")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--dump-dom"]
    command += [f"--user-data-dir={tmp_path}", "--no-first-run", "--disable-background-networking", "--disable-sync"]
    command += ["--window-size=600,900"]
    done = subprocess.run(
        [*command, written[2].as_uri()], capture_output=True, text=True, timeout=120, check=False, encoding="utf-8"
    )
    assert "</html>" in done.stdout
    assert [line for line in done.stderr.splitlines() if "CONSOLE" in line] == []
    tables = re.findall(r'<div class="(wide[^"]*)"><table[^>]*>\s*<thead><tr>((?:<th>.*?</th>)*)', done.stdout)
    assert [kind for kind, head in tables if "p, TNR" in head] == ["wide over"]
    assert [kind for kind, head in tables if "a trial lasts" not in head and "channels" in head] == ["wide"]


def test_a_page_without_contents_has_the_whole_width(tmp_path):
    browser = shutil.which("chromium") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium here")
    style = (ROOT / "hrcneuro/report/page.css").read_text(encoding="utf-8")
    tell = "document.body.dataset.width = document.querySelector('main').clientWidth"
    page = tmp_path / "page.html"
    page.write_text(f"<!doctype html><style>{style}</style><body><main>words</main><script>{tell}</script></body>")
    command = [browser, "--headless", "--no-sandbox", "--disable-gpu", "--dump-dom", "--window-size=1400,900"]
    command += [f"--user-data-dir={tmp_path}", "--no-first-run", "--disable-background-networking", "--disable-sync"]
    done = subprocess.run([*command, page.as_uri()], capture_output=True, text=True, timeout=120, check=False)
    assert int(re.findall(r'data-width="(\d+)"', done.stdout)[0]) > 900


def test_one_subject_is_not_shown_twice(written, tmp_path):
    items = [item for item in written[1] if item.unit in ("s01", "group")]
    path = write_report(
        config.load(ROOT / "configs/smoke.toml", ["study.subjects=['s01']"]), items, tmp_path / "r.html"
    )
    found = Reader(path.read_text(encoding="utf-8"))
    for stage in ("erp", "ersp"):
        assert f"{stage}-s01-{stage}_subject" in found.ids
        assert f"{stage}-group-{stage}" not in found.ids
        assert f"{stage}-group-{stage}_scenarios" in found.ids
    assert {t.removeprefix("#") for t in found.targets if t.startswith("#")} <= set(found.ids)


def test_a_report_that_is_not_whole_says_in_its_head_what_is_missing(written, page, tmp_path):
    settings, items, _ = written
    assert "Not whole" not in page
    left = [i for i in items if i.stage == "acquire" and i.unit == "s01"]
    text = write_report(settings, left, tmp_path / "report.html").read_text(encoding="utf-8")
    head = text[text.index("<header") : text.index("</header>")]
    assert "24 of 25 results of this configuration are missing: acquire s02, s03; preprocess s01, s02, s03; " in head
    assert "and of 5 more stages. hrcneuro run, with the same --config and --set, makes them" in head
    assert Reader(text).faults == []


def test_rows_that_differ_without_simulated_data_are_named_in_whole_sentences(page):
    head = page[page.index("<header") : page.index("</header>")]
    (said,) = re.findall(r"<p>(The other )?(\d+) rows? .*?rest on simulated data: (.*?)</p>", head)
    assert int(said[1]) == len(said[2].partition(". What was wanted")[0].split("; "))
    assert "differ and do not rest" in head or "that differ do" in head


def test_what_is_missing_of_many_subjects_is_one_line_a_reason(written, tmp_path):
    settings, items, _ = written
    left = [i for i in items if i.stage == "acquire"]
    units = [f"s{i:02d}" for i in range(1, 13)]
    missing = [Item("erp", u, state=State.WOULD_RUN, why=["never run"]) for u in units]
    why = [f"inputs: erp of {u} would run" for u in units]
    group = Item("erp", "group", state=State.WOULD_RUN, why=why)
    text = write_report(settings, [*left, *missing, group], tmp_path / "report.html").read_text(encoding="utf-8")
    assert "erp s01 … s12, 12 units: has not run with these settings, data and code (never run)" in text
    assert text.count("inputs: erp would run") == 1
