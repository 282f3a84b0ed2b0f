"""Repeats what a log says was decided, and compares it bit for bit."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mpc.errors import LiveError
from mpc.live.audit import canonical, code_version, read_log
from mpc.live.guard.decide import Guard, GuardState
from mpc.live.guard.rules import GuardRules
from mpc.live.planner import Planner
from mpc.live.site import Site


@dataclass
class Replay:
    """What came of a replay.

    Parameters
    ----------
    lines, decisions : int
        Events read, and decisions or plans that were repeated.
    broken : str
        Where the chain of hashes breaks; empty where it holds.
    different : list of str
        Decisions that do not repeat.
    notes : list of str
        What was not repeated, and why.
    last : str
        Hash of the last event.
    guard : Guard or None
    planner : Planner or None
        As they stand at the end, for a file that goes on from this one.
    """

    lines: int = 0
    decisions: int = 0
    broken: str = ""
    different: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    last: str = ""
    guard: Guard | None = field(default=None, repr=False)
    planner: Planner | None = field(default=None, repr=False)

    @property
    def fine(self) -> bool:
        """Whether the chain holds and everything repeated."""
        return not self.broken and not self.different


def replay_logs(paths: Iterable[Path], site: Path | None = None) -> dict[Path, Replay]:
    """Repeat files of audit logs, each of which goes on from the one before of its process.

    Parameters
    ----------
    paths : iterable of Path
        In the order of `mpc.live.audit.log_files`.
    site : Path, optional
        As of `replay_log`.
    """
    found, last = dict[Path, Replay](), dict[str, Replay]()
    for path in paths:
        process = path.name.rpartition("-")[0]
        earlier = last.get(process)
        one = found[path] = replay_log(path, site, earlier)
        if one.last:
            last[process] = one
            if earlier is not None:
                earlier.guard = earlier.planner = None  # each holds a solver
    return found


def replay_log(path: Path, site: Path | None = None, earlier: Replay | None = None) -> Replay:
    """Repeat a file of an audit log.

    Parameters
    ----------
    path : Path
        Of the guard, the controller or the collector.
    site : Path, optional
        The ``site.yaml`` of that time, which plans are repeated with; the decisions of the guard need none.
    earlier : Replay, optional
        Of the file before, which this one must go on from.

    Raises
    ------
    LiveError
        When the file cannot be read, or the site is another one.
    """
    LiveError.unless(path.is_file(), str(path), "a file of an audit log", "no such file")
    found, passed = Replay(), earlier or Replay()
    events = read_log(path, passed.last or None)
    while True:
        try:
            at, entry = next(events)
        except StopIteration:
            return found
        except LiveError as error:
            found.broken = str(error)
            return found
        found.lines, found.last = found.lines + 1, entry["hash"]
        kind, content = entry["kind"], entry["content"]
        if kind == "start":
            _note_code(found, content)
            if "rules" in content:
                rules = GuardRules.from_dict(content["rules"])
                found.guard = Guard(rules, content["modes"], content["held_before"])
            elif "controller" in content:
                found.planner = _planner(site, content, found)
        elif kind == "turned":
            _note_code(found, content)
            _go_on(found, passed, path, at, content)
            if "controller" in content and site is not None and found.planner is None:
                found.notes.append(f"plans of {path.name} are repeated together with the files before it only")
        elif kind == "tick" and found.guard is not None:
            _compare(found, path, at, found.guard.decide(content["tick"]), content["decision"])
        elif kind == "start_up" and found.planner is not None:
            found.planner.start_up(content["past"], content["begin"])
        elif kind == "plan" and found.planner is not None:
            again = found.planner.plan(content["inputs"])
            _compare(found, path, at, again, {key: content["plan"].get(key) for key in again})


def _go_on(found: Replay, passed: Replay, path: Path, at: int, content: dict[str, Any]) -> None:
    """Take over what the file before ended with; a guard tells its state anew."""
    if "state" in content:
        if passed.guard is not None and canonical(passed.guard.state.to_dict()) != canonical(content["state"]):
            found.different.append(f"{path.name}: line {at}: another state than that at the end of the file before")
        found.guard = Guard(GuardRules.from_dict(content["rules"]))
        found.guard.state = GuardState.from_dict(content["state"])
    else:
        found.planner = passed.planner


def _note_code(found: Replay, content: dict[str, Any]) -> None:
    if content["code"] != code_version():
        found.notes.append(f"the log was written by {content['code']}, and is repeated by {code_version()}")


def _planner(site: Path | None, content: dict[str, Any], found: Replay) -> Planner | None:
    if site is None:
        found.notes.append("plans are not repeated without the site: pass --site site.yaml")
        return None
    read = Site(site)
    LiveError.unless(
        read.hash == content["configuration"], site.name, f"configuration {content['configuration'][:12]} of the log",
        read.hash[:12], "take the site's and plant's files and the model of that time",
    )  # fmt: skip
    return Planner(read)


def _compare(found: Replay, path: Path, at: int, again: Any, logged: Any) -> None:
    found.decisions += 1
    if canonical(again) != canonical(logged):
        keys = [key for key in again if canonical(again[key]) != canonical(logged.get(key))]
        found.different.append(f"{path.name}: line {at}: other {', '.join(keys)}")
