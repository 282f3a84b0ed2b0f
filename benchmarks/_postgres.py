"""A PostgreSQL server of one's own in a folder, from Debian's packages."""

from __future__ import annotations

import os
import shutil
import subprocess
import time
from pathlib import Path


def programs() -> Path | None:
    """Folder with initdb and postgres: Debian keeps them out of the path."""
    found = shutil.which("initdb")
    places = sorted(Path("/usr/lib/postgresql").glob("*/bin"), reverse=True)
    places = [Path(found).resolve().parent, *places] if found else places
    return next((place for place in places if (place / "initdb").exists()), None)


class PostgresServer:
    """A server on a Unix socket in its folder.

    Parameters
    ----------
    folder : Path
        Empty; every folder above it must let others in, for the server does not run as root.
    settings : str
        Further settings, such as ``-c temp_file_limit=1``.

    Raises
    ------
    RuntimeError
        When there is none to run, in words that a test skips with.
    """

    def __init__(self, folder: Path, settings: str = "") -> None:
        binaries = programs()
        if binaries is None:
            raise RuntimeError("needs a PostgreSQL server (Debian: apt install postgresql)")
        self.folder, as_user = folder, list[str]()
        if os.geteuid() == 0:  # the server refuses to run as root
            runner = shutil.which("runuser")
            if runner is None or subprocess.run(["id", "postgres"], capture_output=True, check=False).returncode:
                raise RuntimeError("PostgreSQL does not run as root, and there is no user postgres to run it as")
            as_user = [runner, "-u", "postgres", "--"]
            shutil.chown(folder, "postgres")
        made = subprocess.run(
            [*as_user, str(binaries / "initdb"), "-D", f"{folder}/data", "-U", "tester", "-A", "trust", "--no-sync"],
            capture_output=True, text=True, check=False, cwd=folder,
        )  # fmt: skip
        if made.returncode:
            raise RuntimeError(f"PostgreSQL's initdb does not work here: {made.stderr.strip()[-200:]}")
        options = f"-k {folder} -c listen_addresses='' -c fsync=off {settings}"
        self._control = [*as_user, str(binaries / "pg_ctl"), "-D", str(folder / "data"), "-w", "-o", options,
                         "-l", str(folder / "log")]  # fmt: skip
        self.address = f"postgresql://tester:secret@/postgres?host={folder}"

    def start(self) -> None:
        """Begin, or go on after `stop`: on a busy machine the last of its processes take a moment to leave."""
        for left in reversed(range(5)):
            done = subprocess.run([*self._control, "start"], check=not left, capture_output=True, cwd=self.folder)
            if not done.returncode:
                return
            time.sleep(1.0)

    def stop(self) -> None:
        """Stop at once, as a crash does; what was committed stays."""
        subprocess.run([*self._control, "-m", "immediate", "stop"], check=True, capture_output=True, cwd=self.folder)

    def restart(self) -> None:
        """Begin anew, whether it runs or not."""
        subprocess.run([*self._control, "-m", "immediate", "restart"], check=True, capture_output=True, cwd=self.folder)
