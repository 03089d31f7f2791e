"""What a stage does beyond one call: contrasts over subjects, strata, comparisons, the sweep."""
