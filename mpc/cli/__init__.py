"""The console command ``buildingmpc``: each subcommand is a thin layer over a public function."""

from mpc.cli.app import main

__all__ = ["main"]
