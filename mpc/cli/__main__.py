"""Run the console command as ``python -m mpc.cli``."""

from mpc.cli import main

main()
