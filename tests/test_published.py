"""What the paper prints: each thing once, with its place, and asked for by someone."""

import pytest

from hrcneuro import published
from hrcneuro.config import settings as config
from hrcneuro.published import MeanSd, Printed
from hrcneuro.report.claims import CLAIMS
from hrcneuro.report.parameters import PARAMETERS, SETUP


def printed(value):
    """Return all that a constant of the module holds, however deep."""
    if isinstance(value, Printed):
        return [value]
    return [one for part in value.values() for one in printed(part)] if isinstance(value, dict) else []


EVERYTHING = [one for name, value in vars(published).items() if name.isupper() for one in printed(value)]


def test_everything_has_a_place_a_quantity_and_a_text():
    assert len(EVERYTHING) > 100
    assert all(one.place and one.quantity and one.text for one in EVERYTHING)


def test_each_thing_stands_in_the_report_exactly_once():
    shown = [one.printed for one in (*CLAIMS, *SETUP, *PARAMETERS)]
    assert len(shown) == len(EVERYTHING)
    assert {id(one) for one in shown} == {id(one) for one in EVERYTHING}


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (MeanSd(52.0, 3.7), "%", "52.0 ± 3.7 %"),
        (MeanSd(611, 43), "each", "611 ± 43 each"),
        ((50.0, 60.5), "%", "50, 60.5 %"),
        (125.0, "Hz", "125 Hz"),
        ("learns nothing", "", "learns nothing"),
    ],
)
def test_text_is_value_and_unit(value, unit, text):
    assert Printed("1", "x", value, unit).text == text
    assert Printed("1", "x", value, unit, words="about that").text == "about that"


def test_table_2_as_printed():
    # Only RR against RH in iC is starred, and it alone lies above the printed chance level.
    above = {(key, name): p.value for key, rates in published.ABOVE_CHANCE.items() for name, p in rates.items()}
    starred = {one for one, yes in above.items() if yes}
    assert starred == {(("iC", "RRvsRH"), name) for name in ("tnr", "tpr", "acc")}
    means = {(key, name): p.value.mean for key, rates in published.TABLE_2.items() for name, p in rates.items()}
    assert {one for one, mean in means.items() if mean > published.CHANCE.value} == starred
    cell = published.TABLE_2["iC", "RRvsRH"]
    assert {name: tuple(rate.value) for name, rate in cell.items()} == {
        "tnr": (57.9, 4.3),
        "tpr": (56.1, 3.2),
        "acc": (57.1, 3.7),
    }


def test_the_default_configuration_is_the_papers():
    sections = config.load(None).sections
    simulate, ersp, robot = sections["simulate"], sections["ersp"], sections["robot"]
    assert (simulate.tnr_hh, simulate.tpr_hr, simulate.tnr_rr, simulate.tpr_rh) == (51.5, 51.4, 57.9, 56.1)
    assert (simulate.alpha, simulate.tau, simulate.episodes, simulate.repetitions) == (0.05, 0.1, 200, 100)
    assert (ersp.low_hz, ersp.high_hz, ersp.low_cycles, ersp.high_cycles) == (2.0, 30.0, 2.0, 10.0)
    assert (robot.cell.tile, robot.cell.near_edge, robot.cell.radius, robot.cell.hover) == (0.07, 0.76, 0.002, 0.02)
    assert config.load(None).study.exclude == ("s07",)
