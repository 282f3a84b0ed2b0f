"""What stands in a ``site.yaml``, entry by entry."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from mpc.adapters.described.values import Kelvin
from thermal.case.building import Entry, Number, Positive, Text

#: What is done with a plan's value of a point: it is kept, shown for a click, or written.
Mode = Literal["shadow", "advise", "act"]

#: Priority of writes on BACnet: above a device's own programs, which have 15 and 16 by custom, and below those that
#: ASHRAE Standard 135, table 19-1, names: life safety 1 and 2, critical equipment 5, minimum on and off 6, manual
#: operator 8; 9 to 14 are free.
PRIORITY = 13


class BacnetLink(Entry):
    """A BACnet/IP device.

    Parameters
    ----------
    kind : str
        ``bacnet``.
    address : str
        Of the device, ``10.0.0.7`` or ``10.0.0.7:47809``.
    local : str
        Of this machine on that network, ``10.0.0.5/24`` or ``10.0.0.5/24:0``; port 0 takes a free one.
    priority : int
        That values are written at, 1 to 16.
    timeout : float
        How long a request waits for its answer [s].
    cov : float or None
        Lifetime of the collector's subscriptions to changes of value [s], at least 10; None polls.
    """

    kind: Literal["bacnet"]
    address: Text
    local: Text = "127.0.0.1/8:0"
    priority: Annotated[int, Field(ge=1, le=16, strict=True)] = PRIORITY
    timeout: Positive = 3.0
    cov: Annotated[float, Field(ge=10.0)] | None = None


class MqttLink(Entry):
    """A broker of MQTT.

    Parameters
    ----------
    kind : str
        ``mqtt``.
    host : str
        Of the broker.
    port : int
        Of the broker; 8883 by custom with `tls`.
    user, password_file : str, optional
        How to log in; the password is the first line of the file, relative to the site's.
    tls : bool
        Whether to encrypt, with the machine's certificates.
    timeout : float
        Age from which on a value that nobody has published again is none any more [s].
    """

    kind: Literal["mqtt"]
    host: Text
    port: Annotated[int, Field(ge=1, le=65535, strict=True)] = 1883
    user: Text | None = None
    password_file: Text | None = None
    tls: bool = False
    timeout: Positive = 900.0


class PointEntry(Entry):
    """A point: where it is read, and what may be written to it.

    Parameters
    ----------
    connection : str
        Name of a connection.
    at : str
        Where on it: ``analog-value,3`` of BACnet, ``read/topic`` or ``read/topic write/topic`` of MQTT.
    unit : str, optional
        There; the library's by default.
    mode : {"shadow", "advise", "act"}
        What is done with what is planned for it.
    range : tuple of float, optional
        Lowest and highest value that is written [library's unit], or temperatures with their unit.
    rate : float, optional
        Largest change of what is written in an hour [library's unit/h]; 0 lets it change at once, as switches do.
    release : str or float, optional
        How it is given back: ``relinquish`` (BACnet), or a value that is written then [library's unit].
    """

    connection: Text
    at: Text
    unit: Text | None = None
    mode: Mode = "shadow"
    range: tuple[Kelvin, Kelvin] | None = None
    rate: Annotated[Number, Field(ge=0)] | None = None
    release: Literal["relinquish"] | Kelvin | None = None

    @model_validator(mode="after")
    def _may_be_written(self) -> PointEntry:
        missing = [key for key in ("range", "rate", "release") if getattr(self, key) is None]
        if self.mode != "shadow" and missing:
            raise ValueError(f"expected range, rate and release of a point in mode {self.mode}, without "
                             f"{', '.join(missing)}")  # fmt: skip
        if self.range is not None and not self.range[0] < self.range[1]:
            raise ValueError("expected a range whose lower end comes first")
        if self.range is not None and isinstance(self.release, float):
            low, high = self.range
            if not low <= self.release <= high:
                raise ValueError(f"expected a release value within the range {low:g} to {high:g}")
        return self


class DatabaseEntry(Entry):
    """The historian.

    Parameters
    ----------
    address : str
        ``postgresql://user@host/name``; a password belongs into a ``.pgpass``.
    schema_name : str
        Of the tables.
    retention : float, optional
        Days that samples are kept [d]; for ever by default.
    spool : int
        Largest size of what waits on disk while the database is down [MB].
    """

    address: Text
    schema_name: Annotated[Text, Field(alias="schema")] = "buildingmpc"
    retention: Positive | None = None
    spool: Annotated[int, Field(ge=1, strict=True)] = 2000


class GuardEntry(Entry):
    """Limits of the guard; each has a default from the control step.

    Parameters
    ----------
    tick : float, optional
        Time between two looks [s]; a tenth of the control step, a minute at most.
    heartbeat : float, optional
        Longest silence of the controller [s]; a fifth of the control step.
    plan_age : float, optional
        Age from which on a plan is not followed any more [s]; one and a half control steps.
    input_age : float, optional
        Age from which on a measurement that a plan rests on is too old [s]; three readings, a fifth of the control
        step at least and a whole one at most.
    clock_jump : float
        Largest difference between the steps of the wall clock and of the monotonic one [s].
    override_hold : float, optional
        How long a point is left alone after an operator has given it back [s]; a control step.
    stuck : float, optional
        Time after which a zone's temperature that has not moved by a bit is taken for a failed sensor [s]; never by
        default, as sensors of a coarse resolution stand still.
    approval : float, optional
        How long a value holds that an operator has approved [s]; four control steps.
    """

    tick: Positive | None = None
    heartbeat: Positive | None = None
    plan_age: Positive | None = None
    input_age: Positive | None = None
    clock_jump: Positive = 5.0
    override_hold: Annotated[Number, Field(ge=0)] | None = None
    stuck: Positive | None = None
    approval: Positive | None = None


class PageEntry(Entry):
    """The page.

    Parameters
    ----------
    host : str
        Where it listens; others than this machine's own need `tokens`.
    port : int
        Of it.
    """

    host: Text = "127.0.0.1"
    port: Annotated[int, Field(ge=0, le=65535, strict=True)] = 8080


class NotifyEntry(Entry):
    """Who is told of alarms.

    Parameters
    ----------
    webhook : str, optional
        Address that a JSON object with ``site``, ``time`` and ``alarms`` is posted to.
    mail : str, optional
        Address that mail goes to.
    smtp : str
        Host, or host:port, that takes the mail.
    """

    webhook: Text | None = None
    mail: Text | None = None
    smtp: Text = "localhost:25"


class NightlyEntry(Entry):
    """The nightly evaluation of the building, by ``buildingmpc monitor``.

    Parameters
    ----------
    building : str
        Folder of the case, or its ``building.yaml``, relative to the site's file; points of the site bear its names.
    begin : str
        First day that is read, local, ``2026-01-05``.
    reference_days : int
        Days from then on that are taken for sound [d].
    at : str
        Local time of the evaluation.
    step : float
        Length of the steps that samples are brought to [s].
    parameters : str, optional
        A ``calibration.json``, relative to the site's file; else the model is fitted to the reference days.
    """

    building: Text = "case"
    begin: Annotated[str, Field(pattern=r"^\d{4}-\d{2}-\d{2}$")] = "2026-01-01"
    reference_days: Annotated[int, Field(ge=14, strict=True)] = 42
    at: Annotated[str, Field(pattern=r"^([01]\d|2[0-3]):[0-5]\d$")] = "02:30"
    step: Positive = 1800.0
    parameters: Text | None = None


class OwnControl(Entry):
    """What a building's own control sets by the outdoor temperature: straight lines between a cold and a warm day.

    Parameters
    ----------
    cold, warm : float
        Outdoor temperatures between which the setpoints move [K], or with their unit.
    air, water : tuple of float
        Supply air and supply water on the cold and on the warm day [K], or with their unit.
    """

    cold: Kelvin = 266.15
    warm: Kelvin = 289.15
    air: tuple[Kelvin, Kelvin] = (291.15, 286.15)
    water: tuple[Kelvin, Kelvin] = (353.15, 323.15)

    @model_validator(mode="after")
    def _rising(self) -> OwnControl:
        if not self.cold < self.warm:
            raise ValueError("expected a cold day that is colder than the warm one")
        return self


class BuildingModel(Entry):
    """The model of a building of air handlers, for ``mpc``.

    Parameters
    ----------
    building : str
        Folder of the case, or its ``building.yaml``, relative to the site's file; points of the site bear its names.
    parameters : str, optional
        A ``calibration.json``, relative to the site's file; starting values by default.
    own_control : OwnControl
        What plans are held against.
    """

    building: Text
    parameters: Text | None = None
    own_control: OwnControl = Field(default_factory=OwnControl)


Model = Annotated[
    Annotated[Text, Tag("<folder>")] | Annotated[BuildingModel, Tag("<building>")],
    Discriminator(
        lambda value: "<folder>" if isinstance(value, str) else "<building>",
        custom_error_type="model", custom_error_message="Input should be a folder, or a building",
    ),
]  # fmt: skip


class SiteFile(Entry):
    """A ``site.yaml``.

    Parameters
    ----------
    format : int
        1.
    name : str
        Of the site.
    plant : str
        The ``plant.yaml``, relative to this file: zones, comfort, prices, weather, forecasts, control step.
    controller : {"mpc", "full_speed"}
        Optimal control by a model, or the rule without any.
    model : str or BuildingModel, optional
        Folder of the model of ``buildingmpc identify``, relative to this file; or a calibrated building.
    folder : str
        For logs, spool and sockets, relative to this file.
    database : DatabaseEntry
        The historian.
    connections : mapping of str to BacnetLink or MqttLink
        By name.
    points : mapping of str to PointEntry
        By ``ENTITY/POINT``.
    collect : float
        Time between two readings of all points [s].
    clock_rate : float
        How many times faster than real time all clocks run, for simulated sites on this machine [-].
    guard : GuardEntry
        Its limits.
    page : PageEntry
        The page.
    notify : NotifyEntry
        Alarms.
    nightly : NightlyEntry, optional
        Evaluation of the building by night; none by default.
    """

    format: Literal[1]
    name: Text
    plant: Text
    controller: Literal["mpc", "full_speed"] = "mpc"
    model: Model | None = None
    folder: Text = "live"
    database: DatabaseEntry
    connections: Annotated[
        dict[Text, Annotated[BacnetLink | MqttLink, Field(discriminator="kind")]], Field(min_length=1)
    ]
    points: Annotated[dict[Text, PointEntry], Field(min_length=1)]
    collect: Positive = 60.0
    clock_rate: Positive = 1.0
    guard: GuardEntry = GuardEntry()
    page: PageEntry = PageEntry()
    notify: NotifyEntry = NotifyEntry()
    nightly: NightlyEntry | None = None
