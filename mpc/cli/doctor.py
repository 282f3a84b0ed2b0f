"""``buildingmpc doctor``: works where half of the packages are missing, so it imports them one by one."""

import platform
import time
from collections.abc import Callable
from importlib import metadata
from json import dumps
from typing import Any

import typer

from mpc.cli.console import say, show_table
from mpc.cli.options import Json

DISTRIBUTION = "buildingmpc"


def doctor(json: Json = False) -> int:
    """Say what is installed and what is missing, and test the solvers.

    Example: buildingmpc doctor
    """
    packages = _installed_packages()
    tests = {name: _run(test) for name, test in (("ipopt", _ipopt), ("splu", _splu))}
    missing = {p["extra"] for p in packages if not p["fine"]}
    extras = {name: {"installed": name not in missing, "install": f'pip install "{DISTRIBUTION}[{name}]"'}
              for name in dict.fromkeys(p["extra"] for p in packages) if name}  # fmt: skip
    content = {
        "version": metadata.version(DISTRIBUTION), "python": platform.python_version(),
        "platform": platform.platform(), "packages": packages, "extras": extras, "tests": tests,
        "fine": "" not in missing and all(test["fine"] for test in tests.values()),
    }  # fmt: skip
    if json:
        typer.echo(dumps(content, indent=2))
    else:
        _show(content)
    return 0 if content["fine"] else 1


def missing_extras(*extras: str) -> str:
    """Write the line that installs extras, where a package of theirs is missing; empty where none is.

    Parameters
    ----------
    *extras : str
        Names of extras.
    """
    lacking = {package["extra"] for package in _installed_packages() if not package["fine"]}
    return f'pip install "{DISTRIBUTION}[{",".join(extras)}]"' if lacking & {*extras} else ""


def _show(content: dict[str, Any]) -> None:
    packages = content["packages"]
    say(f"{DISTRIBUTION} {content['version']}, Python {content['python']}, {content['platform']}")
    states = {True: "", False: "TOO OLD OR TOO NEW"}
    core = [
        (p["name"], p["wanted"] or "any", p["found"], states[p["fine"]] if p["found"] else "MISSING")
        for p in packages
        if not p["extra"]
    ]
    show_table("Core", {"package": "", "wanted": "s", "installed": "s", " ": ""}, core)
    checks = [(name, "fine" if test["fine"] else "FAILED", test["detail"]) for name, test in content["tests"].items()]
    show_table("Solvers", {"test": "", " ": "", "  ": ""}, checks)
    lines = []
    for name, extra in content["extras"].items():
        lacking = ", ".join(p["name"] for p in packages if p["extra"] == name and not p["fine"])
        lines.append((name, lacking or "nothing", "" if extra["installed"] else extra["install"]))
    if lines:
        show_table("Extras", {"extra": "", "lacks": "", "to add it": ""}, lines)
    broken = f"Something in the core is missing or broken: pip install --upgrade {DISTRIBUTION}"
    say("All is well." if content["fine"] else broken)


def _installed_packages() -> list[dict[str, Any]]:
    """Compare what the project asks for with what is installed; the extra of the core has no name."""
    from packaging.requirements import Requirement

    found, known = [], metadata.metadata(DISTRIBUTION).get_all("Provides-Extra") or []
    for need in map(Requirement, metadata.requires(DISTRIBUTION) or []):
        here = [e for e in ("", *known) if need.marker is None or need.marker.evaluate({"extra": e})]
        if not here:
            continue  # not for this platform or Python
        version = next((package.version for package in metadata.distributions(name=need.name)), None)
        fine = version is not None and need.specifier.contains(version, prereleases=True)
        named = {"name": need.name, "wanted": str(need.specifier), "extra": here[0]}
        found.append(named | {"found": version, "fine": fine})
    return found


def _run(test: Callable[[], str]) -> dict[str, Any]:
    """Say whether a self-test passes, and how long it took or what went wrong."""
    began = time.perf_counter()
    try:
        trouble = test()
    except Exception as error:  # a doctor reports what is broken
        trouble = f"{type(error).__name__}: {error}"
    return {"fine": not trouble, "detail": trouble or f"{1e3 * (time.perf_counter() - began):.0f} ms"}


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
