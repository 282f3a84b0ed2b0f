"""Examination of a case: every anomaly, the worst first."""

from collections.abc import Iterator

from thermal.case.building import OUTDOOR
from thermal.case.case import Case
from thermal.case.plausibility.anomaly import Anomaly
from thermal.case.plausibility.exchanged import exchanged_zones
from thermal.case.plausibility.heat_clock import heat_clock_errors
from thermal.case.plausibility.irradiance import clock_errors, night_offsets
from thermal.case.plausibility.magnitude import magnitudes
from thermal.case.plausibility.sensors import disagreements, out_of_range
from thermal.case.plausibility.standstill import standstills
from thermal.errors import CaseError

#: Share of the stamps at which what a calibration cannot do without must be known [-].
LEAST_KNOWN = 0.25


def examine(case: Case) -> tuple[Anomaly, ...]:
    """Hold a case against physics.

    Parameters
    ----------
    case
        Case.

    Returns
    -------
    tuple of Anomaly
        Errors first, then warnings and remarks; empty when there is nothing to say.

    Examples
    --------
    >>> from thermal import load_bundled_case
    >>> examine(load_bundled_case())
    ()
    """
    looks = (_lacking, standstills, magnitudes, clock_errors, night_offsets, disagreements, out_of_range)
    found = [anomaly for look in looks for anomaly in look(case)]
    if all(anomaly.severity != "error" for anomaly in found):  # of heat or temperatures that cannot be, nothing follows
        found += [*exchanged_zones(case), *heat_clock_errors(case)]
    return tuple(sorted(found, key=lambda anomaly: ("error", "warning", "remark").index(anomaly.severity)))


def check_calibratable(case: Case) -> None:
    """Refuse a case with which a calibration makes no sense.

    Parameters
    ----------
    case
        Case.

    Raises
    ------
    CaseError
        `examine` finds an error in it.
    """
    errors = [anomaly for anomaly in examine(case) if anomaly.severity == "error"]
    if errors:
        where = str(case.path or case.building.name)
        more = f" and {len(errors) - 1} more" if len(errors) > 1 else ""
        advice = f"{errors[0].advice}; see buildingmpc check"
        raise CaseError(where, "a case that is valid for calibration", errors[0].what + more, advice)


def _lacking(case: Case) -> Iterator[Anomaly]:
    """Find what a calibration cannot do without: heat, temperatures of zones and of the outdoors."""
    stamps = case.stamps

    def error(kind: str, what: str, advice: str) -> Anomaly:
        return Anomaly(kind, "error", "certain", (), stamps[0], stamps[-1], what, advice)

    if case.boundary_temperatures()[OUTDOOR].notna().mean() < LEAST_KNOWN:
        what = "the outdoor temperature is not known"
        yield error("no outdoor temperature", what, "add the weather station's outside_air_temperature_sensor")
    if case.zone_temperatures().notna().mean().max() < LEAST_KNOWN:
        yield error("no zone temperature", "no zone's temperature is known", "add zone_air_temperature_sensor")
        return
    heat = case.zone_heat()
    metered = [str(zone) for zone in heat if heat[zone].notna().mean() >= LEAST_KNOWN]
    served = {device.zone for device in case.building.devices if _reports_heat(case, device.name)}
    told = bool(case.command_signals().abs().sum().sum() > 0.0)
    if not {*metered} & served and not told:
        what = "no zone's heat is known: no device of a zone reports a power, or a flow with its temperature"
        advice = "give devices their heating_power_sensor, flow and discharge temperature, valve or damper"
        yield error("no heat", what, advice)
    elif metered and not told and not heat[metered].abs().sum().sum() > 0.0:
        what, advice = "the metered heat is 0 all the time", "calibrate on a time with heating or cooling too"
        yield Anomaly("no heat", "warning", "certain", (), stamps[0], stamps[-1], what, advice)


def _reports_heat(case: Case, device: str) -> bool:
    """Whether a device has telemetry that heat is made of, with a value in it."""
    points = ("heating_power_sensor", "supply_air_flowrate_sensor")
    columns = [f"{device}/{point}" for point in points]
    return any(column in case.usable and case.usable[column].notna().any() for column in columns)
