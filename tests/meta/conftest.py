"""The project as the meta-tests see it: its modules, and what its packages hand on."""

from __future__ import annotations

import ast
import importlib
import inspect
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from thermal.errors import MissingExtraError

ROOT = Path(__file__).parents[2]
PACKAGES = ("thermal", "calibration", "mpc")
#: Modules whose extra is no part of the test extra: Stable-Baselines3 brings torch.
MAY_BE_ABSENT = ("mpc.environment.stable_baselines",)
MEMBER_KINDS = (staticmethod, classmethod, property, cached_property)


@dataclass(frozen=True)
class Public:
    """Something that a user can reach: a function, a class, a method, a property or a constant."""

    name: str
    value: Any
    where: str

    @property
    def function(self) -> Any:
        """The function behind a function, method, static or class method; None for anything else."""
        value = getattr(self.value, "__func__", self.value)
        return value if inspect.isfunction(value) else None

    @cached_property
    def parameters(self) -> dict[str, inspect.Parameter] | None:
        """Parameters by name, without self or cls; None for what is not called, or takes none of its own."""
        if inspect.isclass(self.value):
            inherited = self.value.__init__ in (Exception.__init__, object.__init__)
            if inherited or issubclass(self.value, Enum) or getattr(self.value, "_is_protocol", False):
                return None
            fields = getattr(self.value, "model_fields", {}).items()  # pydantic's signature has the names of the file
            aliases = {str(f.alias): name for name, f in fields if f.alias}
            return {aliases.get(n, n): p for n, p in inspect.signature(self.value).parameters.items()}
        if self.function is None:
            return None
        bound = "." in self.function.__qualname__ and not isinstance(self.value, staticmethod)
        return dict(list(inspect.signature(self.function).parameters.items())[bound:])


@dataclass
class Project:
    """Modules and public names of the installed packages; what cannot be imported is in `broken`."""

    files: dict[str, Path] = field(default_factory=dict)
    trees: dict[str, ast.Module] = field(default_factory=dict)
    modules: dict[str, ModuleType] = field(default_factory=dict)
    broken: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        for path in (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))):
            parts = path.relative_to(ROOT).with_suffix("").parts
            name = ".".join(parts[:-1] if parts[-1] == "__init__" else parts)
            self.files[name] = path
            try:
                self.trees[name] = ast.parse(path.read_text(encoding="utf-8"))
                if parts[-1] != "__main__":
                    self.modules[name] = importlib.import_module(name)
            except Exception as error:  # a module that is half written fails one test, not all of them
                if name in MAY_BE_ABSENT and isinstance(error, MissingExtraError):
                    continue
                self.broken.append(f"{self.where(name)}: cannot be imported: {type(error).__name__}: {error}")

    def where(self, name: str, line: int = 1) -> str:
        """``file:line`` in a module."""
        return f"{self.files[name].relative_to(ROOT)}:{line}"

    @cached_property
    def imports(self) -> list[tuple[str, int, str, str]]:
        """Importing module, line, imported module and name of every import, inside functions too."""
        found = []
        for name, tree in self.trees.items():
            inside = name.split(".") if self.files[name].name == "__init__.py" else name.split(".")[:-1]
            for node in ast.walk(tree):
                if isinstance(node, ast.Import):
                    found += [(name, node.lineno, alias.name, "") for alias in node.names]
                elif isinstance(node, ast.ImportFrom):
                    above = inside[: len(inside) - node.level + 1] if node.level else []
                    source = ".".join([*above, *filter(None, [node.module])])
                    found += [(name, node.lineno, source, alias.name) for alias in node.names]
        return found

    def definition(self, constant: str) -> tuple[str, bool]:
        """Where a constant is defined, and whether it is explained above, beside or below its definition."""
        for module, tree in self.trees.items():
            lines = ["", *self.files[module].read_text(encoding="utf-8").splitlines(), ""]
            for s in (s for s in tree.body if constant in _assigned(s)):
                above, first, below = (lines[n] for n in (s.lineno - 1, s.lineno, (s.end_lineno or s.lineno) + 1))
                return self.where(module, s.lineno), above.startswith("#") or "  # " in first or below.startswith('"""')
        return "", True

    @property
    def packages(self) -> dict[str, ModuleType]:
        """The packages that hand on names: what their `__all__` lists is public."""
        return {name: module for name, module in self.modules.items() if name in PACKAGES}

    @cached_property
    def exported(self) -> list[Public]:
        """Every name in an `__all__`, once."""
        found: dict[int, Public] = {}
        for package, module in self.packages.items():
            for name in (n for n in getattr(module, "__all__", ()) if hasattr(module, n)):
                value = getattr(module, name)
                found.setdefault(id(value), Public(f"{package}.{name}", value, _where(value, self.where(package))))
        return list(found.values())

    @cached_property
    def public(self) -> list[Public]:
        """What a user can reach: what is exported, what documents its parameters, and the members of such classes."""
        found = {id(p.value): p for p in self.exported}
        for name, module in self.modules.items():
            for node in (n for n in self.trees[name].body if isinstance(n, ast.FunctionDef | ast.ClassDef)):
                if not node.name.startswith("_") and "\nParameters\n---" in (ast.get_docstring(node) or ""):
                    value = getattr(module, node.name)
                    found.setdefault(id(value), Public(f"{name}.{node.name}", value, _where(value, self.where(name))))
        return [*found.values(), *(m for p in found.values() if inspect.isclass(p.value) for m in _members(p))]


def _assigned(statement: ast.stmt) -> list[str]:
    targets = statement.targets if isinstance(statement, ast.Assign) else [getattr(statement, "target", None)]
    return [target.id for target in targets if isinstance(target, ast.Name)]


def _where(value: Any, otherwise: str) -> str:
    value = getattr(value, "__func__", None) or getattr(value, "fget", None) or getattr(value, "func", None) or value
    try:
        return f"{Path(str(inspect.getsourcefile(value))).relative_to(ROOT)}:{inspect.getsourcelines(value)[1]}"
    except (TypeError, ValueError, OSError):
        return otherwise


def _members(owner: Public) -> Iterator[Public]:
    ours = [c for c in owner.value.__mro__ if c.__module__.partition(".")[0] in PACKAGES]
    # what overrides a method of another library (casadi.Callback) is that library's to document
    seen = {name for c in owner.value.__mro__ if c not in ours for name in vars(c)}
    for cls in ours:
        for name, value in vars(cls).items():
            is_member = inspect.isfunction(value) or isinstance(value, MEMBER_KINDS)
            if is_member and not name.startswith("_") and name not in seen:
                seen.add(name)
                yield Public(f"{owner.name}.{name}", value, _where(value, owner.where))


@pytest.fixture(scope="session")
def project() -> Project:
    """The installed packages, parsed and imported."""
    return Project()


@pytest.fixture(scope="session")
def expect_none() -> Callable[[list[str]], None]:
    """Fail with a list of problems, one line each, unless it is empty."""

    def check(problems: list[str]) -> None:
        if problems:
            pytest.fail("\n".join(problems), pytrace=False)

    return check
