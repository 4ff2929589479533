"""Runs the example of a fleet with an extension that is built already.

    python tests/fleet.py LIBRARY PROGRAM FOLDER

LIBRARY is the extension as cargo built it, PROGRAM the command line. FOLDER keeps an environment with numpy, from PyPI. Where something
that the example needs cannot be had a line says SKIPPED, and why.
"""

import subprocess
import sys
from pathlib import Path

from environment import PACKAGE, environment, with_package


def main() -> int:
    library, program, folder = (Path(word).resolve() for word in sys.argv[1:4])
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder / "fleet-venv", ["numpy"])
    with with_package(library, program, folder) as (_, variables):
        words = [str(python), str(PACKAGE / "examples/fleet/run.py"), str(program)]
        return subprocess.run(words, env=variables).returncode


if __name__ == "__main__":
    sys.exit(main())
