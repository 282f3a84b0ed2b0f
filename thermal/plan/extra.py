"""The packages of the extra ``[plan]``, imported when they are first needed."""

from __future__ import annotations

import importlib
from typing import Any

from thermal.errors import MissingExtraError, describe


def extra(module: str) -> Any:
    """Import a module of the extra ``[plan]``.

    Parameters
    ----------
    module : str
        Its full name.

    Returns
    -------
    module
        The module.

    Raises
    ------
    MissingExtraError
        It is not installed; the message has the line that adds it.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        advice = 'run: pip install "buildingmpc[plan]"'
        raise MissingExtraError(describe("plan import", f"the package {module!r}", str(error), advice)) from error
