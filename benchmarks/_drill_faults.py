"""Faults of drills: how each is made, when it takes effect, how it is healed."""

from __future__ import annotations

import random
import resource
import signal
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass

from _drill_process import HANGS
from _drill_stack import RATE, STEP, STUCK, Stack

from mpc.live.clock import set_clock
from mpc.live.guard.socket import GuardClient
from mpc.live.operators import operator_key, sign

Seconds = float  # of the machine's monotonic clock


@dataclass(frozen=True)
class Fault:
    """A fault.

    Parameters
    ----------
    make : callable
        Brings it about; returns the machine's time from which on a control step is counted, or None where it is known
        at the end only.
    heal : callable
        Undoes it; returns that time where `make` did not.
    released : bool
        Whether every point must be given back within a control step of that time; else none may be.
    healed_first : bool
        Whether nobody can give anything back before it is healed.
    """

    make: Callable[[Stack, random.Random], Seconds | None]
    heal: Callable[[Stack, random.Random], Seconds | None]
    released: bool = True
    healed_first: bool = False


def _nothing(stack: Stack, rng: random.Random) -> None:
    """Heal nothing."""


def _kill(part: str) -> Callable[[Stack, random.Random], Seconds]:
    def make(stack: Stack, rng: random.Random) -> Seconds:
        time.sleep(rng.uniform(0.0, STEP / RATE))
        stack.signal(part, signal.SIGKILL)
        return time.monotonic()

    return make


def _start(part: str) -> Callable[[Stack, random.Random], Seconds]:
    def heal(stack: Stack, rng: random.Random) -> Seconds:
        before = len(stack.events(part))
        stack.start(part)
        stack.wait(lambda: len(stack.events(part)) > before, 40.0)
        return time.monotonic()

    return heal


def _pause(part: str) -> Callable[[Stack, random.Random], Seconds]:
    def make(stack: Stack, rng: random.Random) -> Seconds:
        stack.signal(part, signal.SIGSTOP)
        if part == "guard":
            time.sleep(1.5 * STEP / RATE)
        return time.monotonic()

    return make


def _resume(part: str) -> Callable[[Stack, random.Random], Seconds]:
    def heal(stack: Stack, rng: random.Random) -> Seconds:
        stack.signal(part, signal.SIGCONT)
        return time.monotonic()

    return heal


def _cut(stack: Stack, rng: random.Random) -> None:
    stack.building.wire.cut = True
    time.sleep(rng.uniform(0.3, 1.5) * STEP / RATE)


def _join(stack: Stack, rng: random.Random) -> Seconds:
    stack.building.wire.cut = False
    return time.monotonic()


def _stuck(stack: Stack, rng: random.Random) -> Seconds:
    stack.building.frozen = True
    begin = time.monotonic() + STUCK / RATE  # from then on it counts as stuck
    stack.wait(lambda: time.monotonic() >= begin, 10.0)
    return begin


def _shown(value: float) -> Callable[[Stack, random.Random], Seconds]:
    def make(stack: Stack, rng: random.Random) -> Seconds:
        stack.building.absurd = value + rng.random()
        return time.monotonic()

    return make


def _moving(stack: Stack, rng: random.Random) -> None:
    stack.building.frozen, stack.building.absurd = False, None


def _no_number(stack: Stack, rng: random.Random) -> Seconds:
    """Have the wire put NaN into the place of a value that the device shows."""
    stack.building.absurd = 21.0625  # a value whose bytes no other has
    stack.wait(lambda: False, 0.2)
    stack.building.wire.replace = {struct.pack(">f", 21.0625): struct.pack(">f", float("nan"))}
    return time.monotonic()


def _number(stack: Stack, rng: random.Random) -> None:
    stack.building.wire.replace, stack.building.absurd = {}, None


