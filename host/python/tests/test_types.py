"""`mypy --strict` on the package, its stubs, and a file of typed use."""

import subprocess
import sys
from pathlib import Path

import jointwatch
import pytest

pytest.importorskip("mypy")


def mypy(*files: str) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, "-m", "mypy", "--strict", *files], capture_output=True, text=True)


def test_typed_use_passes_and_wrong_use_does_not(tmp_path) -> None:
    typed = Path(__file__).with_name("typed_use.py")
    passed = mypy(str(typed))
    assert passed.returncode == 0, passed.stdout
    wrong = tmp_path / "wrong_use.py"
    wrong.write_text("import jointwatch as jw\nn: int = jw.Study.open('a').identify('physical').warnings\n")
    assert "Incompatible types" in mypy(str(wrong)).stdout


def test_the_package_passes() -> None:
    passed = mypy("-p", "jointwatch")
    assert passed.returncode == 0, passed.stdout
    assert Path(jointwatch.__file__).with_name("py.typed").exists()
