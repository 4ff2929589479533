"""Figures of the wheel: time of the import, and of a prediction of ten million rows.

    python tests/speed.py [ROWS [FOLDER]]

The models are left in FOLDER, for whoever wants to hold the library's own call beside it.
"""

import subprocess
import sys
import time

import numpy as np

import jointwatch as jw
from conftest import joint


def imported_ms() -> float:
    line = "import time; t = time.perf_counter(); import jointwatch; print(1e3 * (time.perf_counter() - t))"
    times = [float(subprocess.check_output([sys.executable, "-c", line])) for _ in range(7)]
    return sorted(times)[len(times) // 2]


def main() -> None:
    rows = int(float(sys.argv[1])) if len(sys.argv) > 1 else 10_000_000
    print(f"import: {imported_ms():.0f} ms")
    data = joint(4000)
    study = jw.Study.from_arrays(t=data["t"], force=data["force"], displacement=data["displacement"], inertia=1.7)
    x, v = 1e-3 * np.sin(np.arange(rows) * 1e-2), 1e-1 * np.cos(np.arange(rows) * 1e-2)
    for kind in ("physical", "polynomial"):
        model = study.identify(kind)
        times = []
        for _ in range(5):
            begun = time.perf_counter()
            model.predict(x, v)
            times.append(time.perf_counter() - begun)
        print(f"{kind}, {rows} rows: {min(times):.3f} s")
        if len(sys.argv) > 2:
            model.save(f"{sys.argv[2]}/{kind}.json")


if __name__ == "__main__":
    main()
