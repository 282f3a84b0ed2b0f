"""Commands over a folder of cases, on this machine or at a URL: calibrate, diagnose, identify, compare."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from calibration.errors import CalibrationError
from mpc import plugins
from mpc.cli import options
from mpc.cli.console import Waiting, answer, complain, say, show_table

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from calibration.fleet.handling import Handling
    from calibration.fleet.job import Job
    from calibration.fleet.outcome import CaseOutcome
    from calibration.fleet.remote import FleetOutcome

Cases = Annotated[
    str, typer.Argument(metavar="CASE", help="Case folder, or a folder of case folders: a path, or a URL as s3://B/F.")
]
Workers = Annotated[int | None, options.value("Processes that share a folder of cases; default: one a core.")]
Scheduler = Annotated[
    str | None, options.value("Of a dask cluster for a folder of cases, such as tcp://10.0.0.1:8786.", "ADDRESS")
]
Retries = Annotated[
    int, options.value("Of a folder of cases: how often one whose worker died is given to another; then set aside.")
]
Limit = Annotated[
    str | None, options.value("Of a folder of cases: longest time of one, such as 30min; its worker is ended.", "TIME")
]

#: Statuses of cases that are done.
DONE = ("calibrated", "diagnosed", "identified", "compared")


@dataclass(frozen=True)
class How:
    """How many cases are done.

    Parameters
    ----------
    workers : int, optional
        Processes of this machine [-].
    scheduler : str, optional
        Of a cluster.
    retries : int
        Further workers of a case whose worker died [-].
    limit : str, optional
        Longest time of a case, as text.
    force, json : bool
        Whether earlier results are replaced, and whether JSON is asked for.
    """

    workers: int | None = None
    scheduler: str | None = None
    retries: int = 2
    limit: str | None = None
    force: bool = False
    json: bool = False

    @property
    def seconds(self) -> float | None:
        """Longest time of a case [s]."""
        if self.limit is None:
            return None
        import pandas as pd

        try:
            seconds = pd.Timedelta(self.limit).total_seconds()
        except ValueError as error:
            raise CalibrationError("--limit", "a time such as 30min", repr(self.limit)) from error
        CalibrationError.unless(seconds > 0.0, "--limit", "a positive time", self.limit)
        return seconds

    def handling(self, executor: Executor | None) -> Handling:
        """Say it as the library takes it.

        Parameters
        ----------
        executor : Executor or None
            Of `executor`.
        """
        from calibration.fleet.handling import Handling

        return Handling(executor or self.workers, self.retries, self.force, self.seconds)

    def executor(self, *folders: Path) -> AbstractContextManager[Executor | None]:
        """Connect to the cluster, if there is one.

        Parameters
        ----------
        *folders : Path
            That every worker must see.
        """
        from calibration.fleet.cluster import ClusterExecutor

        return nullcontext() if self.scheduler is None else ClusterExecutor(self.scheduler, folders=list(folders))


def is_folder(case: str, out: str, entry: str = "building.yaml") -> bool:
    """Whether a folder of cases is meant, rather than a case.

    Parameters
    ----------
    case, out : str
        As they were given: paths or URLs.
    entry : str
        File that makes a folder a case.
    """
    from calibration.fleet.run import case_folders
    from calibration.fleet.store import is_url

    if is_url(case) or is_url(out):
        return True
    return not (Path(case) / entry).exists() and bool(case_folders(case, entry))


def of_folder(what: str, case: str, out: str, settings: dict[str, Any], how: How) -> int | None:
    """Do each case in a folder of cases into a folder of its name; one that fails is reported beside the others.

    Parameters
    ----------
    what : {"calibrate", "diagnose", "identify", "compare"}
        The command.
    case, out : str
        As they were given: paths or URLs.
    settings : dict
        Of the command's job.
    how : How
        Workers and limits.

    Returns
    -------
    int or None
        Exit code; None where it is one case.
    """
    from calibration.fleet.store import is_url

    if how.workers is not None and how.scheduler is not None:
        raise CalibrationError("--workers and --scheduler: expected one of them; a cluster has workers of its own")
    job = _job(what)
    if not is_folder(case, out, job.entry):
        if how.workers is not None or how.scheduler is not None:
            raise CalibrationError(
                f"{case}: --workers and --scheduler are for a folder of cases, one folder each; expected {job.entry} "
                "in some of its folders, and not beside them"
            )
        return None
    if is_url(case) or is_url(out):
        return _at_url(what, job, case, out, settings, how)
    return _here(what, job, Path(case), Path(out), settings, how)


def absolute(place: str | None) -> str | None:
    """Spell a path for workers with another working folder; a URL stays.

    Parameters
    ----------
    place : str or None
        As it was given.
    """
    from calibration.fleet.store import is_url

    return place if place is None or is_url(place) else str(Path(place).absolute())


def _job(what: str) -> Job:
    """Job of a command, whose reports look as this process shows them."""
    from mpc.reports.display import Displayed, display

    def shown(files: Any) -> Any:
        return plugins.WithPlugins(Displayed(files, display()), plugins.loaded)

    if what == "calibrate":
        from calibration.fleet.job import calibration_job
        from mpc.reports.calibration import calibration_files

        return calibration_job(shown(calibration_files))
    if what == "diagnose":
        from calibration.fleet.diagnose import diagnosis_job
        from mpc.reports.diagnosis import diagnosis_files

        return diagnosis_job(shown(diagnosis_files))
    from mpc.studies.many import comparison_job, identification_job

    return identification_job(shown) if what == "identify" else comparison_job(shown)


def _here(what: str, job: Job, folder: Path, out: Path, settings: dict[str, Any], how: How) -> int:
    """Do the cases of a folder of this machine."""
    from calibration.fleet.run import case_folders, do_many

    cases = case_folders(folder, job.entry)
    inside = [p for p in sorted(folder.iterdir()) if p.is_dir() and p.name[0] != "."]
    others = [p.name for p in inside if p not in cases and p != out]
    if others:
        complain(f"left out, for want of {job.entry}: {', '.join(others)}")
    try:
        with Waiting(f"{what} cases") as waiting, how.executor(cases[0].parent) as executor:
            outcomes = do_many(
                job, cases, out, settings, how.handling(executor),
                lambda _, done, total: waiting(f"{done} of {total}", done, total),
            )  # fmt: skip
    except KeyboardInterrupt:
        _say_goes_on(str(out))
        raise
    for outcome in outcomes:
        if outcome.error is not None:
            complain(f"error: {outcome.case}: {outcome.error}: {outcome.message}")
        elif outcome.solver is not None and outcome.status == "not_converged":
            name, status = outcome.solver["name"], outcome.solver["status"]
            complain(f"error: {outcome.case}: {name} did not converge: {status}; the results say so too")
    from thermal.case.validation import NO_WINDOWS

    if blind := [outcome.case for outcome in outcomes if outcome.has_windows is False]:
        has = "has" if len(blind) == 1 else "have"
        told = NO_WINDOWS.replace("the building has", f"{len(blind)} of {len(outcomes)} buildings {has}", 1)
        complain(f"warning: {', '.join(blind)}: {told}")
    content = {"cases": {outcome.case: outcome.to_dict() for outcome in outcomes}}
    horizon, report = settings.get("horizon", "6h"), None
    if what in ("calibrate", "diagnose"):
        from mpc.reports.fleet import write_fleet

        report = write_fleet(outcomes, out, what, horizon)
    answer(how.json, content, lambda: _show_outcomes(what, outcomes, horizon, out), report)
    if all(outcome.status in DONE for outcome in outcomes):
        return 0
    return 2 if all(outcome.bad_input for outcome in outcomes) else 1


def _at_url(what: str, job: Job, cases: str, out: str, settings: dict[str, Any], how: How) -> int:
    """Do the cases at a URL, of which only counts and those without results are told."""
    from calibration.fleet.remote import as_url, do_fleet

    try:
        with Waiting(f"{what} cases") as waiting, how.executor() as executor:
            found = do_fleet(
                job, as_url(cases), as_url(out), settings, how.handling(executor),
                lambda _, done, total: waiting(f"{done} of {total}", done, total),
            )  # fmt: skip
    except KeyboardInterrupt:
        _say_goes_on(out)
        raise
    for outcome in found.troubled:
        complain(f"error: {outcome.case}: {outcome.error}: {outcome.message}")
    answer(how.json, found.to_dict(), lambda: _show_counts(found, out))
    if all(status in DONE for status in found.counts):
        return 0
    return 2 if len(found.troubled) == sum(found.counts.values()) and all(o.bad_input for o in found.troubled) else 1


def _say_goes_on(out: str) -> None:
    complain(f"interrupted: what is finished is in {out}, and the same command goes on from there")


def _show_counts(found: FleetOutcome, out: str) -> None:
    rows = [(status.replace("_", " "), count) for status, count in sorted(found.counts.items())]
    show_table("Cases", {"status": "", "cases": ".0f"}, [*rows, ("of these done before", found.resumed)])
    say(f"Results: {out}, with tables for DuckDB in {out}/tables")


def _show_outcomes(what: str, outcomes: Sequence[CaseOutcome], horizon: str, out: Path) -> None:
    rows: list[tuple[Any, ...]] = []
    errs = what in ("calibrate", "diagnose")
    for o in outcomes:
        remarks = (", done before" if o.resumed else "") + (", no windows" if o.has_windows is False else "")
        status = o.error or o.status.replace("_", " ") + remarks
        found = ((o.verdict or "").replace("_", " "), ", ".join(o.effects)) if what == "diagnose" else ()
        errors = (o.held_out_mae_before, o.held_out_mae_after) if errs else ()
        rows.append((o.case, *errors, *found, o.seconds, status))
    before, after = ("calibrated [K]", "handed on [K]") if what == "diagnose" else ("before [K]", "after [K]")
    named = {"verdict": "", "effects": ""} if what == "diagnose" else {}
    numbers = {before: ".3f", after: ".3f"} if errs else {}
    columns = {"case": "", **numbers, **named, "time [s]": ".1f", "status": ""}
    title = f"Held-out error {horizon} ahead" if errs else "Cases"
    show_table(title, columns, rows, more="summary.json lists them all")
    if what == "diagnose":
        effects = Counter(effect for o in outcomes if o.verdict in ("named", "group") for effect in o.effects)
        show_table("Found", {"effect": "", "cases": ".0f"}, effects.most_common())
    say(f"Results: {out}")
