"""The command line to compare with, a simulated rig, and arrays of a joint that is known."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

PROGRAM = os.environ.get("JOINTWATCH", "jointwatch")
RATE_HZ = 1000.0


class Rig:
    """A folder in which the command line runs."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.study = folder / "study.toml"

    def run(self, *words: str) -> subprocess.CompletedProcess:
        return subprocess.run([PROGRAM, *words], cwd=self.folder, capture_output=True, text=True)

    def json(self, *words: str) -> dict:
        done = self.run(*words, "--json", "-")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    def sentence(self, *words: str) -> str:
        """The sentence of a refusal."""
        done = self.run(*words)
        assert done.returncode != 0
        assert done.stderr.startswith("jointwatch: ") and done.stderr.count("\n") == 1
        return done.stderr[len("jointwatch: ") :].rstrip("\n")


@pytest.fixture(scope="session")
def rig(tmp_path_factory: pytest.TempPathFactory) -> Rig:
    """A simulated rig of one axis that hides dry friction."""
    folder = tmp_path_factory.mktemp("rig") / "study"
    words = "simulate --out study --axes 1 --duration 6 --hidden coulomb@x --share 0.15 --seed 3"
    done = subprocess.run([PROGRAM, *words.split()], cwd=folder.parent, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    made = Rig(folder)
    done = made.run("identify", "study.toml", "--model", "physical", "-o", "base.json")
    assert done.returncode == 0, done.stderr
    return made


def motion(rows: int, seed: int = 1) -> tuple:
    """A band-limited motion: displacement, velocity and acceleration, exact."""
    random = np.random.default_rng(seed)
    t = np.arange(rows) / RATE_HZ
    x, v, a = np.zeros(rows), np.zeros(rows), np.zeros(rows)
    for f in np.linspace(1.3, 14.9, 24):
        w, phase = 2 * np.pi * f, random.uniform(0, 2 * np.pi)
        size = 4e-4 * random.uniform(0.5, 1.5)
        x += size * np.sin(w * t + phase)
        v += size * w * np.cos(w * t + phase)
        a -= size * w * w * np.sin(w * t + phase)
    return t, x, v, a


def joint(rows: int = 8000, friction: float = 3.0, seed: int = 1) -> dict:
    """Arrays of a mass of 1.7 kg on a spring and a damper, with dry friction, and noise."""
    t, x, v, a = motion(rows, seed)
    noise = np.random.default_rng(seed + 100).normal(0.0, 0.02, rows)
    restoring = 9e3 * x + 25.0 * v + friction * np.tanh(v / 1e-3)
    return {"t": t, "displacement": x, "force": 1.7 * a + restoring + noise, "acceleration": a}
