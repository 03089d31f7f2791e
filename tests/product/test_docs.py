"""The documentation: the site builds without a warning, every link leads somewhere, the tutorial does what it says."""

import html.parser
import importlib.util
import re
import shlex
import subprocess
import sys
import urllib.parse

import pytest
from commands import COMMANDS
from tiny_study import ROOT
from transcripts import blocks, printed, steps

DATA = ROOT.parent / "shared" / "data" / "HRC_neurobased_taskplanning"
TUTORIAL = ROOT / "docs" / "start" / "tutorial.md"


class Page(html.parser.HTMLParser):
    """The links and anchors of a page."""

    def __init__(self, path):
        super().__init__()
        self.links, self.anchors = [], set()
        self.feed(path.read_text())

    def handle_starttag(self, tag, attrs):
        found = dict(attrs)
        self.anchors |= {found[key] for key in ("id", "name") if found.get(key)}
        self.links += [found[key] for key in ("href", "src") if found.get(key)]


@pytest.fixture(scope="module")
def generated():
    """The module that makes parts of pages from the code."""
    spec = importlib.util.spec_from_file_location("generated", ROOT / "docs" / "generated.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_site_builds_strictly_and_no_link_is_broken(tmp_path):
    pytest.importorskip("sphinx", reason="needs the extra docs")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-d", tmp_path / "trees"]
    done = subprocess.run([*command, ROOT / "docs", tmp_path / "site"], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    pages = {path.resolve(): Page(path) for path in (tmp_path / "site").rglob("*.html")}
    assert len(pages) > 15
    broken, outside = [], set()
    for path, page in pages.items():
        for link in page.links:
            parts = urllib.parse.urlsplit(link)
            if parts.scheme:
                outside.add(parts.scheme)
                continue
            target = (path.parent / urllib.parse.unquote(parts.path)).resolve() if parts.path else path
            anchor = urllib.parse.unquote(parts.fragment)
            if not target.exists() or (anchor and target in pages and anchor not in pages[target].anchors):
                broken.append(f"{path.name}: {link}")
    assert broken == []
    assert outside <= {"https", "mailto", "data"}


@pytest.mark.parametrize("name", ["CONTRIBUTING.md", "CHANGELOG.md", "README.md"])
def test_links_of_the_pages_beside_the_site_lead_somewhere(name):
    text = re.sub(r"```.*?```", "", (ROOT / name).read_text(), flags=re.S)
    links = [link for link in re.findall(r"\]\(([^)]+)\)", text) if not link.startswith(("http", "mailto:"))]
    assert [link for link in links if not (ROOT / link.partition("#")[0]).exists()] == []


def test_what_is_made_from_the_code_is_up_to_date(generated):
    pages = {path: path.read_text() for path in sorted((ROOT / "docs").rglob("*.md"))}
    assert sum("<!-- made from the code" in page for page in pages.values()) == 15
    behind = [path.name for path, page in pages.items() if generated.anew(page) != page]
    assert behind == [], "python docs/generated.py writes them anew"


def test_every_option_is_documented(generated):
    import dataclasses

    from hrcneuro import stages

    for stage in stages.NAMES:
        page = (ROOT / "docs" / "stages" / f"{stage}.md").read_text()
        assert f"<!-- made from the code: options {stage} -->" in page
        assert f"<!-- made from the code: artifacts {stage} -->" in page
        table = generated.options(stage)
        assert all(f"| `{f.name}" in table for f in dataclasses.fields(stages.load(stage).config))


def test_the_decoders_and_what_they_see_are_documented(generated):
    from hrcneuro.decoding import recipes
    from hrcneuro.decoding.features import WINDOWS_S

    page = (ROOT / "docs" / "stages" / "decode.md").read_text()
    windows = ", ".join(f"{1000 * start:g}-{1000 * end:g}" for start, end in WINDOWS_S)
    assert windows in page.replace("then ", "")
    for features in recipes.FEATURES:
        row = next(line for line in page.splitlines() if line.startswith(f"| `{features}` |"))
        for estimator in recipes.ESTIMATORS:
            params = {"n_times": recipes.N_STEPS} if estimator == "toeplitz_lda" else {}
            fits = not recipes.misfits(recipes.Recipe(estimator, features, params))
            assert (f"`{estimator}`" in row) == fits
    assert all(f"- `{estimator}`: " in page for estimator in recipes.ESTIMATORS)
    assert "<!-- made from the code: recipes -->" in page
    assert all(f"| `{name}` |" in generated.recipes() for name in recipes.BUILTIN)


def test_the_documented_tables_are_those_that_a_study_writes(generated, smoke):
    from hrcneuro import stages
    from hrcneuro.io.tables import describe

    written = {}
    for path in sorted(smoke.glob("cache/*/*/*/*.parquet")):
        stage, unit = path.parts[-4:-2]
        # A table that is made with its picture lies beside it, and is the stage's for people.
        stage = stage.removesuffix(".figures")
        place = f"{unit if unit in ('group', 'sweep', 'evidence') else 'sNN'}/{path.name}"
        if not path.name.startswith("truth_"):
            written.setdefault(stage, {})[place] = describe(path)
    # Another test may have swept in the same study, or not; a part of a sweep is documented as the whole.
    written["simulate"].pop("sNN/sweep.parquet", None)
    beside = ("sweep/", "evidence/")
    optional = {"simulate": {name for name in generated.TABLES["simulate"] if name.startswith(beside)}}
    # What a study consists of only where it names it has a test of its own.
    on_demand = [stage for stage in generated.TABLES if stages.load(stage).on_demand]
    for stage, tables in generated.TABLES.items():
        if stage in on_demand:
            continue
        assert set(tables) - optional.get(stage, set()) == set(written[stage]) - optional.get(stage, set())
        for place, found in written[stage].items():
            declared = generated.table_of(tables[place])
            assert (declared.version, declared.row) == (found.version, found.row), place
            told = {re.sub("weight_.*", "weight", n): (c.unit, c.text) for n, c in declared.columns.items()}
            real = {re.sub("weight_.*", "weight", n): (c.unit, c.text) for n, c in found.columns.items()}
            assert {n: u for n, (u, _) in told.items()} == {n: u for n, (u, _) in real.items()}, place


def test_help_of_every_command_is_on_the_page(generated):
    text = generated.help_texts()
    for words in COMMANDS:
        assert f"## hrcneuro {' '.join(words)}\n" in text


@pytest.mark.parametrize("part", ["Install", "Part 1", "Part 2", "Part 3"])
def test_the_tutorial_does_what_it_says(hrcneuro, tmp_path, part):
    if part == "Part 2" and not DATA.is_dir():
        pytest.skip("needs the authors' logs")
    if part == "Part 3":
        pytest.importorskip("pybv", reason="needs the extra bids")
        pytest.importorskip("mne_bids", reason="needs the extra bids")
    (tmp_path / "docs").symlink_to(ROOT / "docs")
    (tmp_path / DATA.name).symlink_to(DATA)
    folder, typed = tmp_path, 0
    for language, content in blocks(TUTORIAL, part):
        if language == "toml":
            (folder / "hrcneuro.toml").write_text(content)
        elif language == "python":
            command = [sys.executable, "-c", content]
            done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stderr
            assert re.search(r"\d+ % correct; guessing reaches \d+ %", done.stdout)
        elif language == "console":
            for command, lines in steps(content):
                typed += 1
                name, *arguments = shlex.split(command)
                if name == "cd":
                    folder = folder / arguments[0]
                    continue
                code, text = enter(hrcneuro, name, arguments, folder)
                assert (code == 0) == (not any(line.startswith("error:") for line in lines)), f"{command}\n{text}"
                missing = [line for line in lines if not printed(line, text)]
                assert missing == [], f"{command}\n{text}"
    assert typed


def enter(hrcneuro, name, arguments, folder):
    """Run one command of the tutorial; return its exit code and all that it printed."""
    if name == "python":
        command = [sys.executable, *arguments]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
        return done.returncode, done.stdout + done.stderr
    assert name == "hrcneuro"
    # The whole run of the synthetic study is the smoke study's, which other tests run.
    planned = arguments[0] == "run" and folder.name == "mystudy"
    done = hrcneuro(*arguments, *(["--dry-run"] if planned else []), cwd=folder)
    return done.code, done.out + done.err
