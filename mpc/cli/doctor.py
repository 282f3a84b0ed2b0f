"""``buildingmpc doctor``: works where half of the packages are missing, so it imports them one by one."""

from __future__ import annotations

import platform
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from typing import Any

from mpc.cli.console import Json, say, show_table

DISTRIBUTION = "buildingmpc"


@dataclass(frozen=True)
class _Package:
    """A package that the project asks for.

    Parameters
    ----------
    name, wanted : str
        Name and versions asked for.
    extra : str
        Extra it belongs to; empty for the core.
    found : str or None
        Installed version.
    fine : bool
        Whether that is one of those asked for.
    """

    name: str
    wanted: str
    extra: str
    found: str | None
    fine: bool


def doctor(json: Json = False) -> int:
    """Look at the installation."""
    packages = _installed_packages()
    tests = {name: _run(test) for name, test in (("ipopt", _ipopt), ("splu", _splu))}
    missing = {p.extra for p in packages if p.extra and not p.fine}
    extras = {p.extra: p.extra not in missing for p in packages if p.extra}
    fine = all(p.fine for p in packages if not p.extra) and all(ok for ok, _ in tests.values())
    if json:
        _write(packages, extras, tests, fine)
        return 0 if fine else 1
    core = [p for p in packages if not p.extra]
    say(f"{DISTRIBUTION} {metadata.version(DISTRIBUTION)}, Python {platform.python_version()}, {platform.platform()}")
    show_table("Core", ("package", "wanted", "installed", ""), [_row(p) for p in core], left=(0, 3))
    checks = [(n, "fine" if ok else "FAILED", text) for n, (ok, text) in tests.items()]
    show_table("Solvers", ("test", "", ""), checks, left=(0, 1, 2))
    lines = [(e, _lacking(packages, e), "" if ok else _install_line(e)) for e, ok in extras.items()]
    if lines:
        show_table("Extras", ("extra", "lacks", "to add it"), lines, left=(0, 1, 2))
    say("All is well." if fine else f"Something in the core is missing or broken: pip install --upgrade {DISTRIBUTION}")
    return 0 if fine else 1


def _installed_packages() -> list[_Package]:
    """Compare what the project asks for with what is installed."""
    from packaging.requirements import Requirement

    found = []
    for line in metadata.requires(DISTRIBUTION) or []:
        need = Requirement(line)
        extra = next(
            (e for e in metadata.metadata(DISTRIBUTION).get_all("Provides-Extra") or [] if _belongs(need, e)), ""
        )
        if not extra and need.marker is not None and not need.marker.evaluate({"extra": ""}):
            continue  # not for this platform or Python
        try:
            version: str | None = metadata.version(need.name)
        except metadata.PackageNotFoundError:
            version = None
        fine = version is not None and need.specifier.contains(version, prereleases=True)
        found.append(_Package(need.name, str(need.specifier), extra, version, fine))
    return found


def _install_line(extra: str) -> str:
    """Spell the command that adds an extra.

    Parameters
    ----------
    extra : str
        Its name.
    """
    return f'pip install "{DISTRIBUTION}[{extra}]"'


def _belongs(need: object, extra: str) -> bool:
    marker = getattr(need, "marker", None)
    return marker is not None and not marker.evaluate({"extra": ""}) and marker.evaluate({"extra": extra})


def _lacking(packages: list[_Package], extra: str) -> str:
    return ", ".join(p.name for p in packages if p.extra == extra and not p.fine) or "nothing"


def _row(p: _Package) -> tuple[str, str, str, str]:
    state = "" if p.fine else "MISSING" if p.found is None else "TOO OLD OR TOO NEW"
    return p.name, p.wanted or "any", p.found or "–", state


def _run(test: Callable[[], str]) -> tuple[bool, str]:
    """Whether a self-test passes, and how long it took or what went wrong."""
    began = time.perf_counter()
    try:
        trouble = test()
    except Exception as error:  # a doctor reports what is broken
        trouble = f"{type(error).__name__}: {error}"
    return (not trouble, trouble or f"{1e3 * (time.perf_counter() - began):.0f} ms")


def _ipopt() -> str:
    """Rosenbrock's function in the unit disc: minimum 0.04567 at (0.7864, 0.6177)."""
    import casadi as ca

    x = ca.SX.sym("x", 2)
    problem = {"x": x, "f": (1 - x[0]) ** 2 + 100 * (x[1] - x[0] ** 2) ** 2, "g": ca.sumsqr(x)}
    options: dict[str, Any] = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes"}}
    solver = ca.nlpsol("doctor", "ipopt", problem, options)
    found = solver(x0=[0.0, 0.0], lbg=-ca.inf, ubg=1.0)
    if not solver.stats()["success"]:
        return str(solver.stats()["return_status"])
    value = float(found["f"])
    return "" if abs(value - 0.0456748) < 1e-5 else f"expected a minimum of 0.0456748, found {value:.7f}"


def _splu() -> str:
    import numpy as np
    import scipy.sparse as sp
    from scipy.sparse.linalg import splu

    n = 1000
    matrix = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(n, n)).tocsc()
    solution = np.sin(np.arange(n))
    error = float(np.abs(splu(matrix).solve(matrix @ solution) - solution).max())
    return "" if error < 1e-9 else f"expected an error below 1e-9, found {error:.2g}"


def _write(packages: list[_Package], extras: dict[str, bool], tests: dict[str, tuple[bool, str]], fine: bool) -> None:
    from json import dumps

    import typer

    content = {
        "version": metadata.version(DISTRIBUTION),
        "python": platform.python_version(),
        "platform": platform.platform(),
        "packages": [asdict(p) for p in packages],
        "extras": {e: {"installed": ok, "install": _install_line(e)} for e, ok in extras.items()},
        "tests": {name: {"fine": ok, "detail": text} for name, (ok, text) in tests.items()},
        "fine": fine,
    }
    typer.echo(dumps(content, indent=2))
