"""Alarms reach a webhook and a mail server, one whatever becomes of the other."""

from __future__ import annotations

import json
import socketserver
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler

from mpc.live.notify import Notifier
from mpc.live.site import NotifyEntry


class Web(BaseHTTPRequestHandler):
    def do_POST(self) -> None:
        self.server.got.append(self.rfile.read(int(self.headers["Content-Length"])))  # type: ignore[attr-defined]
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_: object) -> None:
        pass


class Mail(socketserver.StreamRequestHandler):
    def handle(self) -> None:
        self.wfile.write(b"220 stub\r\n")
        while line := self.rfile.readline():
            if line.upper().startswith(b"DATA"):
                self.wfile.write(b"354 go on\r\n")
                lines = iter(self.rfile.readline, b".\r\n")
                self.server.got.append(b"".join(lines))  # type: ignore[attr-defined]
            self.wfile.write(b"221 bye\r\n" if line.upper().startswith(b"QUIT") else b"250 fine\r\n")


@contextmanager
def server(handler: type[socketserver.BaseRequestHandler]) -> Iterator[tuple[int, list[bytes]]]:
    with socketserver.TCPServer(("127.0.0.1", 0), handler) as one:
        one.got = []  # type: ignore[attr-defined]
        thread = threading.Thread(target=one.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        yield one.server_address[1], one.got  # type: ignore[attr-defined]
        one.shutdown()
        thread.join()


def test_alarms_are_posted_and_mailed() -> None:
    with server(Web) as (web, posted), server(Mail) as (smtp, mailed):
        entry = NotifyEntry(webhook=f"http://127.0.0.1:{web}/a", mail="me@example.org", smtp=f"127.0.0.1:{smtp}")
        told = Notifier(entry, "hall")
        told.send(["the plan is old\r\nBcc: all@example.org", "b"], 0.0)
        assert told.trouble == ""
    assert json.loads(posted[0]) == {"site": "hall", "time": "1970-01-01T00:00:00+00:00",
                                     "alarms": ["the plan is old\r\nBcc: all@example.org", "b"]}  # fmt: skip
    head, _, text = mailed[0].partition(b"\r\n\r\n")
    assert b"Subject: buildingmpc hall: the plan is old Bcc: all@example.org" in head and b"\r\nBcc" not in head
    assert b"1970-01-01T00:00:00" in text


def test_a_webhook_that_is_down_keeps_no_mail_back() -> None:
    with server(Mail) as (smtp, mailed):
        told = Notifier(NotifyEntry(webhook="http://127.0.0.1:9/a", mail="me@x.org", smtp=f"127.0.0.1:{smtp}"), "hall")
        told.send(["a"], 0.0)
    assert len(mailed) == 1 and "refused" in told.trouble
