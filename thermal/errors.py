"""The error family of the package: every refusal has a name, and says where, what was expected, and what came."""

from __future__ import annotations

import difflib
from collections.abc import Iterable


class ThermalError(Exception):
    """Base of every error that `thermal` raises on purpose."""


class CaseError(ThermalError):
    """Something is wrong with a case folder, or with what a case is asked for."""


# Files
class MissingFileError(CaseError):
    """A file or folder that a case needs is not there."""


class UnreadableFileError(CaseError):
    """A file is there but cannot be read as what it should be."""


class OutsideCaseError(CaseError):
    """A path in `building.yaml` leads out of the case folder."""


class UnknownFileTypeError(CaseError):
    """A telemetry file is neither Parquet nor CSV."""


class CaseExistsError(CaseError):
    """A case would be saved over a folder that holds something."""


# building.yaml
class MalformedYamlError(CaseError):
    """`building.yaml` is not a YAML mapping."""


class DuplicateKeyError(CaseError):
    """A key stands twice in one YAML mapping."""


class UnsupportedFormatError(CaseError):
    """`format:` is not a number that this library reads."""


class UnknownKeyError(CaseError):
    """A key that the format does not know."""


class MissingKeyError(CaseError):
    """A key that the format requires is missing."""


class InvalidValueError(CaseError):
    """A value of the wrong type or outside its range."""


class GeometryChoiceError(CaseError):
    """A building needs floor plans or a zone table: one of the two."""


class UnknownTimeZoneError(CaseError):
    """`timezone` is not an IANA name."""


# Names
class DuplicateNameError(CaseError):
    """Two things of a building have the same name."""


class DuplicateZoneError(DuplicateNameError):
    """A zone stands twice: on two floors, or twice in a zone table."""


class ReservedNameError(CaseError):
    """A name that the format uses for itself."""


class UnknownZoneError(CaseError):
    """A zone that the building does not have."""


class UnknownDeviceError(CaseError):
    """A device that the building does not have."""


class UnknownConstructionError(CaseError):
    """A construction that the building does not have."""


class UnknownBoundaryError(CaseError):
    """A surface looks at something that is neither simulated nor measured."""


class UnknownFacadeError(CaseError):
    """A facade other than north, east, south and west."""


class UnknownEntityError(CaseError):
    """A telemetry column of nothing that the building has."""


# Geometry
class RaggedPlanError(CaseError):
    """The rows of a plan differ in length."""


class EmptyCellError(CaseError):
    """A cell of a plan is blank."""


class EmptyPlanError(CaseError):
    """A plan has no zone."""


class SplitZoneError(CaseError):
    """The cells of a zone do not hang together."""


class UnwalledZoneError(CaseError):
    """A zone touches the outside without a wall."""


class OversizedGlazingError(CaseError):
    """A zone has more glazing on a facade than facade."""


class InvalidSurfaceError(CaseError):
    """A surface has a property too many or too few for its kind."""


class MissingAzimuthError(InvalidSurfaceError):
    """A wall or window to outdoor does not say which way it looks."""


class InvalidAirflowError(CaseError):
    """An airflow leads from a zone to the same zone."""


# Points and units
class UnknownPointError(CaseError):
    """A point type that the format does not know."""


class MalformedColumnError(CaseError):
    """A telemetry column is not named `ENTITY/POINT`."""


class MissingUnitError(CaseError):
    """A measured point type has no entry in `units`."""


class UnknownUnitError(CaseError):
    """A unit that pint does not know."""


class IncompatibleUnitError(UnknownUnitError):
    """A unit of another quantity than the point's."""


# Telemetry
class EmptyTelemetryError(CaseError):
    """Telemetry with fewer than two rows, or without columns."""


class DuplicateColumnError(CaseError):
    """Two telemetry columns have the same name."""


class NonNumericColumnError(CaseError):
    """A telemetry column holds something that is not a number."""


class TimestampError(CaseError):
    """The stamps of the telemetry are missing or unreadable."""


class MissingTimeZoneError(TimestampError):
    """Stamps without a time zone or offset."""


class DuplicateStampError(TimestampError):
    """A stamp stands twice."""


class UnorderedStampError(TimestampError):
    """A stamp is earlier than the one before it."""


class IrregularStepError(TimestampError):
    """Two stamps are not a whole number of steps apart."""


class StepTooLongError(TimestampError):
    """Telemetry coarser than 60 minutes."""


