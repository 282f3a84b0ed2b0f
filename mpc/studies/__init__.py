"""Controllers put together, run on plants and compared: what the commands ``control`` and ``compare`` do."""

from mpc.studies._controller import default_horizon, held_space, make_controller, site_points
from mpc.studies._model import ORDER, control_model

__all__ = [
    "ORDER",
    "control_model",
    "default_horizon",
    "held_space",
    "make_controller",
    "site_points",
]
