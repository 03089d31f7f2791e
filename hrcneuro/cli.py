"""The command line: declarations only. What a command does loads when it runs, so that ``--help`` answers at once."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from hrcneuro import __version__, cli_study, completion
from hrcneuro.boundary import bounded
from hrcneuro.options import Options, with_options

app = typer.Typer(
    name="hrcneuro",
    help="A neuro-robotics study that anyone can rerun: EEG, decoding, robot learning and a UR10.",
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    epilog="Examples:\n\n  hrcneuro preprocess s01\n\n  hrcneuro run pipelines/smoke.toml -j 2",
)
cache_app = typer.Typer(help="Look into the cache, check it, clean it.", rich_markup_mode=None, no_args_is_help=True)
ur10_app = typer.Typer(help="A simulated UR10 controller.", rich_markup_mode=None, no_args_is_help=True)
config_app = typer.Typer(help="Show or check the configuration.", rich_markup_mode=None, no_args_is_help=True)

Subjects = Annotated[
    list[str] | None,
    typer.Argument(help="Subjects; none means everyone, and the group.", autocompletion=completion.subjects),
]


def _command(
    help: str, *examples: str, name: str, group: typer.Typer = app
) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    text = "Examples:\n\n" + "\n\n".join(f"  hrcneuro {example}" for example in examples)

    def register(function: Callable[..., Any]) -> Callable[..., Any]:
        group.command(name, help=help, epilog=text)(with_options(bounded(name, function)))
        return function

    return register


@app.callback(invoke_without_command=True)
def _main(
    version: Annotated[bool, typer.Option("--version", help="Print the version and stop.", is_eager=True)] = False,
) -> None:
    if version:
        print(f"hrcneuro {__version__}")
        raise typer.Exit


@_command(
    "Read or simulate recordings: continuous EEG and the trial table.",
    "acquire s01 --inspect",
    "acquire s01 --export study --dry-run",
    name="acquire",
)
def acquire(
    options: Options,
    subjects: Subjects = None,
    inspect: Annotated[
        bool, typer.Option("--inspect", help="Show markers, channels and log side by side; write nothing.")
    ] = False,
    rules: Annotated[
        bool, typer.Option("--rules", help="Measure the experiment's rules over all moves; write nothing.")
    ] = False,
    export: Annotated[
        Path | None,
        typer.Option(
            "--export",
            metavar="DIR",
            help="Also write DIR/sNN as the authors' repository has it: EEGLAB's .set and .fdt, and both CSV files.",
        ),
    ] = None,
) -> int:
    """Run the stage, or look at its source."""
    from hrcneuro import acquire_commands, commands

    acquire_commands.one_of(inspect=inspect, rules=rules, export=export is not None)
    if inspect:
        return acquire_commands.inspect(options, subjects)
    if rules:
        return acquire_commands.rules(options, subjects)
    if export is not None:
        return acquire_commands.export(options, subjects, export)
    return commands.stage("acquire", options, subjects)


def _plain_stage(name: str, help: str, *examples: str) -> None:
    @_command(help, *examples, name=name)
    def command(options: Options, subjects: Subjects = None) -> int:
        from hrcneuro import commands

        return commands.stage(name, options, subjects)


_plain_stage(
    "preprocess",
    "Filter, remove eye movements, repair channels, re-reference, down-sample.",
    "preprocess s01",
    "preprocess --set preprocess.l_freq=0.5 --dry-run",
)
_plain_stage("epoch", "Cut epochs around movement onsets and count conditions.", "epoch s01", "epoch s01 s02 --json")
_plain_stage("erp", "Average, contrast and test event-related potentials.", "erp s01", "erp -j 2")
_plain_stage("ersp", "Time-frequency maps, their contrasts and tests.", "ersp s01", "ersp -j 2")
_plain_stage(
    "decode", "Decode single trials and compare with chance.", "decode s01", "decode --set decode.repeats=1 --dry-run"
)


@_command(
    "Drive the arm through a session's moves.",
    "robot s01",
    "robot s01 --backend ursim --set robot.blocks=[1] --timing",
    name="robot",
)
def robot(
    options: Options,
    subjects: Subjects = None,
    backend: Annotated[str, typer.Option(help="The arm: sim, ursim, ur or ros.")] = "",
    host: Annotated[str, typer.Option(help="Address of a real arm's controller.")] = "",
    at_the_robot: Annotated[
        bool, typer.Option("--i-am-at-the-robot", help="Someone stands at its emergency stop: a real arm needs this.")
    ] = False,
    lsl: Annotated[bool, typer.Option("--lsl", help="Send a marker at every motion onset over LSL.")] = False,
    timing: Annotated[bool, typer.Option("--timing", help="Print how punctual the motions were.")] = False,
) -> int:
    """Run the stage on the arm named."""
    from hrcneuro import robot_command

    return robot_command.robot(
        options, subjects, backend=backend, host=host, at_the_robot=at_the_robot, lsl=lsl, timing=timing
    )


@_command(
    "Simulate the robot that learns who does what (SIM1-4); design the next experiment.",
    "simulate --set simulate.repetitions=1000",
    "simulate --sweep accuracy=55,60,70 --sweep subtasks=4,6",
    name="simulate",
)
def simulate(
    options: Options,
    sweep: Annotated[
        list[str] | None,
        typer.Option(
            metavar="AXIS=VALUES",
            help="Sweep accuracy, subtasks, chosen, alpha, tau, events or period; repeatable. wide: 10,125 cells.",
        ),
    ] = None,
) -> int:
    """Run the stage, with a design sweep where one is asked for."""
    from hrcneuro import commands

    return commands.stage("simulate", commands.with_sweep(options, sweep or []), None)


@_command("Run a whole pipeline, then write the report.", "run", "run pipelines/smoke.toml -j 2", name="run")
def run_pipeline(
    options: Options,
    pipeline: Annotated[Path | None, typer.Argument(help="A pipeline file; none means pipelines/paper.toml.")] = None,
) -> int:
    """Run every stage of a pipeline."""
    from hrcneuro import commands

    return commands.run(options, pipeline)


@_command("Show what is fresh, what is stale and why.", "status", "status --set preprocess.l_freq=0.5", name="status")
def status(options: Options) -> int:
    """Print a table of stages and units."""
    from hrcneuro import commands

    return commands.status(options)


@_command("Print where an artifact lies.", "path preprocess s01", "path epoch s01 conditions.parquet", name="path")
def path(
    options: Options,
    stage: Annotated[str, typer.Argument(help="The stage that wrote it.", autocompletion=completion.stages)],
    unit: Annotated[str, typer.Argument(help="A subject, or group.", autocompletion=completion.units)],
    file: Annotated[str, typer.Argument(help="A file of the entry; none prints its folder.")] = "",
) -> int:
    """Print a path on stdout."""
    from hrcneuro import commands

    return commands.path(options, stage, unit, file)


@_command("Write the report from what has run.", "report", "report --workdir study", name="report")
def report(options: Options) -> int:
    """Write results/report.html."""
    from hrcneuro import commands

    return commands.report(options)


@_command("List the entries.", "cache ls", "cache ls --json", name="ls", group=cache_app)
def cache_ls(options: Options) -> int:
    """List entries with their sizes."""
    from hrcneuro import commands

    return commands.cache_ls(options)


@_command("Hash every file of every entry.", "cache verify", "cache verify --json", name="verify", group=cache_app)
def cache_verify(options: Options) -> int:
    """Check all entries; a bad one is quarantined and named."""
    from hrcneuro import commands

    return commands.cache_verify(options)


@_command("Drop the entries that no result points at.", "cache gc", "cache gc --dry-run", name="gc", group=cache_app)
def cache_gc(options: Options) -> int:
    """Remove unused entries, leftovers and quarantined ones."""
    from hrcneuro import commands

    return commands.cache_gc(options)


@_command(
    "Print every value, its range and where it came from.",
    "config show",
    "config show --set decode.repeats=5",
    name="show",
    group=config_app,
)
def config_show(
    options: Options,
    section: Annotated[
        str, typer.Argument(help="One section; none prints all.", autocompletion=completion.sections)
    ] = "",
) -> int:
    """Print the effective configuration as TOML."""
    from hrcneuro import commands

    return commands.config_show(options, section)


@_command(
    "Report every mistake of a configuration.",
    "config check",
    "config check --config configs/smoke.toml",
    name="check",
    group=config_app,
)
def config_check(options: Options) -> int:
    """Check the configuration and print its warnings."""
    from hrcneuro import commands

    return commands.config_check(options)


@_command(
    "Run a simulated UR10 (CB3) controller that speaks UR's own protocols, until Ctrl-C or SIGTERM.",
    "ur10 serve --address 127.0.0.2",
    "ur10 serve --fault protective_stop@30",
    name="serve",
    group=ur10_app,
)
def ur10_serve(
    options: Options,
    address: Annotated[str, typer.Option(help="Where it listens: ports 29998 to 30004.")] = "127.0.0.1",
    power_off: Annotated[
        bool, typer.Option("--power-off", help="Start without power, as a box just switched on.")
    ] = False,
    fault: Annotated[
        list[str] | None,
        typer.Option(
            metavar="KIND[=VALUE][@SECONDS]", help="Something that goes wrong; repeatable. docs/robot.md lists them."
        ),
    ] = None,
    software: Annotated[str, typer.Option(help="The version it says it is.")] = "3.9.1.64192",
    programs: Annotated[
        Path | None, typer.Option(help="A folder of URScript files that the dashboard can load.")
    ] = None,
    open_network: Annotated[
        bool, typer.Option("--open-network", help="Allow an address that others can reach.")
    ] = False,
    until_stdin_closes: Annotated[
        bool, typer.Option("--until-stdin-closes", help="End, too, when standard input closes.")
    ] = False,
) -> int:
    """Serve until told to end."""
    from hrcneuro.ur10.serve import serve

    return serve(
        address,
        powered=not power_off,
        faults=fault or (),
        version=software,
        programs=programs,
        open_network=open_network,
        as_json=options.json,
        quiet=options.quiet,
        verbose=options.verbose,
        until_stdin_closes=until_stdin_closes,
    )


cli_study.declare(_command)
app.add_typer(cache_app, name="cache")
app.add_typer(ur10_app, name="ur10")
app.add_typer(config_app, name="config")
