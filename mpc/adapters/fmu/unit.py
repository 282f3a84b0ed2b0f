"""A functional mock-up unit that runs: its library, its typed variables, its clock."""

import math
import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from contextlib import chdir, suppress
from pathlib import Path
from typing import Any, Literal

from mpc.errors import PlantError
from thermal.errors import nearest

#: How a unit is run: by its own solver, or by ours.
Interface = Literal["co-simulation", "model exchange"]

_REAL = ("Real", "Float64", "Float32")
_WHOLE = ("Integer", "Enumeration", *(f"{sign}Int{bits}" for sign in ("", "U") for bits in (8, 16, 32, 64)))


class Unit:
    """A unit of FMI 2.0 or 3.0, for co-simulation or model exchange.

    Parameters
    ----------
    path : Path
        The ``.fmu`` file. It holds a compiled library that is run as part of this process.
    interface : {"co-simulation", "model exchange"}, optional
        How it is run; model exchange by default, where the unit has it: the accuracy is then ours, while a
        unit's own solver may be one explicit Euler step a communication step, as OpenModelica's is. BOPTEST's own
        simulator, PyFMI, chooses so, too.

    Raises
    ------
    PlantError
        When it cannot be read, is of another kind, or has no library for this machine.
    """

    def __init__(self, path: Path, interface: Interface | None = None) -> None:
        try:
            import fmpy
        except ModuleNotFoundError as error:
            raise PlantError(f'an FMU needs {error.name}: pip install "buildingmpc[fmu]"') from error
        PlantError.unless(path.is_file(), f"FMU {path.name}", "a file", "none")
        try:
            # makers of units are lax: what is needed of a description is checked by name
            self._description = fmpy.read_model_description(str(path), validate=False)
        except Exception as error:  # of zip, XML or a schema: FMPy lets them all through
            raise PlantError(f"FMU {path.name}: expected a model description of FMI, found {error}") from error
        d = self._description
        self._fmi3 = str(d.fmiVersion).startswith("3.")
        offered: dict[Interface, Any] = {"model exchange": d.modelExchange, "co-simulation": d.coSimulation}
        there = [kind for kind, part in offered.items() if part is not None]
        found = f"{' and '.join(there) or 'scheduled execution'} of FMI {d.fmiVersion}"
        expected = f"{interface or 'co-simulation or model exchange'} of FMI 2.0 or 3.0"
        fits = (self._fmi3 or d.fmiVersion == "2.0") and (interface in there if interface else bool(there))
        PlantError.unless(fits, f"FMU {path.name}", expected, found)
        self.interface: Interface = interface or there[0]
        if fmpy.platform not in fmpy.supported_platforms(str(path)):
            found = ", ".join(fmpy.supported_platforms(str(path))) or "none"
            raise PlantError(f"FMU {path.name}", f"a library for {fmpy.platform}", found)
        self.name = path.name
        self.variables: Mapping[str, Any] = {v.name: v for v in d.modelVariables}
        self._fmpy, self._instance = fmpy, None
        self._stepping: Any = None
        self._held: dict[str, float] = {}
        try:
            self._folder = Path(fmpy.extract(str(path)))
        except Exception as error:
            raise PlantError(f"FMU {path.name}: cannot be unpacked: {error}") from error

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(name for name, v in self.variables.items() if v.causality == "input")

    @property
    def resources(self) -> Path:
        """Folder of the files that the unit brings."""
        return self._folder / "resources"

    def variable(self, name: str, kinds: Sequence[str], what: str, types: Sequence[str] = ()) -> Any:
        """Look a variable up.

        Parameters
        ----------
        name : str
            Its name.
        kinds : sequence of str
            Causalities that it may have.
        what : str
            What it is for, for the message.
        types : sequence of str
            ``real``, ``whole`` or ``boolean``; any of them by default.

        Raises
        ------
        PlantError
            When there is none, or it is of another type or causality.
        """
        found = self.variables.get(name)
        if found is None:
            raise PlantError(f"FMU {self.name}: {what}", "a variable", repr(name), nearest(name, self.variables))
        kind, wanted = _type(found), tuple(types) or ("real", "whole", "boolean")
        fits = kind in wanted and found.causality in kinds and not found.dimensions
        shape = f" of {len(found.dimensions)} dimensions" if found.dimensions else ""
        expected = f"a {' or '.join(wanted)} {' or '.join(kinds)}"
        got = f"{found.type} {found.causality}{shape}"
        PlantError.unless(fits, f"FMU {self.name}: {what} {name!r}", expected, got)
        return found

    def declared(self, variable: Any, what: str) -> str | None:
        """Tell an attribute of a variable, its own or that of its declared type.

        Parameters
        ----------
        variable : object
            Of `variable`.
        what : str
            ``unit``, ``min`` or ``max``.
        """
        found = getattr(variable, what)
        return found if found is not None else getattr(variable.declaredType, what, None)

    def start(self, time: float, values: Mapping[str, float], longest: float = math.inf) -> None:
        """Begin anew, with another instance: not every unit can be reset.

        Parameters
        ----------
        time : float
            At which it begins [s].
        values : mapping of str to float
            Of parameters and inputs before it begins [their declared units].
        longest : float
            Longest step of our solver [s].
        """
        from mpc.adapters.fmu.stepping import CoSimulation, ModelExchange

        self.end()
        own = self.interface == "co-simulation"
        try:
            with chdir(os.curdir):  # FMPy loads a library from its own folder, and stays there if that fails
                kind = "CoSimulation" if own else "ModelExchange"
                made = self._fmpy.instantiate_fmu(str(self._folder), self._description, kind)
        except Exception as error:
            raise PlantError(f"FMU {self.name}: cannot be started: {error}") from error
        self._instance, self._held = made, dict(values)
        ours = (made, self._fmi3, self._description, longest)
        self._stepping = CoSimulation(made, self._fmi3) if own else ModelExchange(*ours)
        self._call(self._stepping, "begin", time, lambda: self._write(values))

    def set(self, values: Mapping[str, float]) -> None:
        """Give inputs values; those that have them already stay untouched.

        Parameters
        ----------
        values : mapping of str to float
            By name [their declared units]; 0 and 1 of Booleans.
        """
        fresh = {name: float(v) for name, v in values.items() if self._held.get(name) != v}
        if fresh:
            self._call(self._stepping, "change", lambda: self._write(fresh))
            self._held |= fresh

    def get(self, names: Iterable[str]) -> dict[str, float]:
        """Read variables [their declared units].

        Parameters
        ----------
        names : iterable of str
            Which.
        """
        found = {name: math.nan for name in names}
        for kind, listed in self._by_type(found).items():
            references = [self.variables[name].valueReference for name in listed]
            found |= dict(zip(listed, map(float, self._call(self._instance, f"get{kind}", references)), strict=True))
        return found

    def step(self, time: float, length: float) -> None:
        """Go on by a communication step.

        Parameters
        ----------
        time : float
            At its begin [s].
        length : float
            Of the step [s].
        """
        self._call(self._stepping, "advance", time, length)

    def end(self) -> None:
        """Free the instance, if there is one."""
        instance, self._instance, self._stepping = self._instance, None, None
        if instance is not None:
            with suppress(Exception):  # it may have failed before; it is freed all the same
                instance.terminate()
            instance.freeInstance()

    def close(self) -> None:
        """Free everything, the unpacked files too."""
        self.end()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _write(self, values: Mapping[str, float]) -> None:
        for kind, names in self._by_type(values).items():
            sent: list[float | int | bool] = []
            for name in names:
                value, type_ = float(values[name]), _type(self.variables[name])
                fits = type_ == "real" or (value.is_integer() if type_ == "whole" else value in (0.0, 1.0))
                PlantError.unless(fits, f"input {name!r}", "0 or 1" if type_ == "boolean" else "a number", f"{value:g}")
                sent.append(value if type_ == "real" else int(value) if type_ == "whole" else bool(value))
            getattr(self._instance, f"set{kind}")([self.variables[n].valueReference for n in names], sent)

    def _by_type(self, names: Iterable[str]) -> dict[str, list[str]]:
        """Sort variables by the function of FMI that reads and writes them."""
        found: dict[str, list[str]] = {}
        for name in names:
            kind = str(self.variables[name].type)
            listed = ("Int64" if self._fmi3 else "Integer") if kind == "Enumeration" else kind
            found.setdefault(listed, []).append(name)
        return found

    def _call(self, target: Any, function: str, *values: Any) -> Any:
        if target is None:
            raise PlantError(f"FMU {self.name}: was closed, or never started")
        try:
            return getattr(target, function)(*values)
        except Exception as error:
            raise PlantError(f"FMU {self.name}: {function} failed: {error}") from error


def _type(variable: Any) -> str:
    """Whether a variable is real, whole, boolean, or of another type."""
    kind = str(variable.type)
    return "real" if kind in _REAL else "whole" if kind in _WHOLE else kind.lower()
