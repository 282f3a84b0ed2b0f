"""The closed loop as a Gymnasium environment, and learned policies as controllers (extra ``[rl]``)."""

from thermal.errors import MissingExtraError

try:
    import gymnasium
except ImportError as _error:
    raise MissingExtraError(
        'learning environments need gymnasium, which the extra brings: pip install "buildingmpc[rl]"'
    ) from _error

#: Id of the environment in Gymnasium's registry; ``gymnasium.make("mpc.environment:buildingmpc/Office-v0")``.
ENVIRONMENT_ID = "buildingmpc/Office-v0"

if ENVIRONMENT_ID not in gymnasium.registry:
    gymnasium.register(
        ENVIRONMENT_ID,
        entry_point="mpc.environment.office:office_environment",
        vector_entry_point="mpc.environment.office:office_vector_environment",
    )