def _refuse(everything: bool) -> Callable[[Stack, random.Random], Seconds | None]:
    def make(stack: Stack, rng: random.Random) -> Seconds | None:
        wire, before = stack.building.wire, len(stack.building.wire.journal)
        wire.refuse_all, wire.refuse_values = everything, True
        stack.wait(lambda: any(not w.answered for w in wire.journal[before:]), 3.0)
        first = next((w.time for w in wire.journal[before:] if not w.answered), None)
        if everything:
            stack.wait(lambda: False, 0.5)
        return None if everything else first

    return make


def _accept(stack: Stack, rng: random.Random) -> Seconds:
    stack.building.wire.refuse_all = stack.building.wire.refuse_values = False
    return time.monotonic()


def _jump(seconds: float) -> Callable[[Stack, random.Random], Seconds]:
    def make(stack: Stack, rng: random.Random) -> Seconds:
        path = stack.site.folder / "clock.json"
        set_clock(path, stack.clock.wall() + seconds * rng.uniform(0.5, 1.5))
        return time.monotonic()

    return make


def _down(stack: Stack, rng: random.Random) -> Seconds:
    time.sleep(rng.uniform(0.0, STEP / RATE))
    stack.database.stop()
    return time.monotonic()


def _up(stack: Stack, rng: random.Random) -> None:
    stack.database.start()


def _fill(stack: Stack, rng: random.Random) -> Seconds:
    """Leave the database's file system no byte."""
    path = stack.folder / "pg" / "filler"
    with path.open("wb", buffering=0) as file:
        for size in (1 << 20, 1 << 12, 1):
            try:
                while True:
                    file.write(b"\0" * size)
            except OSError:
                continue
    before = len(stack.events("collector"))
    stack.wait(lambda: any(e["content"].get("where") == "spooled" for e in stack.events("collector")[before:]), 20.0)
    return time.monotonic()


def _empty(stack: Stack, rng: random.Random) -> None:
    (stack.folder / "pg" / "filler").unlink(missing_ok=True)
    stack.database.restart()


def _no_disk(stack: Stack, rng: random.Random) -> Seconds:
    """Let the guard's files not grow any more, as on a full disk."""
    resource.prlimit(stack.processes["guard"].pid, resource.RLIMIT_FSIZE, (1, resource.RLIM_INFINITY))
    return time.monotonic()


def _hang(stack: Stack, rng: random.Random) -> Seconds:
    """Let the disk take the guard's lines no more, without a word."""
    (stack.site.folder / HANGS).touch()
    return time.monotonic()


def _free(stack: Stack, rng: random.Random) -> Seconds:
    (stack.site.folder / HANGS).unlink()
    return _new_guard(stack, rng)


def _new_guard(stack: Stack, rng: random.Random) -> Seconds:
    stack.processes["guard"].ended(20.0)
    return _start("guard")(stack, rng)


def _input(name: str, value: float, status: str) -> Callable[[Stack, random.Random], Seconds]:
    """Have an input at which the controller fails, and wait for its first plan that did."""

    def make(stack: Stack, rng: random.Random) -> Seconds:
        before = len(stack.events("controller"))
        setattr(stack.building, name, value)
        found: list[float] = []

        def failed() -> bool:
            for event in stack.events("controller")[before:]:
                plan = event["content"].get("plan", {"status": "planned", "values": {}, "made": 0.0})
                if status in plan["status"] and (status != "planned" or 400.0 in plan["values"].values()):
                    found.append(time.monotonic() - (stack.clock.wall() - plan["made"]) / RATE)
                    return True
            return False

        stack.wait(failed, 6.0)
        return found[0] if found else time.monotonic()

    return make


def _mild(stack: Stack, rng: random.Random) -> None:
    stack.building.outdoor = stack.building.heat = None


def _edit(stack: Stack, rng: random.Random) -> Seconds:
    """Edit the site's file and start the controller anew, as somebody does who forgets the guard."""
    text = stack.site_path.read_text(encoding="utf-8")
    stack.site_path.write_text(text + f"# edited {rng.random()}\n", encoding="utf-8")
    stack.signal("controller", signal.SIGKILL)
    begin = time.monotonic()
    stack.start("controller")
    return begin


