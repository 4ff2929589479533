"""What the package's tests run in: an environment from PyPI, and a copy of the package with an extension that is built already."""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Iterator

PACKAGE = Path(__file__).resolve().parent.parent


def environment(folder: Path, needed: list[str]) -> Path:
    """The Python of an environment that has everything; made once. Where it cannot be had a line says SKIPPED, and the program ends."""
    python = folder / ("Scripts/python.exe" if os.name == "nt" else "bin/python")
    made = folder / "made-of"
    wanted = " ".join(needed)
    if made.exists() and made.read_text() == wanted:
        return python
    steps = [
        [sys.executable, "-m", "venv", str(folder)],
        [str(python), "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *needed],
    ]
    for step in steps:
        done = subprocess.run(step, capture_output=True, text=True)
        if done.returncode != 0:
            why = (done.stderr.strip() or done.stdout.strip()).splitlines()[-1:]
            print(f"SKIPPED: {' '.join(step[1:4])} for {needed[-1]} failed, so nobody tried it: {' '.join(why)}")
            sys.exit(0)
    made.write_text(wanted)
    return python


@contextlib.contextmanager
def with_package(library: Path, program: Path, folder: Path) -> Iterator[tuple[Path, dict[str, str]]]:
    """A temporary folder with the package, its tests and examples, and the variables of a process that uses them."""
    with tempfile.TemporaryDirectory(dir=folder) as copy:
        # The fleet's bridge stays where it can be built.
        left_out = shutil.ignore_patterns("src", "*.rs", "__pycache__")
        shutil.copytree(PACKAGE, copy, dirs_exist_ok=True, ignore=left_out)
        package = Path(copy) / "python"
        shutil.copy(library, package / "jointwatch" / f"_native{'.pyd' if os.name == 'nt' else '.abi3.so'}")
        variables = {"PYTHONPATH": str(package), "MYPYPATH": str(package), "JOINTWATCH": str(program)}
        yield Path(copy), {**os.environ, **variables}
