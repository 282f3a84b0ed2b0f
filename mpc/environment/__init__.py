"""The closed loop as a Gymnasium environment, and learned policies as controllers (extra ``[rl]``)."""

from thermal.errors import MissingExtraError

try:
    import gymnasium as _gymnasium  # noqa: F401
except ImportError as _error:
    raise MissingExtraError(
        'learning environments need gymnasium, which the extra brings: pip install "buildingmpc[rl]"'
    ) from _error

from mpc.environment.registration import register

register()