def _guard_too(stack: Stack, rng: random.Random) -> None:
    stack.signal("guard", signal.SIGTERM)
    _start("guard")(stack, rng)


def _override(point: int) -> Callable[[Stack, random.Random], Seconds]:
    def make(stack: Stack, rng: random.Random) -> Seconds:
        stack.building.operate(point, round(rng.uniform(16.0, 26.0), 2), rng.choice([1, 5, 8, 12]))
        return time.monotonic()

    return make


def _no_override(stack: Stack, rng: random.Random) -> None:
    for point, priority in list(stack.building.now):
        if priority != 13:
            stack.building.operate(point, None, priority)


def _strangers(stack: Stack, rng: random.Random) -> Seconds:
    """Flood the guard with what nobody may ask for."""
    client, wall = GuardClient(stack.site.sockets), stack.clock.wall()
    good = sign({"kind": "mode", "points": [], "mode": "act"}, operator_key(stack.site.folder), wall, "x")
    forged = sign({"kind": "mode", "points": ["north/zone_air_heating_temperature_setpoint"], "mode": "shadow"},
                  b"another key" * 3, wall, "x")  # fmt: skip
    for message in (
        {"kind": "mode"}, {"kind": "approve", "plan": 1}, forged, good, good, {"kind": "write", "value": 99.0}, {},
        {"kind": "approve", "points": ["'; DROP TABLE sample; --"], "plan": 1, "by": "", "nonce": "", "expires": 9e99,
         "signature": ""},
    ):  # fmt: skip
        client.ask(message)
    for line in (b"\xff\xfe\n", b'{"kind": "plan", "plan": {"made": 1e999}}\n', b"[" * 5000 + b"\n", b"A" * 3_000_000):
        raw = GuardClient(stack.site.sockets)
        raw.ask({"kind": "status"})
        try:
            raw._socket.sendall(line)  # type: ignore[union-attr]
        except OSError:
            pass
        raw.close()
    for _ in range(300):
        client.ask(forged)
    client.close()
    return time.monotonic()


FAULTS: dict[str, Fault] = {
    "controller killed": Fault(_kill("controller"), _start("controller")),
    "controller hangs": Fault(_pause("controller"), _resume("controller")),
    "collector killed": Fault(_kill("collector"), _start("collector")),
    "guard killed": Fault(_kill("guard"), _start("guard"), healed_first=True),
    "guard hangs": Fault(_pause("guard"), _resume("guard"), healed_first=True),
    "sensor stands still": Fault(_stuck, _moving),
    "sensor shows no number": Fault(_no_number, _number),
    "sensor shows 150 degC": Fault(_shown(150.0), _moving),
    "writes refused": Fault(_refuse(False), _accept),
    "writes and releases refused": Fault(_refuse(True), _accept, healed_first=True),
    "operator overrides the first": Fault(_override(1), _no_override, released=False),
    "operator overrides the second": Fault(_override(2), _no_override, released=False),
    "network cut": Fault(_cut, _join, healed_first=True),
    "clock jumps ahead": Fault(_jump(3600.0), _nothing),
    "clock jumps back": Fault(_jump(-1200.0), _nothing),
    "database down": Fault(_down, _up),
    "database full": Fault(_fill, _empty),
    "disk of the log full": Fault(_no_disk, _new_guard),
    "disk of the log hangs": Fault(_hang, _free),
    "solver fails": Fault(_input("outdoor", -60.0, "did not converge"), _mild),
    "plan without numbers": Fault(_input("outdoor", 35.0, "no number"), _mild),
    "plan out of range": Fault(_input("heat", 1e6, "planned"), _mild),
    "configuration edited": Fault(_edit, _guard_too),
    "strangers ask": Fault(_strangers, _nothing, released=False),
}  # fmt: skip
