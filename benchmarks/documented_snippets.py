"""Every block of code of README and documentation, run as printed: what passes, its time, what is not run and why.

Run: ``python benchmarks/documented_snippets.py --out results/snippets [PAGE ...]``; ``--quick`` leaves out
what the tests leave out.
"""

from __future__ import annotations

import argparse
from dataclasses import asdict
from pathlib import Path

from _snippets import ROOT, Outcome, Snippet, pages, run_page, snippets
from _table import markdown, write


def _result(snippet: Snippet, outcome: Outcome | None) -> tuple[str, str]:
    """Say what became of a block, and its CPU time [s]."""
    if outcome:
        return "as printed" if outcome.passed else "FAILED", f"{outcome.cpu:.1f}"
    missing = f"{snippet.missing} is not installed" if snippet.missing else "not reached"
    return snippet.reason or missing, ""


def main() -> None:
    """Run the pages, print a line a block, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("pages", nargs="*", type=Path, help="pages to run; all by default")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--quick", action="store_true", help="without the blocks that are marked as slow")
    options = parser.parse_args()
    chosen = [page.resolve() for page in options.pages] or pages()
    blocks = [s for page in chosen for s in snippets(page)]
    done: dict[str, Outcome] = {}
    for page in chosen:
        for outcome in run_page(page, slow=not options.quick):
            done[outcome.where] = outcome
            said = "passed" if outcome.passed else f"FAILED\n{outcome.said}\n"
            print(f"{outcome.where}: {outcome.cpu:.1f} s of CPU, {said}", flush=True)
    rows = [(s.where, s.language, s.kind, *_result(s, done.get(s.where))) for s in blocks]
    counts = {kind: sum(s.kind == kind for s in blocks) for kind in ("quick", "slow", "file", "not run")}
    failed = [where for where, outcome in done.items() if not outcome.passed]
    said = ", ".join(f"{number} {kind}" for kind, number in counts.items())
    table = markdown(["block", "language", "set", "result", "CPU [s]"], rows)
    table += f"\n{len(blocks)} blocks: {said}; {len(failed)} failed.\n"
    data = {"blocks": [asdict(s) for s in blocks], "outcomes": [asdict(o) for o in done.values()], "counts": counts}
    write(options.out, "documented_snippets", table, data, False)
    print(table.splitlines()[-1])
    if failed:
        raise SystemExit(f"failed in {ROOT.name}: " + ", ".join(failed))


if __name__ == "__main__":
    main()
