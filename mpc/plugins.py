"""Extensions of others: modules that register controllers, indicators, effects or components when they are imported.

An installed package names its modules in the entry-point groups of `GROUPS`; a file or module that is not installed is
named on the command line, ``buildingmpc --plugin my_controller.py compare ...``.
"""

import sys
from collections.abc import Callable, Iterable
from importlib import import_module
from importlib.metadata import entry_points
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from mpc.errors import MpcError

#: Groups of entry points whose modules are imported.
GROUPS = ("buildingmpc.controllers", "buildingmpc.kpis", "buildingmpc.effects", "buildingmpc.components")

#: Modules and files that were asked for, so that a process of its own can load them too.
loaded: list[str] = []


def load_plugins(named: Iterable[str] = ()) -> None:
    """Import the modules of installed extensions, and others by name.

    Parameters
    ----------
    named : iterable of str
        Modules that can be imported, or files that end in ``.py``.

    Raises
    ------
    MpcError
        When one is not there, or fails while it is imported.
    """
    for group in GROUPS:
        for entry in entry_points(group=group):
            _imported(f"{entry.name} of {group}", entry.value)
    for name in named:
        path = Path(name)
        if path.suffix == ".py":
            MpcError.unless(path.is_file(), "--plugin", "a file that is there", repr(name))
            name = str(path.resolve())  # for a process with another working folder
        _imported("--plugin", name)
        if name not in loaded:
            loaded.append(name)


class WithPlugins:
    """A function for other processes: these load the plugins of this one when it arrives there.

    Parameters
    ----------
    function : callable
        Importable by name.
    names : iterable of str
        As `load_plugins` takes them.
    """

    def __init__(self, function: Callable[..., Any], names: Iterable[str]) -> None:
        self._function, self._names = function, tuple(names)

    def __call__(self, *arguments: Any) -> Any:
        """Call the function."""
        return self._function(*arguments)

    def __reduce__(self) -> tuple[Callable[..., Any], tuple[Any, ...]]:
        return _arrived, (self._function, self._names)


def _arrived(function: Callable[..., Any], names: Iterable[str]) -> WithPlugins:
    load_plugins(names)
    return WithPlugins(function, names)


def _imported(where: str, name: str) -> None:
    """Import a module, or a file once, under its own name."""
    path = Path(name)
    try:
        if path.suffix != ".py":
            import_module(name.partition(":")[0])
            return
        spec = spec_from_file_location(f"buildingmpc_plugin_{path.stem}", path)
        known = sys.modules.get(spec.name) if spec else None
        if spec and spec.loader and getattr(known, "__file__", None) != spec.origin:
            module = module_from_spec(spec)
            spec.loader.exec_module(module)
            sys.modules[spec.name] = module
    except Exception as error:
        found = f"{type(error).__name__}: {error}"
        raise MpcError(f"{where}: expected a module that can be imported, {name!r} gives {found}") from error
