"""Parts of a page that are made from the code, so that they cannot fall behind it; they read as well without the site.

    python docs/generated.py           # writes them anew into the pages; make docs begins with it

What stands between these two lines of a page is replaced:

    <!-- made from the code: options preprocess -->     options: key, default, range, meaning
    <!-- end of what is made -->

Besides ``options STAGE`` (or a section, such as ``experiment``): ``artifacts STAGE`` (its tables, with columns, units
and meaning, and its figures), ``recipes`` (the built-in decoders) and ``help`` (what every command prints on --help).
"""

from __future__ import annotations

import dataclasses
import importlib
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from hrcneuro import drawings, stages
from hrcneuro.config.reader import allowed_range
from hrcneuro.config.sections import SECTIONS
from hrcneuro.config.text import toml_value
from hrcneuro.contract import Caption, plain

# stage -> unit/file -> where its schema is declared. A test holds this against what a study really writes.
TABLES = {
    "acquire": {"sNN/trials.parquet": "hrcneuro.tables.trials:TRIALS"},
    "preprocess": {
        "sNN/quality.parquet": "hrcneuro.tables.quality:quality_table",
        "sNN/timing.parquet": "hrcneuro.tables.quality:TIMING",
        "sNN/spectrum.parquet": "hrcneuro.tables.quality:SPECTRUM",
    },
    "epoch": {
        "sNN/conditions.parquet": "hrcneuro.tables.epoch:CONDITIONS",
        "sNN/drop_log.parquet": "hrcneuro.tables.epoch:DROP_LOG",
    },
    "erp": {
        "sNN/averages.parquet": "hrcneuro.tables.contrasts:AVERAGES",
        "sNN/strata.parquet": "hrcneuro.tables.contrasts:STRATA",
        "sNN/waveforms.parquet": "hrcneuro.tables.contrasts:WAVEFORMS",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "sNN/erp_image.parquet": "hrcneuro.tables.erp_image:ERP_IMAGE",
        "group/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "group/erp.parquet": "hrcneuro.tables.contrasts:ERP",
        "group/erp_stats.parquet": "hrcneuro.tables.contrasts:ERP_STATS",
        "group/erp_strata.parquet": "hrcneuro.tables.contrasts:ERP_STRATA",
    },
    "ersp": {
        "sNN/ersp.parquet": "hrcneuro.tables.contrasts:ERSP_SUBJECT",
        "sNN/ersp_strata.parquet": "hrcneuro.tables.contrasts:ERSP_STRATA_SUBJECT",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "group/ersp.parquet": "hrcneuro.tables.contrasts:ERSP",
        "group/ersp_stats.parquet": "hrcneuro.tables.contrasts:ERSP_STATS",
        "group/ersp_strata.parquet": "hrcneuro.tables.contrasts:ERSP_STRATA",
    },
    "decode": {
        "sNN/scores.parquet": "hrcneuro.tables.decode:SCORES",
        "sNN/folds.parquet": "hrcneuro.tables.decode:FOLDS",
        "sNN/predictions.parquet": "hrcneuro.tables.decode:PREDICTIONS",
        "sNN/strata.parquet": "hrcneuro.tables.decode:STRATA",
        "sNN/roc.parquet": "hrcneuro.tables.decode:ROC",
        "sNN/patterns.parquet": "hrcneuro.tables.decode:PATTERNS",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "group/table2.parquet": "hrcneuro.tables.decode:TABLE2",
        "group/group_tests.parquet": "hrcneuro.tables.decode:TESTS",
        "group/compared.parquet": "hrcneuro.tables.decode:COMPARED",
        "group/subjects.parquet": "hrcneuro.tables.decode:SUBJECTS",
    },
    "simulate": {
        "group/curves.parquet": "hrcneuro.tables.simulate:CURVES",
        "group/milestones.parquet": "hrcneuro.tables.simulate:MILESTONES",
        "group/relearning.parquet": "hrcneuro.tables.simulate:RELEARNING",
        "group/analytic.parquet": "hrcneuro.tables.simulate:ANALYTIC",
        "group/learners.parquet": "hrcneuro.tables.simulate:LEARNERS",
        "group/learner_curves.parquet": "hrcneuro.tables.simulate:LEARNER_CURVES",
        "group/confound.parquet": "hrcneuro.tables.simulate:CONFOUND",
        "sweep/sweep.parquet": "hrcneuro.tables.simulate:SWEEP",
        "sweep/needed.parquet": "hrcneuro.tables.simulate:NEEDED",
        **{
            f"evidence/{name}.parquet": f"hrcneuro.tables.evidence:{name.upper()}"
            for name in ("sessions", "subjects", "trials", "guesses", "predicted", "design", "partners")
        },
    },
    "rerp": {
        "sNN/rerp.parquet": "hrcneuro.tables.rerp:RERP",
        "sNN/predictors.parquet": "hrcneuro.tables.rerp:PREDICTORS",
        "sNN/parts.parquet": "hrcneuro.tables.rerp:PARTS",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "group/rerp_stats.parquet": "hrcneuro.tables.rerp:RERP_STATS",
        "group/rerp_parts.parquet": "hrcneuro.tables.rerp:RERP_PARTS",
        "group/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
    },
    "transfer": {
        "sNN/trials.parquet": "hrcneuro.tables.transfer:TRIALS",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
        "group/scores.parquet": "hrcneuro.tables.transfer:SCORES",
        "group/curves.parquet": "hrcneuro.tables.transfer:CURVES",
        "group/tests.parquet": "hrcneuro.tables.transfer:TESTS",
        "group/compared.parquet": "hrcneuro.tables.transfer:COMPARED",
    },
    "robot": {
        "sNN/moves.parquet": "hrcneuro.tables.robot:MOVES",
        "sNN/telemetry.parquet": "hrcneuro.tables.robot:TELEMETRY",
        "sNN/timing.parquet": "hrcneuro.tables.robot:TIMING",
        "sNN/reach.parquet": "hrcneuro.tables.robot:REACH",
    },
    "calibrate": {
        "sNN/scores.parquet": "hrcneuro.tables.calibrate:SCORES",
        "sNN/blocks.parquet": "hrcneuro.tables.calibrate:BLOCKS",
        "sNN/strata.parquet": "hrcneuro.tables.calibrate:STRATA",
        "sNN/baselines.parquet": "hrcneuro.tables.calibrate:BASELINES",
        "sNN/trials.parquet": "hrcneuro.tables.calibrate:TRIALS",
        "sNN/patterns.parquet": "hrcneuro.tables.calibrate:PATTERNS",
        "sNN/dropped.parquet": "hrcneuro.tables.calibrate:DROPPED",
        "sNN/channels.parquet": "hrcneuro.tables.contrasts:CHANNELS",
    },
}
PAGES = Path(__file__).parent
_BLOCK = re.compile(
    r"^(<!-- made from the code: (options|artifacts|recipes|help) ?(\w*) -->)$.*?^(<!-- end of what is made -->)$",
    flags=re.M | re.S,
)


