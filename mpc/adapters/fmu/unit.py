"""A functional mock-up unit that runs: its library, its variables, its clock."""

import os
import shutil
from collections.abc import Iterable, Mapping, Sequence
from contextlib import chdir, suppress
from pathlib import Path
from typing import Any

from mpc.errors import PlantError
from thermal.errors import nearest


class Unit:
    """A co-simulation unit of FMI 2.0.

    Parameters
    ----------
    path : Path
        The ``.fmu`` file. It holds a compiled library that is run as part of this process.

    Raises
    ------
    PlantError
        When it cannot be read, is of another kind, or has no library for this machine.
    """

    def __init__(self, path: Path) -> None:
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
        if d.fmiVersion != "2.0" or d.coSimulation is None:
            kind = "co-simulation" if d.coSimulation is not None else "model exchange"
            found = f"{kind} of FMI {d.fmiVersion}"
            raise PlantError(f"FMU {path.name}", "co-simulation of FMI 2.0", found)
        if fmpy.platform not in fmpy.supported_platforms(str(path)):
            found = ", ".join(fmpy.supported_platforms(str(path))) or "none"
            raise PlantError(f"FMU {path.name}", f"a library for {fmpy.platform}", found)
        self.name = path.name
        self.variables: Mapping[str, Any] = {v.name: v for v in d.modelVariables}
        self._fmpy, self._slave = fmpy, None
        try:
            self._folder = Path(fmpy.extract(str(path)))
        except Exception as error:
            raise PlantError(f"FMU {path.name}: cannot be unpacked: {error}") from error

    def real(self, name: str, kinds: Sequence[str], what: str) -> Any:
        """Look a variable up.

        Parameters
        ----------
        name : str
            Its name.
        kinds : sequence of str
            Causalities that it may have.
        what : str
            What it is for, for the message.

        Raises
        ------
        PlantError
            When there is none, or it is of another type or causality.
        """
        found = self.variables.get(name)
        if found is None:
            raise PlantError(f"FMU {self.name}: {what}", "a variable", repr(name), nearest(name, self.variables))
        fits, expected = found.type == "Real" and found.causality in kinds, f"a real {' or '.join(kinds)}"
        PlantError.unless(fits, f"FMU {self.name}: {what} {name!r}", expected, f"{found.type} {found.causality}")
        return found

    def start(self, time: float, values: Mapping[str, float]) -> None:
        """Begin anew, with another instance: not every unit can be reset.

        Parameters
        ----------
        time : float
            At which it begins [s].
        values : mapping of str to float
            Of parameters and inputs before it begins [their declared units].
        """
        self.end()
        try:
            with chdir(os.curdir):  # FMPy loads a library from its own folder, and stays there if that fails
                slave = self._fmpy.instantiate_fmu(str(self._folder), self._description, "CoSimulation")
        except Exception as error:
            raise PlantError(f"FMU {self.name}: cannot be started: {error}") from error
        self._slave = slave
        self._call("setupExperiment", startTime=time)
        self.set(values)
        self._call("enterInitializationMode")
        self._call("exitInitializationMode")

    def set(self, values: Mapping[str, float]) -> None:
        """Give variables values.

        Parameters
        ----------
        values : mapping of str to float
            By name [their declared units].
        """
        if values:
            self._call(
                "setReal", [self.variables[n].valueReference for n in values], [float(v) for v in values.values()]
            )

    def get(self, names: Iterable[str]) -> dict[str, float]:
        """Read variables [their declared units].

        Parameters
        ----------
        names : iterable of str
            Which.
        """
        listed = list(names)
        found = self._call("getReal", [self.variables[n].valueReference for n in listed]) if listed else []
        return dict(zip(listed, map(float, found), strict=True))

    def step(self, time: float, length: float) -> None:
        """Go on by a communication step.

        Parameters
        ----------
        time : float
            At its begin [s].
        length : float
            Of the step [s].
        """
        self._call("doStep", currentCommunicationPoint=time, communicationStepSize=length)

    def end(self) -> None:
        """Free the instance, if there is one."""
        slave, self._slave = self._slave, None
        if slave is not None:
            with suppress(Exception):  # it may have failed before; it is freed all the same
                slave.terminate()
            slave.freeInstance()

    def close(self) -> None:
        """Free everything, the unpacked files too."""
        self.end()
        shutil.rmtree(self._folder, ignore_errors=True)

    def _call(self, function: str, *values: Any, **options: Any) -> Any:
        if self._slave is None:
            raise PlantError(f"FMU {self.name}: was closed, or never started")
        try:
            return getattr(self._slave, function)(*values, **options)
        except Exception as error:
            raise PlantError(f"FMU {self.name}: {function} failed: {error}") from error
