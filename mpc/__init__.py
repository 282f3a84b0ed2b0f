"""Application: the console command, and control of what `calibration` has fitted."""

from mpc.errors import MpcError

__all__ = ["MpcError"]