def anew(page: str) -> str:
    """Return a page with all that is made from the code made anew."""
    makers = {
        "options": options,
        "artifacts": artifacts,
        "recipes": lambda _: recipes(),
        "help": lambda _: help_texts(),
    }
    return _BLOCK.sub(lambda match: f"{match[1]}\n\n{makers[match[2]](match[3]).strip()}\n\n{match[4]}", page)


def table_of(place: str) -> Any:
    """Return the schema that ``module:NAME`` names; one that depends on the EOG channels is asked for one ``NAME``."""
    module, _, name = place.partition(":")
    found = getattr(importlib.import_module(module), name)
    if not callable(found):
        return found
    return found(["NAME"]) if inspect.signature(found).parameters else found()


def options(stage: str) -> str:
    """Return the options of a stage, or of a section that is none, as a Markdown table."""
    config = SECTIONS[stage].options() if stage in SECTIONS else stages.load(stage).config()
    rows = ["| key | default | allowed | meaning |", "|---|---|---|---|"]
    return "\n".join([*rows, *_rows(config, "")])


def artifacts(stage: str) -> str:
    """Return a stage's tables and figures as Markdown."""
    text = []
    for name, place in TABLES[stage].items():
        table = table_of(place)
        text += [f"### `{name}`", "", f"{_capital(table.row)} (version {table.version}).", ""]
        text += ["| column | type | unit | meaning |", "|---|---|---|---|"]
        text += [f"| `{c}` | {a.type} | {a.unit} | {_cell(a.text)} |" for c, a in table.columns.items()]
        text += [""]
    captions = _captions(stage)
    if captions:
        text += ["### Figures", "", "Drawn from these tables, each as PNG (200 dpi) and as PDF.", ""]
        text += [f"- `{name}`: {caption.text}." for name, caption in captions.items()]
    return "\n".join(text)


