"""hrcneuro: a neuro-robotics study that anyone can rerun, question and extend (Ehrlich et al., PLoS ONE 2023)."""

__version__ = "0.1.0"
