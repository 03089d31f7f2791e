"""The stages' pictures: arrays in, a file out; one style for all."""
