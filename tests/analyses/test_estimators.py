"""Estimators by import path: what enters the key, what is refused, and that a changed file is read anew."""

import numpy as np
import pytest

from hrcneuro.analyses import estimators
from hrcneuro.contract import params
from hrcneuro.decoding import decoders
from hrcneuro.decoding.recipes import Recipe, misfits
from hrcneuro.decoding.refusals import EstimatorError
from hrcneuro.errors import ConfigError
from hrcneuro.stages import decode

TIMES_S = np.arange(-13, 77) / 64
OWN = """
from helper import SHRINKAGE
from sklearn.discriminant_analysis import LinearDiscriminantAnalysis

def shrunk(solver="lsqr"):
    return LinearDiscriminantAnalysis(solver=solver, shrinkage=SHRINKAGE)

class NoScores:
    def fit(self, X, y):
        return self
    def get_params(self, deep=True):
        return {}
"""


@pytest.fixture
def own(tmp_path):
    """A file of the user's own, which imports another one; a third is not imported."""
    (tmp_path / "mine_of_a_test.py").write_text(OWN)
    (tmp_path / "helper.py").write_text("SHRINKAGE = 0.25\n")
    (tmp_path / "unrelated.py").write_text("x = 1\n")
    return tmp_path / "mine_of_a_test.py"


def recipe(own, name="shrunk", **given):
    return Recipe(f"mine_of_a_test.{name}", file=str(own), params=given)


def epochs(n=60):
    rng = np.random.default_rng(4)
    labels = np.arange(n) % 2 == 1
    data = rng.normal(0, 5, (n, 3, len(TIMES_S)))
    data[:, 1] += 6 * labels[:, None] * ((TIMES_S >= 0.3) & (TIMES_S < 0.4))
    return data, labels


def scores(one):
    data, labels = epochs()
    folds = np.arange(len(labels)) // 2 % 4
    splits = [decoders.Split(0, f, np.flatnonzero(folds != f), np.flatnonzero(folds == f)) for f in range(4)]
    foreign = estimators.makers({"x": one}, seed=3) if one.foreign else {}
    made = decoders.Decoders({"x": one}, epochs_uv=lambda rows: data[rows], times_s=TIMES_S, foreign=foreign)
    ((_, score, _),) = made.of(made.features_of(np.arange(len(labels))))
    return np.concatenate(score(labels, splits)), np.concatenate([labels[s.test] for s in splits])


def test_an_import_path_is_the_estimator_itself():
    # scikit-learn's LDA with Ledoit and Wolf's rule is what the built-in recipe makes.
    options = {"solver": "lsqr", "shrinkage": "auto"}
    theirs, _ = scores(Recipe("sklearn.discriminant_analysis.LinearDiscriminantAnalysis", params=options))
    np.testing.assert_array_equal(theirs, scores(Recipe("shrinkage_lda"))[0])


@pytest.mark.parametrize("path", ["sklearn.svm.SVC", "sklearn.ensemble.RandomForestClassifier"])
def test_one_that_gives_decisions_and_one_that_gives_probabilities_find_the_effect_and_repeat_themselves(path):
    once, labels = scores(Recipe(path))
    assert np.mean((once > 0) == labels) > 0.7
    np.testing.assert_array_equal(once, scores(Recipe(path))[0])


def test_a_recipe_sees_the_windows_that_it_names():
    late, labels = scores(Recipe("shrinkage_lda", windows_s=((0.3, 0.4),)))
    early, _ = scores(Recipe("shrinkage_lda", windows_s=((0.1, 0.2),)))
    assert np.mean((late > 0) == labels) > 0.8 > np.mean((early > 0) == labels)


def test_the_files_are_what_is_imported_and_nothing_else(own):
    assert set(estimators.files(own)) == {"mine_of_a_test.py", "helper.py"}
    (own.parent / "kit").mkdir()
    (own.parent / "kit" / "__init__.py").write_text("from . import parts\n")
    (own.parent / "kit" / "parts.py").write_text("import numpy\n")
    own.write_text("import kit\n" + OWN)
    assert set(estimators.files(own)) == {"mine_of_a_test.py", "helper.py", "kit/__init__.py", "kit/parts.py"}


def test_a_file_that_has_changed_is_read_anew(own):
    assert estimators.maker(recipe(own), seed=1)().shrinkage == 0.25
    (own.parent / "helper.py").write_text("SHRINKAGE = 0.75\n")
    assert estimators.maker(recipe(own), seed=1)().shrinkage == 0.75
    assert not (own.parent / "__pycache__").exists()


