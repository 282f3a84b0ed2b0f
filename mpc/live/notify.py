"""Alarms by mail and webhook: each once, when it begins."""

from __future__ import annotations

import json
import re
import smtplib
import threading
import urllib.request
from collections.abc import Sequence
from datetime import UTC, datetime
from email.message import EmailMessage

from mpc.live.site import NotifyEntry

#: Longest wait for a server [s].
_PATIENCE = 10.0

#: Numbers of an alarm that change while it lasts.
_NUMBERS = re.compile(r"[-+]?\d+(\.\d+)?")


class Notifier:
    """Tells people what is new; a server that does not answer delays nobody.

    Parameters
    ----------
    entry : NotifyEntry
        Who is told.
    site : str
        Name of the site.

    Attributes
    ----------
    trouble : str
        Why the last could not be sent; empty where it was.
    """

    def __init__(self, entry: NotifyEntry, site: str) -> None:
        self.entry, self.site, self.trouble = entry, site, ""
        self._known: set[str] = set()

    def tell(self, alarms: Sequence[str], wall: float) -> list[str]:
        """Send those that were not there the time before; return them.

        Parameters
        ----------
        alarms : sequence of str
            All that there are now.
        wall : float
            Wall clock, since 1970 in UTC [s].
        """
        kinds = {_NUMBERS.sub("#", alarm): alarm for alarm in alarms}
        fresh = [alarm for kind, alarm in kinds.items() if kind not in self._known]
        self._known = set(kinds)
        if fresh:
            threading.Thread(target=self.send, args=(fresh, wall), daemon=True).start()
        return fresh

    def send(self, alarms: Sequence[str], wall: float) -> None:
        """Send alarms, and wait until it is done.

        Parameters
        ----------
        alarms : sequence of str
            One at least.
        wall : float
            Wall clock, since 1970 in UTC [s].
        """
        time = datetime.fromtimestamp(wall, UTC).isoformat(timespec="seconds")
        ways = [way for way, to in ((self._post, self.entry.webhook), (self._mail, self.entry.mail)) if to]
        troubles = []
        for way in ways:
            try:
                way(alarms, time)
            except (OSError, smtplib.SMTPException, ValueError) as error:
                troubles.append(str(error))
        self.trouble = "; ".join(troubles)

    def _post(self, alarms: Sequence[str], time: str) -> None:
        body = json.dumps({"site": self.site, "time": time, "alarms": list(alarms)}).encode()
        headers = {"Content-Type": "application/json"}
        request = urllib.request.Request(str(self.entry.webhook), body, headers, method="POST")
        urllib.request.urlopen(request, timeout=_PATIENCE).close()

    def _mail(self, alarms: Sequence[str], time: str) -> None:
        message = EmailMessage()
        message["Subject"] = " ".join(f"buildingmpc {self.site}: {alarms[0]}".split())[:150]
        message["To"] = message["From"] = str(self.entry.mail)
        message.set_content("\n".join([time, *alarms]))
        host, _, port = self.entry.smtp.partition(":")
        with smtplib.SMTP(host, int(port or 25), timeout=_PATIENCE) as server:
            server.send_message(message)