# Asking a case
class InvalidTimeError(CaseError):
    """A text that is not an ISO 8601 time, or a local time that does not exist or exists twice."""


class EmptyIntervalError(CaseError):
    """An interval that holds no stamp of the telemetry."""


# The model
class ModelError(ThermalError):
    """Something is wrong with a thermal model, or with what it is asked for."""


class CellSizeError(ModelError):
    """A distance between control volumes that a plan cannot have."""


class ScopeError(ModelError):
    """A scope that is unknown, or that a parameter cannot have in this building."""


class StructureError(ModelError):
    """A structure of the baseline that cannot be built."""


class SingularModelError(ModelError):
    """A system matrix that cannot be factorised."""


class InputShapeError(ModelError):
    """An input whose shape, or a value that is not finite, the model cannot take."""


class SimulationError(ModelError):
    """A replay that its telemetry cannot support."""


def describe(where: str, expected: str, found: str, advice: str = "") -> str:
    """Write the message of an error: where, what was expected, what was found, what to do.

    Parameters
    ----------
    where
        File and key, row or column, such as ``building.yaml: devices[2].zone``.
    expected
        What would have been right.
    found
        What stood there, in words; a value as its `repr`.
    advice
        What to do about it; empty when that is plain.

    Returns
    -------
    str
        One line.
    """
    return f"{where}: expected {expected}, found {found}" + (f"; {advice}" if advice else "")


def nearest(word: object, options: Iterable[object]) -> str:
    """Name the valid option nearest to a word that is not valid.

    Parameters
    ----------
    word
        What came.
    options
        What would have been valid.

    Returns
    -------
    str
        ``the nearest valid one is 'x'``, or the valid ones when none is near (at most eight of them).
    """
    names = [str(option) for option in options]
    folded = {name.casefold(): name for name in names}
    match = difflib.get_close_matches(str(word).casefold(), list(folded), n=1, cutoff=0.5)
    if match:
        return f"the nearest valid one is {folded[match[0]]!r}"
    if not names:
        return "there is none to choose from"
    shown = ", ".join(names[:8])
    return f"valid: {shown}" + (f" and {len(names) - 8} more" if len(names) > 8 else "")


class EffectError(ModelError):
    """An effect is unknown, or asked for where it cannot be."""


# Heating, ventilation and air conditioning
class HvacError(ModelError):
    """Something is wrong with a model of the plant that heats and cools, or with what it is asked for."""


class HvacParameterError(HvacError):
    """A parameter of a device that is no number, or outside its range."""


class HvacActionError(HvacError):
    """An action or a condition of a step that is not finite, outside its range or of another shape."""


# Plans and devices from other files
class PlanError(ThermalError):
    """Something is wrong with a drawing or a list of devices, or with what it is asked for."""


class MissingExtraError(PlanError):
    """A package that the import of plans needs is not installed."""


class DrawingFileError(PlanError):
    """A file is not there, or not the kind of drawing or list that its name says."""


class OversizedFileError(PlanError):
    """A file, or what it unpacks to, is larger than any real plan."""


class OutsideFolderError(PlanError):
    """A path in a list of drawings leads out of the folder of the list."""


class PlanSettingError(PlanError):
    """A setting of the import that is no number, or outside its range."""


class ScaleError(PlanError):
    """The scale of a drawing is missing, or makes no building of it."""


class DrawingUnitsError(PlanError):
    """A drawing in units that make no building of it."""


class NoRoomsError(PlanError):
    """A drawing whose walls enclose nothing."""


class LostRoomError(PlanError):
    """A room that the cells of a plan are too coarse for."""


class RoomNameError(PlanError):
    """A name for a room that is reserved, stands twice, or points at no room."""


class DeviceListError(PlanError):
    """A list of devices that cannot be understood."""


class LostWorkError(PlanError):
    """What somebody has done on a case would be lost."""


class PointListError(PlanError):
    """A list of points and columns that cannot be understood, or names none of them."""


# The labelling page
class LabelError(ThermalError):
    """Something is wrong with what the labelling page is asked for."""


class AccessError(LabelError):
    """A request that does not come from the page: a wrong token, host or origin."""


class MalformedRequestError(LabelError):
    """A request whose body is not what the page would send."""


class SessionHeldError(LabelError):
    """The case is being labelled elsewhere, or somebody else has taken over."""


class LabelledCaseError(LabelError):
    """A case that cannot be labelled: it has a zone table, or its labelling file is damaged."""


class ReportError(LabelError):
    """A report that is not there, or could not be made."""
