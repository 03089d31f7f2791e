"""The study with a person: the session's flow, what the person sees and presses, the arm, and the log."""
