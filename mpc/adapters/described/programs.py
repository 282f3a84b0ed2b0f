"""What stands for the building of a ``plant.yaml``, as a schema."""

from typing import Annotated, Literal

from pydantic import Field

from thermal.case.building import Entry, Number, Positive, Text


class UnitProgram(Entry):
    """A functional mock-up unit.

    Parameters
    ----------
    kind : str
        ``fmu``.
    file : str
        The ``.fmu``, relative to the description.
    interface : {"co-simulation", "model exchange"}, optional
        How it is run; model exchange by default, where the unit has it.
    parameters : mapping of str to float
        Of the unit, start values and inputs that are held [their declared units].
    communication_step : float
        Longest time between two readings [s], a millisecond or more.
    """

    kind: Literal["fmu"]
    file: Text
    interface: Literal["co-simulation", "model exchange"] | None = None
    parameters: dict[Text, Number] = Field(default_factory=dict)
    communication_step: Annotated[Number, Field(ge=1e-3)] = 30.0


class ServerProgram(Entry):
    """A test case of a BOPTEST server.

    Parameters
    ----------
    kind : str
        ``boptest``.
    url : str
        Of the server.
    testcase : str, optional
        Its name there; that of the plant by default.
    timeout : float
        How long to wait for an answer [s].
    """

    kind: Literal["boptest"]
    url: Text
    testcase: Text | None = None
    timeout: Positive = 600.0


class EnergyPlusProgram(Entry):
    """A building of EnergyPlus.

    Parameters
    ----------
    kind : str
        ``energyplus``.
    model : str
        An ``.idf`` or ``.epJSON`` file relative to the description, or one of EnergyPlus' reference buildings.
    weather : str
        An ``.epw`` file relative to the description, or one that EnergyPlus brings.
    steps_per_hour : int
        Of zones and weather, a divisor of 60.
    """

    kind: Literal["energyplus"]
    model: Text
    weather: Text
    steps_per_hour: Annotated[int, Field(ge=1, le=60, strict=True)] = 12


class SiteProgram(Entry):
    """A real building, which ``buildingmpc operate`` reaches; nothing stands for it, so that it cannot be run ahead.

    Parameters
    ----------
    kind : str
        ``site``.
    """

    kind: Literal["site"]
