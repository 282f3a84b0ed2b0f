"""Learning environments of others, each in a virtual environment of its own, stepped beside ours in one run.

Neither can be installed by pip alone: the one's package names a dependency by its repository, the other's asks for
versions that no longer go together. uv takes a package without what it asks for, and what it needs is named here.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from pathlib import Path
from typing import Any

_SCRIPTS = Path(__file__).resolve().parent / "peers"

#: Packages by peer: itself, and what it needs.
PEERS = {
    "sinergym": ("sinergym==3.5.1", ("pyenergyplus-lbnl==26.1.0", "gymnasium", "numpy", "pandas<3", "pyyaml", "tqdm",
                                     "rich", "scipy", "xlsxwriter", "eppy", "opyplus==2.0.7")),
    "citylearn": ("citylearn==3.0.2", ("torch==2.13.0", "gymnasium==0.28.1", "numpy<2", "pandas", "pyyaml",
                                       "simplejson", "scikit-learn", "requests", "platformdirs")),
}  # fmt: skip


def run_peer(name: str, folder: Path) -> dict[str, Any]:
    """Install a peer where that was not done, and let its script count.

    Raises
    ------
    subprocess.CalledProcessError
        When it cannot be installed, or does not run.
    """
    home, (itself, needed) = folder.resolve() / name, PEERS[name]
    python, ready = home / "bin" / "python", home / "installed"
    clean = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "PYTHONHOME", "VIRTUAL_ENV")}
    if not ready.exists():
        print(f"install {itself}", file=sys.stderr, flush=True)
        venv.create(home, with_pip=True, clear=True)
        for command in (
            ("pip", "install", "-q", "uv", *needed),
            ("uv", "pip", "install", "-q", "--python", str(python), "--no-deps", itself),
        ):
            subprocess.run([str(python), "-m", *command], check=True, env=clean)
        ready.touch()
    work = home / "work"
    work.mkdir(exist_ok=True)
    ran = subprocess.run(  # there: Sinergym leaves EnergyPlus' files where it was begun
        [str(python), str(_SCRIPTS / f"{name}_speed.py")], cwd=work,
        check=True, env=clean, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True,
    )  # fmt: skip
    told: dict[str, Any] = json.loads(ran.stdout.splitlines()[-1])
    return told


def peer_rates(folder: Path) -> dict[str, dict[str, float]]:
    """Count the steps a second of the peers, by zones and by what is stepped."""
    city, sinergym = run_peer("citylearn", folder), run_peer("sinergym", folder)
    return {
        "1": {
            "CityLearn 3.0.2, steps of an hour, heat demand given": city["plain"],
            "CityLearn 3.0.2, steps of an hour, temperature by a network": city["lstm"],
        },
        "5": {"Sinergym 3.5.1 with EnergyPlus 25.2, steps of 15 minutes": sinergym["rate"]},
    }
