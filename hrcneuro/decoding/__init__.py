"""Single-trial decoding (paper 2.5.4): features, classifiers, cross-validation, chance, and what the paper left out."""
