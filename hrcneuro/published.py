"""What the paper prints, for whoever compares with it: Ehrlich et al. 2023, doi:10.1371/journal.pone.0287958."""

SOA_MS = {"sC": (875.88, 133.91), "iC": (872.34, 131.35)}
"""Mean and standard deviation of the time from onset to onset, milliseconds (§ 2.3.1)."""
