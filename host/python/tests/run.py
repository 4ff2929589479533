"""Runs the package's tests with an extension that is built already.

    python tests/run.py LIBRARY PROGRAM FOLDER [PYTEST OPTIONS]

LIBRARY is the extension as cargo built it, PROGRAM the command line to compare with. FOLDER keeps an environment with what the
tests need, from PyPI; where that cannot be had a line says SKIPPED, and why.
"""

import subprocess
import sys
from pathlib import Path

from environment import environment, with_package

NEEDED = ["pytest", "numpy", "pandas", "pyarrow", "polars", "scikit-learn", "mypy", "tqdm"]


def main() -> int:
    library, program, folder = (Path(word).resolve() for word in sys.argv[1:4])
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder / "venv", NEEDED)
    with with_package(library, program, folder) as (copy, variables):
        # Two runs of one day give the same bytes; so do two that midnight parts.
        variables["SOURCE_DATE_EPOCH"] = "1773446400"
        words = [str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", *sys.argv[4:]]
        return subprocess.run(words, cwd=copy, env=variables).returncode


if __name__ == "__main__":
    sys.exit(main())
