"""Where moves and recordings come from: the authors' logs and data set, other recordings, simulation."""
