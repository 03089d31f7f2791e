"""URScript: tokens, a translation to Python generators, the threads of a program, and the built-in functions."""
