"""Which signals of a BOPTEST server are which points of a plant of ours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

from mpc.adapters.boptest.signals import ELECTRICITY_OUTPUT, GAS_OUTPUT, Metadata
from mpc.errors import BoptestError
from thermal.case.points import split_column
from thermal.errors import CaseError, describe, nearest

_COLUMN = re.compile(r"([^/:]+/[a-z0-9_]+): ")
_ZONE = re.compile(r"Air temperature of zone (.+) at this time, ")


@dataclass(frozen=True)
class BoptestSignals:
    """Signals of a BOPTEST test case under the names of the case format.

    A test case of `BoptestServer` says them itself. For one of BOPTEST's own, name those that the controller needs.

    Parameters
    ----------
    measurements : mapping of str to str
        Output (``..._y``) of each column ``ENTITY/POINT``.
    actuators : mapping of str to str
        Input (``..._u``) of each actuator ``ENTITY/POINT``.
    zones : mapping of str to str
        Output with the air temperature of each zone.
    electricity, gas, district_heating : tuple of str
        Outputs whose sum is the power that is bought.
    forecast_zones : mapping of str to str
        What stands in the brackets of a zone's forecast points, such as ``LowerSetp[1]``; the zone's name by default.
    means : bool
        Whether powers are means over the time before them and forecasts means over the time after them, as those of
        `BoptestServer`; else they are readings, with straight lines between.

    Raises
    ------
    BoptestError
        When there is no zone, or a column is of no known point.

    Examples
    --------
    >>> signals = BoptestSignals(
    ...     {"zone/zone_air_temperature_sensor": "reaTZon_y"}, {}, {"zone": "reaTZon_y"}, ("reaPHeaPum_y",)
    ... )
    >>> signals.zones["zone"]
    'reaTZon_y'
    """

    measurements: Mapping[str, str]
    actuators: Mapping[str, str]
    zones: Mapping[str, str]
    electricity: tuple[str, ...] = ()
    gas: tuple[str, ...] = ()
    district_heating: tuple[str, ...] = ()
    forecast_zones: Mapping[str, str] = field(default_factory=dict)
    means: bool = False

    def __post_init__(self) -> None:
        if not self.zones:
            raise BoptestError(describe("signals", "an output for the temperature of a zone at least", "none"))
        for column in self.measurements:
            try:
                split_column(column, "signals")
            except CaseError as error:
                raise BoptestError(str(error)) from error

    @property
    def powers(self) -> Mapping[str, tuple[str, ...]]:
        """Outputs of each kind of energy."""
        kinds = {"electricity": self.electricity, "gas": self.gas, "district_heating": self.district_heating}
        return {kind: outputs for kind, outputs in kinds.items() if outputs}

    def check(self, inputs: Metadata, outputs: Metadata) -> None:
        """Refuse signals that a server does not have.

        Parameters
        ----------
        inputs, outputs : dict
            What the server says of its signals.

        Raises
        ------
        BoptestError
            Which signal is not there.
        """
        known = (
            *self.measurements.values(),
            *self.zones.values(),
            *(n for names in self.powers.values() for n in names),
        )
        for name, there in [*((n, outputs) for n in known), *((n, inputs) for n in self.actuators.values())]:
            if name not in there:
                raise BoptestError(describe("signals", "one of the test case", repr(name), nearest(name, there)))


def own_signals(inputs: Metadata, outputs: Metadata) -> BoptestSignals:
    """Read the signals of a test case of `BoptestServer` from their descriptions.

    Parameters
    ----------
    inputs, outputs : dict
        What the server says of its signals.

    Raises
    ------
    BoptestError
        When they are not described so.
    """
    measurements = _described(outputs, _COLUMN)
    zones = _described(outputs, _ZONE)
    if not zones:
        advice = "this is no server of buildingmpc: say which signals are which with `signals`"
        raise BoptestError(describe("test case", "outputs described by points of the case format", "others", advice))
    electricity, gas = (tuple(n for n in (name,) if n in outputs) for name in (ELECTRICITY_OUTPUT, GAS_OUTPUT))
    return BoptestSignals(measurements, _described(inputs, _COLUMN), zones, electricity, gas, means=True)


def _described(signals: Metadata, pattern: re.Pattern[str]) -> dict[str, str]:
    matches = ((pattern.match(str(entry.get("Description"))), name) for name, entry in signals.items())
    return {match[1]: name for match, name in matches if match is not None}
