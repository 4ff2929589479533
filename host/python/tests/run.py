"""Runs the package's tests with an extension that is built already.

    python tests/run.py LIBRARY PROGRAM FOLDER [PYTEST OPTIONS]

LIBRARY is the extension as cargo built it, PROGRAM the command line to compare with. FOLDER keeps an environment with what the
tests need, from PyPI; where that cannot be had a line says SKIPPED, and why.
"""

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

NEEDED = ["pytest", "numpy", "pandas", "pyarrow", "polars", "scikit-learn", "mypy", "tqdm"]
HERE = Path(__file__).resolve().parent


def environment(folder: Path) -> Path:
    """The Python of an environment that has everything; made once."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    made = folder / "made-of"
    wanted = " ".join(NEEDED)
    if made.exists() and made.read_text() == wanted:
        return python
    steps = [
        [sys.executable, "-m", "venv", str(folder)],
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *NEEDED],
    ]
    for step in steps:
        done = subprocess.run(step, capture_output=True, text=True)
        if done.returncode != 0:
            why = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
            print(f"SKIPPED: {' '.join(step[1:4])} failed, so nobody tried the Python package: {' '.join(why)}")
            sys.exit(0)
    made.write_text(wanted)
    return python


def main() -> int:
    library, program, folder = (Path(word).resolve() for word in sys.argv[1:4])
    folder.mkdir(parents=True, exist_ok=True)
    python = environment(folder / "venv")
    with tempfile.TemporaryDirectory(dir=folder) as copy:
        shutil.copytree(HERE.parent, copy, dirs_exist_ok=True, ignore=shutil.ignore_patterns("src", "*.rs", "__pycache__"))
        package = Path(copy) / "python"
        ending = ".pyd" if os.name == "nt" else ".abi3.so"
        shutil.copy(library, package / "jointwatch" / f"_native{ending}")
        variables = {
            "PYTHONPATH": str(package),
            "MYPYPATH": str(package),
            "JOINTWATCH": str(program),
            # Two runs of one day give the same bytes; so do two that midnight parts.
            "SOURCE_DATE_EPOCH": "1773446400",
        }
        words = [str(python), "-m", "pytest", "-q", "-p", "no:cacheprovider", *sys.argv[4:]]
        return subprocess.run(words, cwd=copy, env={**os.environ, **variables}).returncode


if __name__ == "__main__":
    sys.exit(main())
