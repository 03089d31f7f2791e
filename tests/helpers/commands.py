"""Every command, by its words."""

COMMANDS = [
    *(
        ["acquire"],
        ["preprocess"],
        ["epoch"],
        ["erp"],
        ["ersp"],
        ["rerp"],
        ["decode"],
        ["simulate"],
        ["robot"],
        ["calibrate"],
        ["transfer"],
    ),
    *(["run"], ["status"], ["show"], ["path"], ["report"], ["multiverse"], ["doctor"], ["init"], ["export"]),
    *(
        ["cache", "ls"],
        ["cache", "verify"],
        ["cache", "gc"],
        ["cache", "push"],
        ["cache", "pull"],
        ["cache", "slim"],
        ["config", "show"],
        ["config", "check"],
    ),
    *(["ur10", "serve"], ["record"], ["amp"], ["timing"], ["experiment"], ["rehearse"], ["online"]),
]
