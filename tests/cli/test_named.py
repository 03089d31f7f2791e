"""A call declares the command that it names, and waits for no other."""

import importlib
import subprocess
import sys

import pytest
import typer.main

from hrcneuro.cli import named


@pytest.fixture(scope="module")
def commands():
    return typer.main.get_command(importlib.import_module("hrcneuro.cli.app").app).commands


@pytest.mark.parametrize("name", named.FILES)
def test_a_command_is_named_with_the_file_that_declares_it(commands, name):
    if not hasattr(commands[name], "commands"):
        assert commands[name].callback.__module__ == f"hrcneuro.cli.{named.FILES[name]}"


@pytest.mark.parametrize("name", ["cache", "config", "ur10"])
def test_a_group_is_whole_where_it_is_named(name):
    """In a process of its own: here all are declared by now."""
    one = f"from hrcneuro.cli.named import program; app = program(['{name}'])"
    every = "from hrcneuro.cli.app import app"
    told = f"import typer.main; print(*typer.main.get_command(app).commands['{name}'].commands)"
    alone, whole = (
        subprocess.run([sys.executable, "-c", f"{how}; {told}"], capture_output=True, text=True, check=True).stdout
        for how in (one, every)
    )
    assert alone == whole


@pytest.mark.parametrize("arguments", [[], ["--version"], ["stauts"]])
def test_what_names_no_command_finds_all(commands, arguments):
    """So does a command that nobody has named with its file, such as a new one."""
    assert set(typer.main.get_command(named.program(arguments)).commands) == set(commands)
