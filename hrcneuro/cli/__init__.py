"""The command line: one file a subject, with the declaration of its commands and what they do."""
