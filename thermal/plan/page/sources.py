"""What a person says of a table of telemetry: where it is, and what its columns are."""

from typing import Annotated

from pydantic import Field

from thermal.case.building import Entry
from thermal.plan.drawing import Finite
from thermal.plan.page.draft import Name


class Source(Entry):
    """A table that is to be read.

    Parameters
    ----------
    file
        Name of one that was given to the page.
    address
        Of a database, in place of a file; it may hold a password, and is never written down.
    table
        Sheet of a workbook, table of a database or query.
    timezone
        IANA name of the time zone of stamps without an offset.
    step
        Length of the steps that are wanted [s]; None: the table's own.
    """

    file: Name = ""
    address: Annotated[str, Field(max_length=2000)] = ""
    table: Annotated[str, Field(max_length=5000)] = ""
    timezone: Name = ""
    step: Finite | None = None


class Point(Entry):
    """What a person says that a column is.

    Parameters
    ----------
    column
        Its name.
    entity
        Device, zone or weather station; empty: the column is left out.
    point
        Point type; empty: the column is left out.
    unit
        Unit in the table; empty: that of the column's name, or the usual one.
    """

    column: Annotated[str, Field(max_length=1000)]
    entity: Name = ""
    point: Name = ""
    unit: Name = ""