def test_a_file_enters_the_key_by_content_and_a_package_by_version(own):
    import sklearn

    mine = decode.Config(decoders=("mine",), recipes={"mine": recipe(own)})
    assert set(decode.sources(mine, "s01")) == {"mine/mine_of_a_test.py", "mine/helper.py"}
    assert decode.packages(mine) == ()
    assert str(own) not in str(params(mine))
    theirs = decode.Config(decoders=("svm",), recipes={"svm": Recipe("sklearn.svm.SVC")})
    assert decode.sources(theirs, "s01") == {}
    assert decode.packages(theirs) == ("scikit-learn",)
    assert estimators.importlib.metadata.version("scikit-learn") == sklearn.__version__


@pytest.mark.parametrize(
    ("path", "given", "words"),
    [
        ("sklearn.ensemble.RandomForrestClassifier", {}, "did you mean 'RandomForestClassifier'?"),
        ("sklearn.svn.SVC", {}, "sklearn.svn cannot be imported: ModuleNotFoundError"),
        ("sklearn.svm.SVC", {"kernal": "rbf"}, "has no parameter 'kernal' (did you mean 'kernel'?)"),
        ("sklearn.svm.SVR", {}, "is no classifier of scikit-learn's kind"),
        (
            "sklearn.svm.SVC",
            {"kernel": "wavy"},
            "cannot be made with {'kernel': 'wavy'}: InvalidParameterError: The 'kernel' parameter",
        ),
        ("sklearn.svm.SVC", {"C": -1}, "The 'C' parameter of SVC must be a float in the range (0.0, inf]. Got -1"),
    ],
)
def test_what_cannot_be_used_is_refused_in_words(path, given, words):
    with pytest.raises(EstimatorError) as caught:
        scores(Recipe(path, params=given))
    assert words in str(caught.value)


def test_what_the_user_s_file_does_wrong_is_said(own):
    with pytest.raises(EstimatorError, match="it needs fit, get_params, and decision_function or predict_proba"):
        estimators.maker(recipe(own, "NoScores"), seed=1)
    own.write_text("def broken(:\n")
    with pytest.raises(EstimatorError, match="cannot be imported: SyntaxError"):
        estimators.maker(recipe(own, "broken"), seed=1)
    own.unlink()
    config = decode.Config(decoders=("mine",), recipes={"mine": recipe(own)})
    with pytest.raises(ConfigError, match="does not exist"):
        decode.sources(config, "s01")


def test_parameters_inside_a_chain_are_looked_at_too(own):
    own.write_text(
        "from sklearn.linear_model import LogisticRegression\nfrom sklearn.pipeline import make_pipeline\n"
        "def chain(C=1.0):\n    return make_pipeline(LogisticRegression(C=C))\n"
    )
    assert estimators.maker(recipe(own, "chain"), seed=1)().get_params()["logisticregression__C"] == 1.0
    wrong = Recipe("mine_of_a_test.chain", file=str(own), params={"C": -1})
    with pytest.raises(EstimatorError, match="The 'C' parameter of LogisticRegression"):
        estimators.maker(wrong, seed=1)


def test_every_recipe_that_cannot_be_used_is_named_before_anything_runs():
    recipes = {
        "one": Recipe("sklearn.svm.SVC", params={"C": -1}),
        "two": Recipe("sklearn.svm.SVC", params={"kernal": "rbf"}),
        "good": Recipe("sklearn.svm.SVC"),
        "unused": Recipe("sklearn.svm.Nothing"),
    }
    with pytest.raises(ConfigError) as caught:
        decode.ready(decode.Config(decoders=("good", "one", "rlda", "two"), recipes=recipes))
    assert [line.split(":")[0] for line in caught.value.problem.splitlines()] == [
        "decode.recipes.one",
        "decode.recipes.two",
    ]
    assert "did you mean 'kernel'" in caught.value.problem
    decode.ready(decode.Config(decoders=("good",), recipes=recipes))


def test_a_package_that_is_not_installed_has_no_version():
    with pytest.raises(EstimatorError, match="no installed package has 'nowhere_at_all'"):
        estimators.distribution("nowhere_at_all.Thing")


@pytest.mark.parametrize(
    ("one", "words"),
    [
        (Recipe("svm"), "or an import path such as 'sklearn.svm.SVC'"),
        (Recipe("sklearn..SVC"), "or an import path"),
        (Recipe("rlda", file="x.py"), "rlda is built in: leave file out"),
        (Recipe("rlda", params={"shrinkage": "much"}), "allowed for rlda: numbers"),
        (Recipe("toeplitz_lda", "steps", {"n_times": 12}, windows_s=((0.0, 0.1),)), "windows_s is for features"),
        (Recipe("sklearn.svm.SVC", windows_s=((0.3, 0.2),)), "allowed: [start, end], start first"),
    ],
)
def test_a_recipe_that_does_not_fit_together_is_told_before_anything_runs(one, words):
    assert any(words in text for text in misfits(one))
