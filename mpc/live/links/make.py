"""Connections of a site."""

from __future__ import annotations

from mpc.live.links.bacnet import BacnetConnection
from mpc.live.links.link import Link
from mpc.live.links.mqtt import MqttConnection
from mpc.live.site import Site
from mpc.live.site_file import BacnetLink, MqttLink


def make_links(site: Site) -> dict[str, Link]:
    """Make the connections of a site, to be opened, by name.

    Parameters
    ----------
    site : Site
        As read.
    """
    made: dict[str, Link] = {}
    for name, link in site.file.connections.items():
        points = {
            point: (entry.at, site.conversions[point])
            for point, entry in site.file.points.items()
            if entry.connection == name
        }
        if isinstance(link, BacnetLink):
            made[name] = BacnetConnection(link, points)
        elif isinstance(link, MqttLink):
            made[name] = MqttConnection(link, points, site.path.parent)
    return made
