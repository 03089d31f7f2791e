"""What a person expects reaches the robot through the EEG alone: shuffled within actors, it teaches nothing.

A simulated person's expectation goes to the amplifier on a stream of its own, which nothing else reads. Were there any
other way from it, or from the owners of steps, to the learner, decisions would follow the truth without it.
"""

import json
from collections import defaultdict, deque
from pathlib import Path

import numpy as np
import pytest

from hrcneuro.analyses.loop_rows import loop_tables
from hrcneuro.analyses.loop_sessions import loop_sessions
from hrcneuro.cli import bring, closed_sessions, experimenting, onlining
from hrcneuro.cli.amplifying import brain_of, kinds
from hrcneuro.cli.options import Options
from hrcneuro.experiment.learning import Loop
from hrcneuro.experiment.rehearsal import Lab, Rehearsal
from hrcneuro.io.decoders import read_decoder
from hrcneuro.learning import learners
from hrcneuro.learning.loop import LoopModel, simulate_loop
from hrcneuro.learning.loop_decoders import independent
from hrcneuro.learning.loop_scores import accuracy, pooled_takeovers
from hrcneuro.sources.experiments import read

pytest.importorskip("pyxdf", reason="needs the extra xdf")

STUDY = """
[study]
name = "lab"
subjects = ["s01"]
exclude = []

[acquire]
sfreq = 128.0

[acquire.session]
practice_episodes = 0
blocks = 4
episodes_per_block = 5

[acquire.eeg]
dipoles = 20
effect_uv = 60.0

[preprocess]
sfreq = 128.0

[calibrate]
draws = 2

[experiment.closed]
blocks = 1
episodes_per_block = 40
"""
POOL = 20


class Shuffled(Rehearsal):
    """A rehearsal whose amplifier is told of another move of the same actor."""

    def __init__(self, *args, shuffled, **options):
        self._rng, self._pools, self._shuffled = (
            np.random.default_rng(1),
            defaultdict(lambda: deque(maxlen=POOL)),
            shuffled,
        )
        super().__init__(*args, **options)
        send = self._truth.send
        self._truth.send = lambda text, when: send(self._told(text), when)

    def _told(self, text):
        move = json.loads(text)
        pair = move["condition_before"]
        if not self._shuffled or pair is None:
            return text
        pool = self._pools[move["actor"]]
        pool.append(pair)
        return json.dumps(move | {"condition_before": pool[int(self._rng.integers(len(pool)))]})


@pytest.fixture(scope="module")
def lab(hrcneuro, tmp_path_factory):
    folder = tmp_path_factory.mktemp("truth")
    (folder / "lab.toml").write_text(STUDY)
    done = hrcneuro(
        "rehearse", "s01", "--closed", "--config", folder / "lab.toml", "--executor", "serial", "--no-figures",
        "--json", "--set", "experiment.closed.episodes_per_block=1", "--workdir", folder,
    )  # fmt: skip
    assert done.code == 0, done.err
    (decoder,) = Path(done.json["folder"]).glob("cache/calibrate/s01/*/decoder.json")
    return folder, decoder.parent


def played(lab, tmp_path, *, shuffled):
    """Return a session in shadow, in which steps do not depend on what is decided."""
    folder, decoder = lab
    options = Options(config=folder / "lab.toml", workdir=tmp_path)
    given = {"test": ["experiment.human=simulated", "experiment.pace=virtual", "experiment.screen=false",
                      "experiment.loop=closed", "online.mode=shadow", "robot.backend=sim",
                      "record.streams.eeg.sfreq=128"]}  # fmt: skip
    study = bring.settings(options, others=given)
    frozen, about = read_decoder(decoder)
    lines = []
    loop = Loop(frozen, onlining.learner_of(study.live["online"], about), study.live["online"], lines.append)
    setup = experimenting.setup_of(study, "s01", tmp_path)
    laboratory = Lab(brain_of(study, "s01", sitting=1), kinds(), study.live["record"], "", None)
    Shuffled(setup, laboratory, loop, shuffled=shuffled).run()
    place = closed_sessions.Place(1, setup.place / "experiment.jsonl", tmp_path)
    steps, episodes = loop_tables(read(place.experiment)[0], lines, subject="s01", session="1")
    return steps, loop_sessions(steps, episodes)


def followed(steps):
    """Return how far decisions after a robot's move follow what the person expects, in standard errors."""
    after = steps[(steps["before"] == "robot") & steps["predicted"].notna() & (steps["step"].str.len() == 1)]
    said, expects = (after["predicted"] == "human").astype(float), after["owner"] == "human"
    p, n, m = said.mean(), int(expects.sum()), int((~expects).sum())
    return (said[expects].mean() - said[~expects].mean()) / np.sqrt(p * (1 - p) * (1 / n + 1 / m))


def test_shuffled_within_actors_the_truth_teaches_nothing(lab, tmp_path):
    for shuffled in (False, True):
        (tmp_path / str(shuffled)).mkdir()
    plain, learned = played(lab, tmp_path / "False", shuffled=False)
    mixed, nothing = played(lab, tmp_path / "True", shuffled=True)
    # Nobody but the amplifier hears of the difference: the same steps by the same partners.
    for name in ("step", "owner", "actor"):
        assert plain[name].tolist() == mixed[name].tolist()
    assert followed(plain) > 4
    assert abs(followed(mixed)) < 3.3
    # What is learned is what decisions teach that are drawn as often, whatever the truth.
    human, robot = pooled_takeovers(nothing)
    model = LoopModel(learners.kinds(alpha=0.05, ddof=0, horizon=40)["paper"], 0.1, mode="shadow")
    reference = simulate_loop(model, independent(after_human=human, after_robot=robot), sessions=200, seed=3)
    low, high = np.quantile(accuracy(reference, "all")[:, 39], [0.005, 0.995])
    assert low <= accuracy(nothing, "all")[0, -1] <= high
    assert accuracy(learned, "all")[0, -1] > np.median(accuracy(reference, "all")[:, 39])
