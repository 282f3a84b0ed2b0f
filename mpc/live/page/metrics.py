"""What Prometheus is told."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mpc.live.state import read_state
from thermal.plan.guard import extra


def process_use(pid: int) -> tuple[float, float] | None:
    """Tell CPU time [s] and resident memory [bytes] of a process; None where there is none.

    Parameters
    ----------
    pid : int
        Its number.
    """
    try:
        fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK"), int(fields[21]) * os.sysconf("SC_PAGE_SIZE")


def metrics(folder: Path, status: Mapping[str, Any]) -> bytes:
    """Write the metrics of a site.

    Parameters
    ----------
    folder : Path
        Of the site's logs and states.
    status : mapping
        Of the guard; without ``decision`` it is down.
    """
    client = extra("prometheus_client", "live", "metrics")
    registry = client.CollectorRegistry()

    def gauge(name: str, text: str, labels: tuple[str, ...] = ()) -> Any:
        return client.Gauge(f"buildingmpc_{name}", text, labels, registry=registry)

    decision = status.get("decision")
    gauge("guard_up", "Whether the guard answers").set(decision is not None)
    if decision is not None:
        gauge("doubts", "Doubts for which every point is given back").set(len(decision["doubts"]))
        gauge("refused", "Requests that the last tick refused").set(len(decision["refused"]))
        gauge("dropped_total", "Malformed messages").set(status["dropped"])
        held, mode = gauge("held", "Value in force", ("point",)), gauge("mode", "1 in this mode", ("point", "mode"))
        for point, value in decision["held"].items():
            held.labels(point).set(value)
        for point, name in decision["modes"].items():
            mode.labels(point, name).set(1)
        if status["plan"] is not None:
            gauge("plan_age_seconds", "Age of the plan in force").set(status["wall"] - status["plan"]["made"])
    collector = read_state(folder / "collector.json")
    if collector:
        gauge("samples", "Samples of the last reading").set(collector["samples"])
        gauge("samples_lost_total", "Samples that neither database nor disk took").set(collector["lost"])
        gauge("spool_waiting", "Whether samples wait on disk for the database").set(collector["waiting"])
        gauge("points_missing", "Points that the last reading did not get").set(collector["missing"])
    night = read_state(folder / "nightly.json")
    if night:
        gauge("nightly_time_seconds", "When the building was last evaluated, since 1970").set(night["time"])
        lasting = sum(one["until"] == "lasts" for one in night["events"])
        gauge("nightly_changes", "Changes of the building that last").set(lasting)
    cpu = gauge("process_cpu_seconds_total", "CPU time of a part", ("part",))
    memory = gauge("process_resident_memory_bytes", "Resident memory of a part", ("part",))
    for part, pid in read_state(folder / "parts.json").items():
        used = process_use(pid)
        if used is not None:
            cpu.labels(part).set(used[0])
            memory.labels(part).set(used[1])
    return bytes(client.generate_latest(registry))
