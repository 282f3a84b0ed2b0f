"""Pages of the API: one a module, made while the documentation is built (mkdocs-gen-files), and their navigation."""

from pathlib import Path

import mkdocs_gen_files

ROOT = Path(__file__).parents[1]
PACKAGES = ("thermal", "calibration", "mpc")

nav = mkdocs_gen_files.Nav()
for path in (path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))):
    parts = path.relative_to(ROOT).with_suffix("").parts
    if parts[-1] == "__main__" or parts[:2] == ("mpc", "cli"):  # commands document themselves: buildingmpc --help
        continue
    parts, page = (parts[:-1], "index.md") if parts[-1] == "__init__" else (parts, f"{parts[-1]}.md")
    if page == "index.md" and len(parts) > 1:
        continue
    name = ".".join(parts)
    file = Path(*parts[:-1], page) if page != "index.md" else Path(*parts, page)
    nav[parts if page != "index.md" else (*parts, "what it hands on")] = file.as_posix()
    with mkdocs_gen_files.open(Path("api") / file, "w") as out:
        out.write(f"# `{name}`\n\n::: {name}\n    options:\n      heading_level: 2\n")

with mkdocs_gen_files.open("api/SUMMARY.md", "w") as out:
    out.write("---\nsearch: {exclude: true}\n---\n")
    out.writelines(nav.build_literate_nav())
