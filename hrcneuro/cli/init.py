"""The command init: a new study with a configuration, a README and a .gitignore, that run as they are."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import typer

from hrcneuro.cli.declare import command
from hrcneuro.cli.options import Options

# What a newcomer changes first, with values of a study that is over in a minute or two. Everything else stays the
# paper's; the comments are the options' own, so that they cannot fall behind.
_FIRST: Mapping[str, Mapping[str, Any]] = {
    "study": {"name": "", "subjects": ("s01", "s02", "s03"), "exclude": ()},
    "acquire": {"source": "synthetic", "sfreq": 250.0, "seed": 2023},
    "acquire.session": {"practice_episodes": 1, "blocks": 2, "episodes_per_block": 6},
    "preprocess": {"l_freq": 1.0, "h_freq": 40.0, "sfreq": 128.0},
    "epoch": {"tmin": -0.2, "tmax": 1.2, "reject_uv": 1000.0},
    "erp": {"channel": "Cz", "correction": "max"},
    "decode": {"repeats": 2, "permutations": 19},
    "simulate": {"repetitions": 20, "episodes": 120},
    "robot": {"backend": "sim", "episodes": (1, 2)},
}

_HEAD = """\
# The configuration of this study. Only what differs from the values of Ehrlich et al. 2023 has to be here:
#   hrcneuro config show     every value, its range and where it came from
#   hrcneuro config check    every mistake of this file at once
# As it stands it is a small synthetic study: it shows that all stages work, and its numbers mean nothing.
"""

_OWN = """
# --- Your own recordings (BrainVision, EEGLAB, FIF, EDF/BDF, XDF and more) ----------------------------------------
# Replace the two [acquire] tables above by this one, delete [simulate] and [robot], name subjects and conditions:
#
# [acquire]
# source = "file"
# path = "data/{subject}.vhdr"                          # {subject} stands for each of study.subjects; a BIDS data set
#                                                       # needs source = "bids", its root as path, and conditions
# event_map = { "S  1" = "standard", "S  2" = "target" }  # marker in the file -> name; hrcneuro acquire s01 --inspect
# channel_types = { VEOG = "eog" }                      # names with EOG in them are found without it
#
# [conditions]                                          # name -> query on the trial table
# standard = "event == 'standard'"
# target = "event == 'target'"
#
# [contrasts]                                           # name -> plus, minus
# "target-standard" = ["target", "standard"]
#
# [problems]                                            # what is decoded: class 1, class 2
# "standardVStarget" = ["standard", "target"]
#
# and under [study]: split = ""                         # no column divides the trials into scenarios
# Then hrcneuro run: robot and simulate are left out, as such trials are no moves on the grid.
"""

_README = """\
# {name}

A study for [hrcneuro](https://doi.org/10.1371/journal.pone.0287958). In this folder:

```
hrcneuro run -j 2               # every stage, then results/report.html
hrcneuro status                 # what is fresh, what is stale and why
hrcneuro acquire s01 --inspect  # markers, channels and log, before anything is computed
hrcneuro config show            # every value and its range
```

`hrcneuro.toml` holds what differs from the published study: as it was made, three short synthetic subjects whose
numbers mean nothing. The end of the file shows what to write for recordings of your own.

`cache/` and `results/` are made by hrcneuro and can be deleted at any time; the same command makes them again.

```python
import hrcneuro

study = hrcneuro.open(".")
study.epochs("s01")["before_RH"].average().plot()
study.trials("s01").groupby("case").size()
```
"""

_IGNORE = "/cache/\n/results/\n/recordings/\n/multiverse/\n"


@command(
    "Make a new study that runs as it is: configuration, README, .gitignore.",
    "init mystudy",
    "init studies/second --dry-run",
    name="init",
)
def init(options: Options, folder: Annotated[Path, typer.Argument(help="A folder that is new or empty.")]) -> int:
    """Make a new study that runs as it is."""
    from hrcneuro.cli import bring

    files = create(folder, dry_run=options.dry_run)
    if options.json:
        names = [p.name for p in files]
        print(json.dumps({"command": "init", "ok": True, "folder": str(folder), "files": names}, indent=1))
        return 0
    talk = bring.console(options)
    verb = "would write" if options.dry_run else "wrote"
    talk.say(f"{verb} {', '.join(p.name for p in files)} in {folder}")
    talk.say(f"next: cd {folder} && hrcneuro run")
    return 0


def create(folder: Path, *, dry_run: bool = False) -> list[Path]:
    """Make the study and return its files; ``dry_run`` only checks that the folder is free.

    Raises:
        ConfigError: The folder is a file, holds something already, or cannot be written.
    """
    from hrcneuro.cache.disk import guarded
    from hrcneuro.errors import ConfigError

    with guarded(folder):
        if folder.is_file():
            raise ConfigError(f"{folder} is a file", cure="name a folder that does not exist yet, or an empty one")
        if folder.is_dir() and (inside := sorted(p.name for p in folder.iterdir())):
            some = ", ".join(inside[:3]) + (" …" if len(inside) > 3 else "")
            raise ConfigError(f"{folder} is not empty: it holds {some}", cure="name a new or an empty folder")
        # Of a folder whose name is not in UTF-8 the study takes what can be read.
        name = os.fsencode(folder.absolute().name).decode("utf-8", "replace")
        texts = {
            "hrcneuro.toml": "\n".join([_HEAD, *_tables(name)]) + "\n" + _OWN,
            "README.md": _README.format(name=name),
            ".gitignore": _IGNORE,
        }
        for file, text in texts.items() if not dry_run else ():
            folder.mkdir(parents=True, exist_ok=True)
            (folder / file).write_text(text, encoding="utf-8")
    return [folder / file for file in texts]


def _tables(name: str) -> Iterator[str]:
    import dataclasses

    from hrcneuro import stages
    from hrcneuro.config.settings import StudyOptions
    from hrcneuro.config.text import option_line

    for table, values in _FIRST.items():
        section, _, inner = table.partition(".")
        config = StudyOptions() if section == "study" else stages.load(section).config()
        config = getattr(config, inner) if inner else config
        fields = {f.name: f for f in dataclasses.fields(config)}
        yield f"[{table}]"
        for key, value in values.items():
            yield option_line(fields[key], name if table == "study" and key == "name" else value)
        yield ""
