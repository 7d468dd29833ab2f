"""Long runs on the board."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from statistics import median
from typing import Any

from hil.cases.stream import streaming
from hil.harness.rig import Rig
from hil.harness.runner import Measured
from hil.harness.waits import wait_for

_FRAMES = 10_000


@contextmanager
def without_huge_pages(rig: Rig) -> Iterator[None]:
    """Disables transparent huge pages. Otherwise the kernel merges small pages while a process runs, and their
    untouched parts count as its memory: a step of 3.5 MB within the first minutes."""
    switch = "/sys/kernel/mm/transparent_hugepage/enabled"
    before = rig.board.run(f"cat {switch}", check=True).out.split("[")[1].split("]")[0]
    rig.board.run(f"echo never > {switch}", check=True)
    try:
        yield
    finally:
        rig.board.run(f"echo {before} > {switch}", check=True)


def ten_thousand_frames(rig: Rig, test: Any, measured: Measured) -> None:
    """Memory, threads and file descriptors of lightwelld over ten thousand frames, with a client connected."""
    with without_huge_pages(rig), streaming(rig, test) as (outside, uri, _):
        first = rig.snapshot(outside, uri)
        seen: list[tuple[float, dict[str, int]]] = []
        pools: list[dict[str, tuple[int, int]]] = []

        def enough() -> bool:
            frames = rig.info(uri)["frames"] - first["frames"]
            seen.append((frames, rig.daemon()))
            pools.append(rig.pool_threads())
            return frames >= _FRAMES

        # Sampled only every few seconds, because sampling takes time of the board's processors.
        wait_for(f"{_FRAMES} frames", enough, test.limit_s - 60, every_s=6)
        last = rig.snapshot(outside, uri)
    # Pools and caches have reached their size after a fifth of the frames.
    settled = [(frames, daemon) for frames, daemon in seen if frames >= _FRAMES / 5]
    measured.figure("frames", seen[-1][0], "", f">= {_FRAMES}")
    measured.figure("of these, frames that became light", last["estimates"] - first["estimates"])
    measured.figure("memory, all and its own, every fifth look",
                    ", ".join(f"{daemon['rss_kb']}/{daemon['own_kb']}" for _, daemon in seen[::5]), "kB")
    # Anonymous memory only: pages of programs and libraries are read on first use, and the kernel may drop them again.
    # The median ignores single steps of the allocator; a leak grows between all samples. Leaking one descriptor per
    # frame would be more than 100 kB per thousand frames.
    steps = [1000 * (b["own_kb"] - a["own_kb"]) / (n - m) for (m, a), (n, b) in zip(settled, settled[1:]) if n > m]
    measured.figure("its own memory, median growth from look to look", median(steps), "kB in a thousand frames",
                    "<= 10")
    measured.figure("its own memory, grown over the last four fifths",
                    settled[-1][1]["own_kb"] - settled[0][1]["own_kb"], "kB", "<= 800")
    measured.figure("threads more than after a fifth, without gRPC's pools",
                    seen[-1][1]["threads"] - settled[0][1]["threads"], "", "<= 0")
    # The pools grow up to their limit when work coincides, possibly after hours, so their growth is not a leak.
    measured.figure("threads of gRPC's pools, first and last, of so many at most", "; ".join(
        f"{name} {pools[0][name][0]}, {threads} of {most}" for name, (threads, most) in pools[-1].items()))
    measured.figure("threads of gRPC's pools over their bound, at any look",
                    max(max(0, threads - most) for look in pools for threads, most in look.values()), "", "<= 0")
    measured.figure("handles more than after a fifth", seen[-1][1]["handles"] - settled[0][1]["handles"], "", "<= 0")
    measured.figure("restarts", seen[-1][1]["restarts"] - seen[0][1]["restarts"], "", "== 0")
