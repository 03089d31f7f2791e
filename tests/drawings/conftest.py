"""Artifacts of small studies, from which pictures are drawn."""

import epoch_factory
import pytest

from hrcneuro import drawings
from hrcneuro.contract import Inputs, chosen


@pytest.fixture(scope="session")
def study():
    """Return a function that runs erp or ersp on subjects and on the group, and returns unit -> folder."""

    def run(folder, stage, config, n_subjects, **options):
        folders = {}
        for i in range(n_subjects):
            unit = f"s{i + 1:02d}"
            epoch_factory.write_subject(folder / "epoch" / unit, unit, **{"seed": i, **options})
            folders[unit] = folder / stage.STAGE.name / unit
            folders[unit].mkdir(parents=True)
            stage.run(config, Inputs.of(unit, epoch=folder / "epoch" / unit), folders[unit])
        group = folder / stage.STAGE.name / "group"
        group.mkdir()
        stage.run_group(config, Inputs.of("group", **{stage.STAGE.name: dict(folders)}), group)
        return folders | {"group": group}

    return run


@pytest.fixture(scope="session")
def draw():
    """Return a function that draws a unit's pictures from folders, with the options that the drawing names."""

    def run(name, unit, out, sections, **folders):
        drawn = drawings.load(name)
        drawing = drawn.group if unit == "group" else drawn.subject
        out.mkdir(parents=True, exist_ok=True)
        drawing.draw(chosen(sections, drawing.options), Inputs.of(unit, **folders), out)
        assert {path.name for path in out.glob("*.png")} <= set(drawing.captions)
        return {path.stem for path in out.glob("*.png")}

    return run


@pytest.fixture
def figures(monkeypatch):
    """Keep the figures that would be saved, without saving: picture's name -> figure."""
    from hrcneuro.figures import erp, erp_image, ersp, style

    kept = {}
    for module in (erp, erp_image, ersp, style):
        monkeypatch.setattr(module, "save", lambda figure, path: kept.update({path.name: figure}))
    return kept


@pytest.fixture(scope="session")
def foot():
    """Return a function that tells what is written beside a figure's axes: its titles and its foot."""
    return lambda figure: " ".join(text.get_text().replace("\n", " ") for text in figure.texts)
