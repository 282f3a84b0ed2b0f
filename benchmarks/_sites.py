"""The buildings that optimal control and learned policies are compared on, by name."""

from __future__ import annotations

from _medium_office_site import MediumOfficeSite
from _office_site import OfficeSite
from _site import Site

SITES: dict[str, Site] = {site.key: site for site in (OfficeSite(), MediumOfficeSite())}
