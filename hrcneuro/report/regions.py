"""The regions and bands of the paper's findings, as the verdicts ask for them."""

FRONTAL = ("Fp1", "Fp2", "F7", "F3", "Fz", "F4", "F8", "FC1", "FC2")
MOTOR = ("FC5", "FC1", "FC2", "FC6", "C3", "Cz", "C4", "CP5", "CP6")
LEFT_TEMPORAL = ("T7", "TP9", "P7")
THETA, ALPHA, BETA = (4.0, 7.5), (7.5, 12.5), (12.5, 30.5)
