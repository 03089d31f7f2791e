"""The columns in which decode and calibrate tell how a decoder did on held-out trials."""

from hrcneuro.io.tables import Column

RATES = {
    "tnr": Column("float", "%", "held-out trials of class 1 (no takeover) decoded right"),
    "tpr": Column("float", "%", "held-out trials of class 2 (takeover) decoded right"),
    "acc": Column("float", "%", "held-out trials decoded right"),
    "bacc": Column("float", "%", "balanced accuracy, the mean of tnr and tpr"),
    "auc": Column("float", "%", "area under the receiver operating characteristic"),
}