def _captions(stage: str) -> dict[str, Caption]:
    """Return file -> caption of the pictures of a stage, the subject's first, what is beside it last."""
    if stage not in drawings.STAGES:
        return {}
    drawn = drawings.load(stage)
    return {
        name: text
        for one in (drawn.subject, drawn.group, *drawn.sides.values())
        if one
        for name, text in one.captions.items()
    }


def recipes() -> str:
    """Return the built-in decoders as a Markdown table."""
    from hrcneuro.decoding.recipes import BUILTIN

    rows = ["| recipe | estimator | features | parameters | source |", "|---|---|---|---|---|"]
    for name, recipe in BUILTIN.items():
        params = ", ".join(f"`{key} = {toml_value(value)}`" for key, value in recipe.params.items())
        rows.append(f"| `{name}` | `{recipe.estimator}` | `{recipe.features}` | {params} | {_cell(recipe.citation)} |")
    return "\n".join(rows)


def help_texts() -> str:
    """Return what every command prints on ``--help``."""
    import typer
    from typer.main import get_command

    from hrcneuro.cli.app import app

    text = []
    # By their names: in which order files declare them depends on who was imported first.
    for words, command in sorted(_commands(get_command(app), ()), key=lambda pair: pair[0]):
        name = " ".join(("hrcneuro", *words))
        context = typer.Context(command, info_name=name, terminal_width=100, max_content_width=100)
        text += [f"## {name}", "", "```text", command.get_help(context).strip(), "```", ""]
    return "\n".join(text)


def _commands(command: Any, words: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Any]]:
    inner = getattr(command, "commands", None)
    if inner is None:
        yield words, command
        return
    for name, one in inner.items():
        yield from _commands(one, (*words, name))


def _rows(config: Any, prefix: str) -> Iterator[str]:
    for f in dataclasses.fields(config):
        value = getattr(config, f.name)
        if dataclasses.is_dataclass(value):
            yield from _rows(value, f"{prefix}{f.name}.")
            continue
        shared = f.metadata.get("shared")
        default = f"of the study: `{shared}`" if shared else f"`{_cell(toml_value(plain(value)), code=True)}`"
        limits = ", ".join(f"`{c}`" for c in f.metadata.get("choices") or () if c)
        if not limits and (f.metadata.get("low") is not None or f.metadata.get("high") is not None):
            limits = f"`{allowed_range(f.name, f.metadata)}`"
        yield f"| `{prefix}{f.name}` | {default} | {_cell(limits, code=True)} | {_cell(f.metadata['help'])} |"


def _cell(text: str, *, code: bool = False) -> str:
    text = text.replace("|", "\\|")
    return text if code or "`" in text else text.replace("*", "\\*").replace("<", "\\<")


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def main() -> None:
    """Write every page anew that has such parts."""
    for path in sorted(PAGES.rglob("*.md")):
        page = path.read_text(encoding="utf-8")
        made = anew(page)
        if made != page:
            path.write_text(made, encoding="utf-8")
            print(f"made anew: {path.relative_to(PAGES)}")


if __name__ == "__main__":
    main()
