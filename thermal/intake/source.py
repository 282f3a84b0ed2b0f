"""Tables as they come: Parquet, CSV, Excel or a database, read whole, nothing made of them yet."""

from pathlib import Path

import pandas as pd

from thermal.errors import PlanError
from thermal.plan.guard import checked_file, extra, reading

#: What a file may end in.
SUFFIXES = (".parquet", ".csv", ".txt", ".xlsx")

#: How the address of a database begins.
DATABASE = ("postgresql://", "postgres://")


def read_table(source: str, table: str = "") -> pd.DataFrame:
    """Read a table, stamps and all, as its source has it.

    Parameters
    ----------
    source : str
        Path of a Parquet, CSV or Excel file, or ``postgresql://USER:PASSWORD@HOST/DATABASE``.
    table : str
        Sheet of a workbook, table of a database, or a query that begins with SELECT; default: the only one there is.

    Returns
    -------
    DataFrame
        One row a record; cells of a CSV are text.

    Raises
    ------
    PlanError
        It cannot be read, or there are several tables to choose from.
    MissingExtraError
        Excel or PostgreSQL without the extra ``telemetry``.
    """
    if source.startswith(DATABASE):
        frame = _read_database(source, table)
    else:
        file = checked_file(Path(source), SUFFIXES)
        suffix = file.suffix.lower()
        with reading(file, f"a table in {suffix[1:].upper()}"):
            if suffix == ".xlsx":
                frame = _read_workbook(file, table)
            else:
                frame = _read_parquet(file) if suffix == ".parquet" else _read_text(file)
    if frame.empty:
        raise PlanError(shown(source), "a table with rows", "none")
    return frame.set_axis([str(column).strip() for column in frame.columns], axis=1)


def shown(source: str) -> str:
    """Name a source without what is secret in it.

    Parameters
    ----------
    source : str
        Path or address.

    Returns
    -------
    str
        Name of the file, or host and database.

    Examples
    --------
    >>> shown("postgresql://me:secret@host/logs"), shown("data/export.csv")
    ('postgresql://host/logs', 'export.csv')
    """
    if source.startswith(DATABASE):
        return "postgresql://" + source.partition("://")[2].rpartition("@")[2].partition("?")[0]
    return Path(source).name


def _read_parquet(file: Path) -> pd.DataFrame:
    try:
        frame = pd.read_parquet(file)
    except Exception as error:  # pyarrow raises a family of its own
        raise ValueError(str(error)) from error
    return frame.reset_index() if isinstance(frame.index, pd.DatetimeIndex) else frame


def _read_text(file: Path) -> pd.DataFrame:
    """Read a CSV with commas, semicolons or tabs; semicolons may go with decimal commas."""
    with file.open(encoding="utf-8-sig") as stream:
        header = stream.readline()
    sign = max(",;\t", key=header.count)
    table = pd.read_csv(file, sep=sign, dtype=str, keep_default_na=False, encoding="utf-8-sig", skipinitialspace=True)
    if not isinstance(table.index, pd.RangeIndex):  # pandas takes what is too much on the left for names of rows
        found = f"rows with {table.index.nlevels + table.shape[1]}"
        raise PlanError(file.name, f"rows with {table.shape[1]} cells, as in the header", found, "correct the header")
    return table


def _read_workbook(file: Path, table: str) -> pd.DataFrame:
    extra("openpyxl", of="telemetry", needed_by="a workbook")
    sheets = pd.read_excel(file, sheet_name=None)
    filled = [name for name, sheet in sheets.items() if not sheet.empty]
    return sheets[_only(filled, table, file.name, "sheet")]


def _only(names: list[str], chosen: str, where: str, what: str) -> str:
    """Give the table that was chosen, or the only one."""
    if chosen in names or (not chosen and len(names) == 1):
        return chosen or names[0]
    advice = f"name one with --table: {', '.join(names[:8]) or 'there is none'}"
    raise PlanError(where, f"one {what} to read", repr(chosen) if chosen else f"{len(names)} of them", advice)


def _read_database(source: str, table: str) -> pd.DataFrame:
    sqlalchemy = extra("sqlalchemy", of="telemetry", needed_by="a database")
    extra("psycopg", of="telemetry", needed_by="a database")
    engine = sqlalchemy.create_engine("postgresql+psycopg://" + source.partition("://")[2])
    try:
        with engine.connect().execution_options(postgresql_readonly=True) as connection:
            if table.lstrip().casefold().startswith(("select ", "with ")):
                query = sqlalchemy.text(table)
            else:
                schema, _, name = table.rpartition(".")
                looker = sqlalchemy.inspect(connection)
                known = [*looker.get_table_names(schema or None), *looker.get_view_names(schema or None)]
                chosen = sqlalchemy.table(_only(known, name, shown(source), "table"), schema=schema or None)
                query = sqlalchemy.select(sqlalchemy.text("*")).select_from(chosen)
            return pd.read_sql_query(query, connection)
    except (sqlalchemy.exc.SQLAlchemyError, pd.errors.DatabaseError) as error:
        inner = error.__cause__ if isinstance(error, pd.errors.DatabaseError) else error
        found = " ".join(str(getattr(inner, "orig", None) or inner).split())[:200]
        advice = "check address, user and --table"
        raise PlanError(shown(source), "a database that can be read", found, advice) from error
    finally:
        engine.dispose()
