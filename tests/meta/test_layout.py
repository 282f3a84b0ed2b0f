"""The project keeps to its layout: one way of imports, one error family a package, nothing lost, no stray paths."""

from __future__ import annotations

import ast
import importlib.util
import inspect
import re
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Check = Callable[[list[str]], None]

ROOT = Path(__file__).parents[2]
PACKAGES = ("thermal", "calibration", "mpc")  # in the order that imports run
FOLDERS = (*PACKAGES, "benchmarks", "examples", "tests")
LONGEST_MODULE = 400  # lines
MACHINE_PATH = re.compile(r"(?<![\w.])/(work|tmp|root|home/\w+)(?![\w-])")


def test_imports_run_one_way(project: Any, expect_none: Check) -> None:
    problems = []
    for name, line, source, _ in project.imports:
        at, here, there = project.where(name, line), name.split(".")[0], source.split(".")[0]
        if there in (*PACKAGES[PACKAGES.index(here) + 1 :], "benchmarks", "tests", "examples"):
            problems.append(f"{at}: {here} imports {source}; imports run thermal <- calibration <- mpc")
    expect_none(problems)


def test_every_name_is_exported_used_or_private(project: Any, expect_none: Check) -> None:
    exported = {id(p.value) for p in project.exported}
    shown = {word for folder in ("benchmarks", "examples", "docs") for path in (ROOT / folder).rglob("*")
             if path.suffix in (".py", ".md", ".ipynb")
             for word in re.findall(r"\w+", path.read_text(encoding="utf-8"))}  # fmt: skip
    imported = {(source, name) for _, _, source, name in project.imports}
    attributes = {(n.value.id, n.attr) for t in project.trees.values() for n in ast.walk(t)
                  if isinstance(n, ast.Attribute) and isinstance(n.value, ast.Name)}  # fmt: skip
    scripts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["scripts"].values()
    problems = []
    for name, module in project.modules.items():
        definitions = (n for n in project.trees[name].body if isinstance(n, ast.FunctionDef | ast.ClassDef))
        for node in (n for n in definitions if not n.name.startswith("_")):
            is_exported = id(getattr(module, node.name)) in exported
            here = sum(n.id == node.name for n in ast.walk(project.trees[name]) if isinstance(n, ast.Name))
            is_used = here or (name, node.name) in imported or (name.rpartition(".")[2], node.name) in attributes
            calls = [d.func for d in node.decorator_list if isinstance(d, ast.Call)]
            is_command = any(isinstance(c, ast.Attribute) and c.attr in ("command", "callback") for c in calls)
            if not (is_exported or is_used or is_command or node.name in shown or f"{name}:{node.name}" in scripts):
                problems.append(
                    f"{project.where(name, node.lineno)}: nobody exports, uses or shows {node.name}; "
                    "prefix an underscore, or drop it"
                )
    expect_none(problems)


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_has_one_error_family(project: Any, expect_none: Check, package: str) -> None:
    base, problems = f"{package.capitalize()}Error", []
    for name in (n for n in project.modules if n.split(".")[0] == package):
        for value in vars(project.modules[name]).values():
            if inspect.isclass(value) and issubclass(value, BaseException) and value.__module__ == name:
                if base not in [b.__name__ for b in value.__mro__]:
                    at = project.where(name, inspect.getsourcelines(value)[1])
                    problems.append(f"{at}: {value.__name__} is outside of the family; derive it from {base}")
    expect_none(problems)


def test_packages_do_not_print(project: Any, expect_none: Check) -> None:
    problems = []
    for name, tree in project.trees.items():
        for call in (n for n in ast.walk(tree) if isinstance(n, ast.Call) and getattr(n.func, "id", "") == "print"):
            problems.append(f"{project.where(name, call.lineno)}: print(); write to the command's console instead")
    expect_none(problems)


def test_modules_are_short(expect_none: Check) -> None:
    paths = [path for folder in FOLDERS for path in sorted((ROOT / folder).rglob("*.py"))]
    lengths = {path.relative_to(ROOT): len(path.read_text(encoding="utf-8").splitlines()) for path in paths}
    long = {path: n for path, n in lengths.items() if n > LONGEST_MODULE}
    expect_none([f"{p}:{n}: {n} lines, over {LONGEST_MODULE}; split it by what it does" for p, n in long.items()])


def test_no_file_names_a_path_of_one_machine(expect_none: Check) -> None:
    inside = [path for folder in (*FOLDERS, "docs", ".ci") for path in (ROOT / folder).rglob("*")]
    problems = []
    for path in (p for p in [*ROOT.glob("[!.]*"), *inside] if p.is_file() and "__pycache__" not in p.parts):
        try:
            lines = path.read_text(encoding="utf-8").splitlines()
        except UnicodeDecodeError:  # a picture, a Parquet file
            continue
        found = [(n, m[0]) for n, line in enumerate(lines, 1) for m in MACHINE_PATH.finditer(line)]
        at = path.relative_to(ROOT)
        problems += [f"{at}:{n}: names {text} of one machine; make it relative" for n, text in found]
    expect_none(problems)


@pytest.mark.parametrize("path", sorted((ROOT / "examples").glob("*.py")), ids=lambda path: path.stem)
def test_an_example_can_be_imported(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    spec = importlib.util.spec_from_file_location(f"example_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    monkeypatch.setitem(sys.modules, spec.name, module)  # dataclasses look their module up
    spec.loader.exec_module(module)
    assert module.__doc__, f"examples/{path.name}:1: say in a docstring what it shows"
