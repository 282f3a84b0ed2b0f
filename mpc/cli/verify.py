"""``buildingmpc verify``: what a new control has saved, by metered energy."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from mpc.cli import options
from mpc.cli.console import Waiting, answer, say, show_table

if TYPE_CHECKING:
    from pandas import DataFrame

    from mpc.verification.verify import Period, Verification


def verify(
    source: Annotated[str, typer.Argument(metavar="SOURCE", help="Parquet, CSV, Excel or postgresql:// with meters.")],
    out: Annotated[Path, options.folder("verification.json, days.parquet, report.html")],
    power: Annotated[
        list[str], options.value("Column of power or of an energy counter, repeatable: added up.", "COLUMN")
    ],
    outdoor: Annotated[str, options.value("Column of the outdoor temperature.", "COLUMN")],
    acts: Annotated[str, options.value("Column that is 1 where the new control acts, else 0.", "COLUMN")] = "",
    occupancy: Annotated[str, options.value("Column of people.", "COLUMN")] = "",
    zone: Annotated[str, options.value("Column of the zones' mean temperature.", "COLUMN")] = "",
    predicted: Annotated[str, options.value("Column of the power that shadow expected to save.", "COLUMN")] = "",
    rehearsed: Annotated[
        Path | None,
        options.file("days.parquet of `buildingmpc rehearse`, electricity and fuel, in the place of --predicted."),
    ] = None,
    baseline: Annotated[str, options.value("Days before, local.", "START/END")] = "",
    reporting: Annotated[str, options.value("Days after, local.", "START/END")] = "",
    model: Annotated[str, options.value("Of the baseline: change-point or time-of-week.", "NAME")] = "change-point",
    adjust: Annotated[str, options.value("Adjust for: occupancy.", "COLUMN,...")] = "",
    confidence: Annotated[str, options.value("Level of the intervals.", "SHARE")] = "90%",
    tz: Annotated[str, options.value("Clock of the building, such as Europe/Berlin.", "ZONE")] = "UTC",
    table: Annotated[str, options.value("Sheet of a workbook; table of a database, or SELECT.", "NAME")] = "",
    force: options.Force = False,
    json: options.Json = False,
) -> int:
    """Verify a saving by metered energy: before and after, or by alternate days, with intervals and checks.

    Example: buildingmpc verify meters.parquet --power "main [kW]" --outdoor outdoor --acts mode --out saved
    """
    from calibration.results import check_results_folder
    from mpc.errors import VerificationError
    from mpc.reports.verification import verification_summary, write_verification
    from mpc.verification.metered import MeteredColumns, read_metered
    from mpc.verification.verify import VerificationSettings
    from mpc.verification.verify import verify as verified
    from thermal.intake.source import shown

    check_results_folder(out, force)
    VerificationError.unless(not (predicted and rehearsed), "--rehearsed", "it or --predicted", "both")
    columns = MeteredColumns(tuple(power), outdoor, acts, occupancy, zone, predicted)
    periods = (_period(baseline, "--baseline", tz), _period(reporting, "--reporting", tz))
    settings = VerificationSettings(*periods, model, options.ids(adjust), options.share(confidence, "--confidence"))
    with Waiting(f"verify {shown(source)}") as progress:
        progress("reading", 0, 2)
        metered = read_metered(source, columns, tz, table)
        if rehearsed is not None:
            metered = metered.with_rehearsed(_days(rehearsed), str(rehearsed))
        progress("fitting", 1, 2)
        found = verified(metered, settings, shown(source))
        VerificationError.unless(
            rehearsed is None or found.predicted is not None, "--rehearsed", "three metered days of the own control",
            "fewer", "rehearse more days of shadow",
        )  # fmt: skip
        report = write_verification(found, out, force=force)
    return answer(json, verification_summary(found), lambda: _show(found), report)


def _days(path: Path) -> DataFrame:
    """Read the days of a rehearsal."""
    from pandas import read_parquet

    from mpc.errors import VerificationError

    try:
        return read_parquet(path)
    except (OSError, ValueError) as error:  # pyarrow's own errors are both
        advice = "make it with `buildingmpc rehearse site.yaml --out DIR`"
        raise VerificationError(str(path), "days.parquet of a rehearsal", str(error), advice) from error


def _period(text: str, where: str, timezone: str) -> Period | None:
    """Read START/END of local days; None for none."""
    from pandas import Timestamp

    from mpc.errors import VerificationError

    if not text:
        return None
    try:
        start, end = (Timestamp(part) for part in text.split("/"))
        zoned = [t.tz_localize(timezone) if t.tzinfo is None else t.tz_convert(timezone) for t in (start, end)]
    except ValueError as error:
        advice = "for example 2026-01-05/2026-03-01"
        raise VerificationError(where, "START/END in ISO 8601", repr(text), advice) from error
    VerificationError.unless(zoned[0] < zoned[1], where, "a start before its end", repr(text))
    return zoned[0], zoned[1]


def _show(found: Verification) -> None:
    from mpc.reports.verification import check_rows, comparison_sentence, saving_rows, verification_verdict

    say(verification_verdict(found))
    heads = ("design", "days", "saved", "interval", "kWh a day", "by chance")
    show_table("Savings", dict.fromkeys(heads, ""), saving_rows(found))
    for saving in found.savings:
        columns = dict.fromkeys(("check", "", "what was found", "what to do"), "")
        show_table(f"Checks, {saving.design}", columns, check_rows(saving.checks))
    if told := comparison_sentence(found):
        say(told)
