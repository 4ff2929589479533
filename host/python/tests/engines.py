"""Sums by Ray and by Dask, on this machine: the bytes of plain processes, and the rates of each.

    python tests/engines.py LIBRARY PROGRAM FOLDER [ROWS]

The arguments are those of `spark.py`. Where Ray or Dask cannot be had a line says SKIPPED, and why.
"""

from __future__ import annotations

import sys
import tempfile
import time
from functools import reduce
from operator import add
from pathlib import Path
from typing import Callable

from spark import NEEDED, STUDY, copies, in_environment, log, plain, write

TASKS = 8


def part(study: str, files: list) -> bytes:
    """The sums of some files, as bytes that any engine carries."""
    from jointwatch import Study, Sums

    return bytes(Sums.of_files(Study.open(study), files))


def with_ray(study: str, shares: list) -> list:
    import ray

    task = ray.remote(part)
    return ray.get([task.remote(study, share) for share in shares])


def with_dask(study: str, shares: list) -> list:
    from dask.distributed import get_client

    client = get_client()
    return client.gather(client.map(lambda share: part(study, share), shares))


def measure(here: Path, rows: int) -> None:
    import ray
    from dask.distributed import Client, LocalCluster
    from jointwatch import Sums

    (here / "study.toml").write_text(STUDY.format(time=""))
    write(here / "pilot.parquet", {k: v for k, v in log(20_000, 1.0, 1).items() if k != "t"})
    files = copies(here, rows, 500_000)
    shares = [files[k::TASKS] for k in range(TASKS)]
    start = time.monotonic()
    one = plain(here, files, "plain.acc", 2)
    told = [f"two plain processes {rows / (time.monotonic() - start) / 1e6:.2f} M rows/s"]
    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    client = Client(LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None))
    engines: dict[str, Callable] = {"Ray": with_ray, "Dask": with_dask}
    for name, engine in engines.items():
        start = time.monotonic()
        whole = reduce(add, map(Sums, engine(str(here / "study.toml"), shares)))
        told.append(f"{name} {rows / (time.monotonic() - start) / 1e6:.2f}")
        assert bytes(whole) == one, f"{name} gives other bytes than plain processes"
    print(f"{rows:.1e} rows in {len(files)} files, the same bytes: {', '.join(told)}")
    client.close()
    ray.shutdown()


if __name__ == "__main__":
    if sys.argv[1:2] == ["--inside"]:
        with tempfile.TemporaryDirectory(dir=".") as made:
            measure(Path(made).resolve(), int(float(sys.argv[2])) if len(sys.argv) > 2 else 2_000_000)
    else:
        # Ray and Dask are not what Spark needs, but an environment that has both serves.
        sys.exit(in_environment(str(Path(__file__).resolve()), [*NEEDED, "dask[distributed]", "ray"], sys.argv[1:]))
