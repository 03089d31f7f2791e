"""What must run and why: the stage graph, the walk over it, one job, where jobs run, and the study's working folder."""
