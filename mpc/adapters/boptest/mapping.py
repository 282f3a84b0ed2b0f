"""Which signals and forecast points of a BOPTEST server are which points of a plant of ours."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import pandas as pd

from mpc.adapters.boptest.scenario import PRICE_POINTS
from mpc.adapters.boptest.signals import ELECTRICITY_OUTPUT, GAS_OUTPUT, SITE_NAMES, WEATHER_NAMES, ZONE_NAMES, Metadata
from mpc.adapters.foreign import ForeignSignals
from mpc.errors import BoptestError
from mpc.scenario.forecast import Forecast
from thermal._types import FloatArray

_COLUMN = re.compile(r"([^/:]+/[a-z0-9_]+): ")
_ZONE = re.compile(r"Air temperature of zone (.+) at this time, ")


@dataclass(frozen=True)
class BoptestSignals(ForeignSignals):
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

    forecast_zones: Mapping[str, str] = field(default_factory=dict)
    means: bool = False
    _kind, _error = "an output", BoptestError

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
        known = [(name, outputs) for name in (*self.measurements.values(), *self.recorded)]
        for name, there in [*known, *((name, inputs) for name in self.actuators.values())]:
            BoptestError.unless_known(name, there, "signals", "one of the test case")


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
    advice = "this is no server of buildingmpc: say which signals are which with `signals`"
    BoptestError.unless(zones, "test case", "outputs described by points of the case format", "others", advice)
    electricity, gas = (tuple(n for n in (name,) if n in outputs) for name in (ELECTRICITY_OUTPUT, GAS_OUTPUT))
    return BoptestSignals(measurements, _described(inputs, _COLUMN), zones, electricity, gas, means=True)


def _described(signals: Metadata, pattern: re.Pattern[str]) -> dict[str, str]:
    matches = ((pattern.match(str(entry.get("Description"))), name) for name, entry in signals.items())
    return {match[1]: name for match, name in matches if match is not None}


#: BOPTEST's names of what district heating costs and emits, and columns of our forecasts; our own server has none.
_DISTRICT_NAMES = {
    "PriceDistrictHeatingPower": "district_heating_price",
    "EmissionsDistrictHeatingPower": "district_heating_carbon_intensity",
}


class _Source(NamedTuple):
    """Where a column of a forecast comes from.

    Parameters
    ----------
    point : str
        Forecast point of the server.
    divisor : float
        Of its values, from the server's unit to the library's [unit of the point per library's unit].
    weather : bool
        Whether it changes between its values rather than holding them.
    """

    point: str
    divisor: float = 1.0
    weather: bool = False


def forecast_sources(known: Mapping[str, object], signals: BoptestSignals, price: str) -> dict[str, _Source]:
    """Choose the forecast points of each column.

    Parameters
    ----------
    known : mapping
        Forecast points that the server has.
    signals : BoptestSignals
        Of the test case.
    price : str
        Which electricity price holds.
    """
    found = {point: _Source(name, factor, True) for name, (_, point, factor, _) in WEATHER_NAMES.items()}
    found["electricity_price"] = _Source(PRICE_POINTS[price])
    found |= {column: _Source(name) for name, (_, column, _) in SITE_NAMES.items()}
    found |= {column: _Source(name) for name, column in _DISTRICT_NAMES.items()}
    for zone in signals.zones:
        index = signals.forecast_zones.get(zone, zone)
        named = {name: column for name, (_, column, _) in ZONE_NAMES.items() if column}
        found |= {f"{zone}/{column}": _Source(f"{name}[{index}]") for name, column in named.items()}
    return {column: source for column, source in found.items() if source.point in known}


def as_forecast(payload: object, sources: Mapping[str, _Source], stamps: pd.DatetimeIndex, *, means: bool) -> Forecast:
    """Make a forecast of what a server answered.

    Parameters
    ----------
    payload : object
        Lists of numbers by point, one more than there are stamps.
    sources : mapping of str to _Source
        By column.
    stamps : DatetimeIndex
        Ends of the steps.
    means : bool
        Whether values are means from their time on, rather than readings at it.

    Raises
    ------
    BoptestError
        When a point is missing or of another length.
    """
    count, columns = len(stamps), {}
    for column, source in sources.items():
        listed = payload.get(source.point) if isinstance(payload, dict) else None
        if not isinstance(listed, list) or len(listed) != count + 1:
            found = f"{len(listed)}" if isinstance(listed, list) else "none"
            raise BoptestError(f"forecast point {source.point}", f"{count + 1} values", found)
        values: FloatArray = np.array(listed, dtype=float) / source.divisor  # null becomes NaN
        columns[column] = 0.5 * (values[:-1] + values[1:]) if source.weather and not means else values[:-1]
    return Forecast(pd.DataFrame(columns, index=stamps))
