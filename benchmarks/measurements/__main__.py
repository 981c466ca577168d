"""Compare the cable with measurements; write docs/measurements.md and the table in README.md."""

from __future__ import annotations

import argparse
import json
import time
from functools import partial

from benchmarks import measurements
from benchmarks.measurements import page


def main() -> None:
    """Compute, print and keep all numbers, and write the pages; or write them from what was kept."""
    parser = argparse.ArgumentParser(
        description=measurements.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--page", action="store_true", help="compute nothing")
    start = time.perf_counter()
    if not parser.parse_args().page:
        kept = page.compute(partial(print, flush=True))
        page.KEPT.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")
    page.write(page.read())
    print(f"{page.summary(page.read())}\n{time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
