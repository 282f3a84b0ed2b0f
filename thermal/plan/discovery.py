"""Points of a building's network matched to its devices: a proposal that a person confirms, doubts and all."""

from collections.abc import Collection, Sequence
from dataclasses import asdict, dataclass, replace
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

import yaml
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from thermal.case.building import Building
from thermal.case.points import POINT_TYPES
from thermal.errors import CaseError, PlanError
from thermal.plan.devices import DeviceImport, key
from thermal.plan.guard import checked_file, first_fault, reading, vocabulary
from thermal.plan.match import EntityNames, PointMatch, read_matches, settled
from thermal.units import check_unit

#: Confidence from which a match is not called doubtful [-]: set beforehand, half way from one that is offered to a sure
#: one; of the generated names of `benchmarks/discovery.py` none above it was wrong.
SURE = 0.75

_UNITS = vocabulary("bacnet_units")
_COMMANDED = ("setpoint", "command")


@dataclass(frozen=True)
class NetworkPoint:
    """A point as a network or a model shows it.

    Parameters
    ----------
    address : str
        Where it is read: ``10.0.0.7 analog-input,3`` of BACnet, or the identifier in a model.
    name : str
        Its own.
    description : str
        In words; often empty.
    device : str
        Name of the device that has it; often empty.
    unit : str
        As the network or pint spells it; empty where it has none.
    entity, point : str
        What a model says that it is; empty where it does not.
    """

    address: str
    name: str
    description: str = ""
    device: str = ""
    unit: str = ""
    entity: str = ""
    point: str = ""


class ProposedPoint(BaseModel):
    """What a point of the network is taken for.

    Parameters
    ----------
    address, name, description, device, unit : str
        As of `NetworkPoint`.
    entity, point : str
        Device, zone or weather station, and point type; the best guess where it is unmatched, empty without one.
    score : float
        From 0 to 1 [-].
    status : {"matched", "doubtful", "unmatched"}
        How sure it is.
    remark : str
        Why it is doubtful or unmatched.
    confirmed : bool
        Set by a person: nothing is used before.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: Annotated[str, Field(min_length=1)]
    name: str
    description: str = ""
    device: str = ""
    unit: str = ""
    entity: str = ""
    point: str = ""
    score: float = 0.0
    status: Literal["matched", "doubtful", "unmatched"] = "unmatched"
    remark: str = ""
    confirmed: bool = False


class Proposal(BaseModel):
    """What all points of a network are taken for.

    Parameters
    ----------
    format : int
        Of the file.
    building : str
        Name of the building.
    points : tuple of ProposedPoint
        Doubtful ones first, then unmatched ones, then the others.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal[1] = 1
    building: str
    points: tuple[ProposedPoint, ...]

    def of(self, status: str) -> tuple[ProposedPoint, ...]:
        """Give the points of a status.

        Parameters
        ----------
        status : str
            ``matched``, ``doubtful`` or ``unmatched``.
        """
        return tuple(p for p in self.points if p.status == status)

    def matches(self) -> tuple[PointMatch, ...]:
        """Give the points as the list that the labelling page and `import_telemetry` read."""
        return tuple(
            PointMatch(p.name, p.entity, p.point, p.score, p.remark if p.status == "unmatched" else "", p.unit)
            for p in self.points
        )


def propose(points: Sequence[NetworkPoint], building: Building) -> Proposal:
    """Propose what the points of a network are.

    Parameters
    ----------
    points : sequence of NetworkPoint
        From `thermal.intake.bacnet.discover` or `points_of_model`.
    building : Building
        With zones and devices.

    Returns
    -------
    Proposal
        One entry a point: none is left out.

    Notes
    -----
    Name, description and both with the device's name before them are matched as columns of telemetry are
    (`match_points`), to point types that the point's unit can measure and its kind of object can be: inputs are
    sensors, outputs are commands or setpoints. The most confident reading is taken.
    """
    names = EntityNames.of(building.devices, building.zone_names, building.weather_station)
    known = {key(name): name for name in names.types}
    guesses, whys = [], []
    for number, point in enumerate(points):
        guess, why = _guess(point, names, known)
        guesses.append(replace(guess, column=str(number)))  # names on a network may stand twice
        whys.append(why)
    found = [_proposed(p, m, why) for p, m, why in zip(points, settled(guesses), whys, strict=True)]
    order = {"doubtful": 0, "unmatched": 1, "matched": 2}
    ranked = sorted(found, key=lambda p: (order[p.status], p.device, p.address))
    return Proposal(building=building.name, points=tuple(ranked))


def _guess(point: NetworkPoint, names: EntityNames, known: dict[tuple[str, ...], str]) -> tuple[PointMatch, str]:
    """Give the most confident reading of a point, and why it can be none."""
    said = known.get(key(point.entity), "")
    if said and point.point in POINT_TYPES:
        return PointMatch(point.address, said, point.point, 1.0), ""
    possible, why = _possible(point)
    of = said or point.device
    texts = [point.name, point.description, f"{point.name} {point.description}"]
    texts += [f"{of} {text}" for text in texts if of]
    read = [names.guess(text, possible) for text in texts if text.strip()]
    best = max(read, key=lambda m: m.confidence, default=PointMatch(point.address, "", "", 0.0))
    return best, why


