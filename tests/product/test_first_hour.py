"""The first hour as its page shows it: the program installed from a wheel, in an empty folder, without repository."""

import os
import re
import shutil
from pathlib import Path

import pytest
from first_hour import DATA, PAGE, PARTS, entered, provide
from tiny_study import ROOT
from transcripts import blocks, printed, steps
from wheel import enter, installed

# Of README.md, with the reason why the page does not show it.
ELSEWHERE = {
    "make all": "of the repository, and long",
    "make test": "of the repository",
    ". .venv/bin/activate": "of the repository",
    "hrcneuro acquire s01 --inspect --set acquire.source=dataset": "needs the authors' EEG",
    "hrcneuro run --set acquire.source=dataset": "needs the authors' EEG",
    "hrcneuro --install-completion": "changes the shell's startup file",
    **dict.fromkeys(
        ("hrcneuro amp", "hrcneuro record", "hrcneuro timing"), "in real time, and in terminals of their own"
    ),
    "hrcneuro experiment": "needs a person at a window",
    "hrcneuro rehearse": "a whole session; test_rehearse.py rehearses a small one",
}


@pytest.fixture(scope="module")
def programs(tmp_path_factory):
    """The folder of the installed program."""
    return installed(tmp_path_factory.mktemp("installed"))


def test_the_installed_program_is_not_the_repositorys(programs, tmp_path):
    code, text = enter("python -c 'import hrcneuro; print(hrcneuro.__file__)'", tmp_path, programs)
    assert code == 0
    assert Path(text.strip()).is_relative_to(programs.parent)


# What takes long: the new study finds it in its cache, computed by the repository's program.
GIVEN = ("ersp", "erp", "decode", "erp.figures", "ersp.figures", "decode.figures", "simulate.figures", "robot.figures")


def link(source, target):
    """Link a file, or copy it where the target lies on another file system."""
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def begin(command, folder, programs, smoke):
    """Run ``hrcneuro init NAME && … && hrcneuro run``; return what :func:`enter` does, as if all had been computed."""
    init, rest = command.split(" && ", 1)
    code, said = enter(init, folder, programs)
    assert code == 0, said
    taken = {False: 0, True: 0}
    for name in GIVEN:
        place = folder / init.split()[-1] / "cache" / name
        shutil.copytree(smoke / "cache" / name, place, copy_function=link)
        taken[name.endswith(".figures")] += len(list(place.iterdir()))
    code, text = enter(rest, folder, programs)
    # The study of init is the smoke study: whoever computes it, in whatever folder, its keys are the same.
    counts = re.search(r"^run: (\d+) fresh, (\d+) ran; pictures: (\d+) fresh, (\d+) ran$", text, flags=re.M)
    assert counts, text
    fresh, ran, there, drawn = map(int, counts.groups())
    assert (fresh, there) == (taken[False], taken[True])
    assert min(ran, drawn) > 0
    return code, f"{said}{text}run: {ran + fresh} ran; pictures: {drawn + there} ran\n"


@pytest.mark.parametrize("part", PARTS)
def test_the_first_hour_prints_what_the_page_shows(programs, request, tmp_path, part):
    """``python tests/product/first_hour.py`` writes the page anew."""
    if PARTS[part] and not (DATA / PARTS[part]).is_dir():
        pytest.skip(f"needs {PARTS[part]}")
    provide(part, tmp_path)
    folder = tmp_path
    for language, content in blocks(PAGE, part):
        if language == "python":
            (folder / "notebook.py").write_text(content)
            code, text = enter("python notebook.py", folder, programs)
            assert code == 0, text
        for command, lines in steps(content) if language == "console" else ():
            if command.startswith("hrcneuro init"):
                code, text = begin(command, folder, programs, request.getfixturevalue("smoke"))
            else:
                code, text = enter(command, folder, programs)
            assert code == 0, f"{command}\n{text}"
            missing = [line for line in lines if not printed(line, text)]
            assert missing == [], f"{command}\n{text}"
            folder = entered(command, folder)


def test_the_page_shows_every_command_of_the_readme():
    shown = {command.partition("  #")[0].strip() for _, text in blocks(PAGE) for command, _ in steps(text)}
    lines = [line for language, text in blocks(ROOT / "README.md") if not language for line in text.splitlines()]
    typed = {line.partition("  #")[0].strip() for line in lines}
    left = {line for line in typed - shown if not line.startswith(tuple(ELSEWHERE))}
    assert left == set()
    assert all(any(line.startswith(one) for line in typed) for one in ELSEWHERE)