def _possible(point: NetworkPoint) -> tuple[Collection[str], str]:
    """Point types that unit and object of a point allow, and why there are none."""
    kind = point.address.rpartition(" ")[2].partition(",")[0]
    if kind.startswith(("binary", "multi-state")):
        return (), f"a {kind} is none of the points that the library knows"
    unit = str(_UNITS.get(point.unit, point.unit))
    types = [name for name, of in POINT_TYPES.items() if not unit or _measures(unit, of.quantity)]
    if kind == "analog-input":
        types = [name for name in types if not name.endswith(_COMMANDED)]
    if kind == "analog-output":
        types = [name for name in types if name.endswith(_COMMANDED)]
    return types, "" if types else f"{point.unit} measures none of the points that the library knows"


def _measures(unit: str, quantity: str) -> bool:
    try:
        check_unit(unit, quantity, "")
    except CaseError:
        return False
    return True


def _proposed(point: NetworkPoint, match: PointMatch, why: str) -> ProposedPoint:
    status: Literal["matched", "doubtful", "unmatched"] = "matched"
    remark = why or match.remark
    if remark:
        status = "unmatched"
    elif match.confidence < SURE:
        status, remark = "doubtful", "its name says it in part only"
    found = {"entity": match.entity, "point": match.point, "unit": str(_UNITS.get(point.unit, point.unit))}
    score = round(match.confidence, 3)
    return ProposedPoint(**(asdict(point) | found), score=score, status=status, remark=remark)


def points_of_model(served: DeviceImport) -> tuple[NetworkPoint, ...]:
    """Give the points of a Brick model or a Haystack export.

    Parameters
    ----------
    served : DeviceImport
        From `read_devices`.
    """
    return tuple(NetworkPoint(p.column, p.column, "", p.entity, "", p.entity, p.point) for p in served.points)


def write_proposal(proposal: Proposal, path: str | PathLike[str]) -> Path:
    """Write a proposal as YAML, for a person to confirm.

    Parameters
    ----------
    proposal : Proposal
        From `propose`.
    path : str or path
        File to write.
    """
    counts = ", ".join(f"{len(proposal.of(s))} {s}" for s in ("doubtful", "unmatched", "matched"))
    head = f"# {counts}. Correct entity and point, then set confirmed: true; nothing else is used.\n"
    content: dict[str, Any] = proposal.model_dump(mode="json")
    file = Path(path)
    file.write_text(head + yaml.safe_dump(content, sort_keys=False, allow_unicode=True, width=120), encoding="utf-8")
    return file


def read_points(path: str | PathLike[str], building: Building) -> tuple[PointMatch, ...]:
    """Read what columns are, from a list or from a proposal.

    Parameters
    ----------
    path : str or path
        ``points.csv``, or the YAML of a proposal: its confirmed points.
    building : Building
        Whose entities they are of.

    Raises
    ------
    PlanError
        As of `thermal.plan.match.read_matches` and `read_proposal`.
    """
    if Path(path).suffix.lower() in (".yaml", ".yml"):
        return read_proposal(path, building).matches()
    return read_matches(path)


def read_proposal(path: str | PathLike[str], building: Building) -> Proposal:
    """Read a proposal that a person has gone through.

    Parameters
    ----------
    path : str or path
        YAML of `write_proposal`.
    building : Building
        Whose entities confirmed points must be of.

    Returns
    -------
    Proposal
        Its confirmed points only.

    Raises
    ------
    PlanError
        The file is missing or no proposal, or a confirmed point has no entity or point, an unknown one, or that of
        another.
    """
    file = checked_file(Path(path), (".yaml", ".yml"))
    with reading(file, "YAML in UTF-8", yaml.YAMLError, RecursionError):
        content = yaml.safe_load(file.read_text(encoding="utf-8-sig"))
    try:
        found = Proposal.model_validate(content)
    except ValidationError as error:
        raise PlanError(*first_fault(error, file.name)) from error
    confirmed = tuple(p for p in found.points if p.confirmed)
    entities = {*(d.name for d in building.devices), *building.zone_names, building.weather_station}
    owners: dict[tuple[str, str], str] = {}
    for point in confirmed:
        where = f"{file.name}: {point.address}"
        PlanError.unless_known(
            point.entity, sorted(entities), f"{where}: entity", "a device, a zone or the weather station"
        )
        PlanError.unless_known(point.point, POINT_TYPES, f"{where}: point", "a point type")
        first = owners.setdefault((point.entity, point.point), point.address)
        expected = f"{point.entity}/{point.point} once"
        PlanError.unless(first == point.address, where, expected, f"also {first}", "confirm one of them")
    return found.model_copy(update={"points": confirmed})
