"""Faults of camera, network, clock, process, disk and memory: the probe counts each and recovers within a stated
time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hil.cases.stream import MAX_UNCOUNTED, streaming, unknown_to_client
from hil.harness.rig import Rig, UsbCamera
from hil.harness.runner import Measured
from hil.harness.waits import TimedOut, wait_for


def check_daemon_survived(rig: Rig, before: dict[str, int], measured: Measured) -> None:
    """Adds figures: lightwelld was not restarted, and has no more open file descriptors than `before`."""
    # The server keeps a broken connection until its keepalive (10 s, then 5 s) has expired; a leaked descriptor stays.
    samples: list[dict[str, int]] = []

    def released() -> bool:
        samples.append(rig.daemon())
        return samples[-1]["handles"] <= before["handles"]

    try:
        wait_for("lightwelld to close its file descriptors", released, 20, every_s=1)
    except TimedOut:
        pass  # The figure below fails.
    after = samples[-1]
    measured.figure("restarts of lightwelld", after["restarts"] - before["restarts"], "", "== 0")
    measured.figure("lightwelld's process is the same", str(after["pid"] == before["pid"]), "", "== True")
    measured.figure("handles more than before", after["handles"] - before["handles"], "", "<= 0")


def camera_unplugged(rig: Rig, test: Any, measured: Measured) -> None:
    """The camera is unplugged and plugged in again, three times. The second time lightwelld does not run meanwhile: it
    still holds the old device node when the camera is back, so the kernel makes a node with another number."""
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        times, nodes = [], []
        for suspended in (False, True, False):
            if suspended:
                rig.board.run("systemctl kill --signal=STOP lightwelld", check=True)
            camera.command("unplug")
            rig.wait_for_no_video()
            camera.command("plug")
            nodes.append(rig.wait_for_video())
            if suspended:
                rig.board.run("systemctl kill --signal=CONT lightwelld", check=True)
            times.append(watcher.back_after("light after the camera was put in again", 60))
        measured.time("light again after the kernel has its device, largest of three", max(times), "s", "<= 6")
        measured.figure("device nodes that the camera had", len(set(nodes)), "", ">= 2")
        check_daemon_survived(rig, before, measured)


def camera_silent(rig: Rig, test: Any, measured: Measured) -> None:
    """The camera accepts transfers and sends nothing for ten seconds."""
    silence_s = 10
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        begun = time.monotonic()
        camera.command("silence", seconds=silence_s)
        watcher.wait_until_silent()
        time.sleep(max(0.0, begun + silence_s - time.monotonic()))
        measured.time("light again after ten seconds of silence", watcher.back_after("light after the silence", 60),
                      "s", "<= 6")
        withheld = camera.counters()["counters"]["silent"]
        measured.figure("frames that the camera withheld", withheld, "", f">= {silence_s}")
        check_daemon_survived(rig, before, measured)


def camera_stalled(rig: Rig, test: Any, measured: Measured) -> None:
    """The camera's endpoint stalls in the middle of a frame until the host clears the halt."""
    with streaming(rig, test) as (camera, uri, watcher):
        before, streams = rig.daemon(), camera.counters()["counters"]["streams"]
        begun = time.monotonic()
        camera.command("stall")
        # Clearing the halt begins a new stream. Waiting for it excludes light of frames from before the stall.
        wait_for("the host to clear the endpoint", lambda: camera.counters()["counters"]["streams"] > streams, 90)
        watcher.back_after("light after the stall", 90)
        measured.time("light again after the endpoint stalled", time.monotonic() - begun, "s", "<= 15")
        measured.figure("streams begun anew", camera.counters()["counters"]["streams"] - streams, "", ">= 1")
        check_daemon_survived(rig, before, measured)


def _damage(camera: UsbCamera, fault: str, outcome: str, frames: int) -> None:
    """Makes the camera damage `frames` frames, or one more, and waits until its counter `outcome` shows them. The
    command is repeated, because a frame that is dropped since the previous one is still being sent does not count."""
    sent: Callable[[], int] = lambda: camera.counters()["counters"][outcome]
    end = sent() + frames

    def enough() -> bool:
        if (left := end - sent()) > 0:
            camera.command(fault, frames=left)
        return left <= 0

    wait_for(f"{frames} frames {outcome}", enough, 60, every_s=1, state=lambda: f"{end - sent()} left")


def frames_damaged(rig: Rig, test: Any, measured: Measured) -> None:
    """Frames without their middle, without their end, and with the error bit: none is estimated, each is counted."""
    # Twice for each kind. More in a row could take two seconds on a busy machine, after which the firmware restarts the
    # camera.
    in_a_row = 10
    with streaming(rig, test) as (camera, uri, watcher):
        before, streams = rig.daemon(), camera.counters()["counters"]["streams"]
        begun = rig.at_rest(camera, uri, watcher)
        for fault, outcome in 2 * (("tear", "torn"), ("shorten", "shortened"), ("mark", "marked")):
            _damage(camera, fault, outcome, in_a_row)
            # Complete frames must follow: the sequence number of the next frame reveals a lost one.
            watcher.back_after("light after damaged frames", 30)
        ended = rig.at_rest(camera, uri, watcher)
        grown = {name: ended[name] - begun[name] for name in ended}
        measured.figure("damaged frames that were sent", grown["damaged"], "", f">= {6 * in_a_row}")
        measured.figure("frames counted as lost meanwhile", grown["frames_lost"], "", f">= {grown['damaged']:.0f}")
        measured.figure("frames that were neither whole nor counted",
                        abs(grown["sent"] - grown["frames"] - grown["frames_lost"]), "", MAX_UNCOUNTED)
        unknown_to_client(grown, measured)
        measured.figure("streams begun anew", camera.counters()["counters"]["streams"] - streams, "", "== 0")
        check_daemon_survived(rig, before, measured)


def network_down(rig: Rig, test: Any, measured: Measured) -> None:
    """The link of the board's network card goes down; it comes up again three seconds after the client has no more
    light."""
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.qmp("set_link", name="net0", up=False)
        watcher.wait_until_silent()
        time.sleep(3)
        rig.board.qmp("set_link", name="net0", up=True)
        measured.time("light again after the network is back",
                      watcher.back_after("light after the network came back", 60), "s", "<= 8")
        check_daemon_survived(rig, before, measured)


def clock_set_back(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's wall clock jumps back by an hour, and later forward again."""
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.run("date -s @$(( $(date +%s) - 3600 ))", check=True)
        lines = watcher.next_seconds(8)
        rig.board.run("date -s @$(( $(date +%s) + 3600 ))", check=True)
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        measured.time("age of descriptors at their arrival, p99, largest second",
                        max(line["age_p99_ms"] or 0 for line in lines), "ms", "<= 2000")
        measured.figure("descriptors refused", lines[-1]["rejected"] - lines[0]["rejected"], "", "== 0")
        check_daemon_survived(rig, before, measured)


def daemon_killed(rig: Rig, test: Any, measured: Measured) -> None:
    """lightwelld is killed by SIGKILL, twice: systemd restarts it, and the client reconnects by itself."""
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        times = []
        for _ in range(2):
            rig.board.run("systemctl kill --signal=KILL lightwelld", check=True)
            times.append(watcher.back_after("light after lightwelld was killed", 90))
        after = rig.daemon()
        measured.time("light again after lightwelld was killed, larger of two", max(times), "s", "<= 20")
        measured.figure("restarts by systemd", after["restarts"] - before["restarts"], "", "== 2")
        measured.figure("reconnects of the client", watcher.seconds()[-1]["reconnects"], "", ">= 2")


@contextmanager
def free_disk_afterwards(rig: Rig) -> Iterator[None]:
    """On exit stops lightwelld, which would go on recording, and frees the disk for the next test."""
    try:
        yield
    finally:
        rig.board.run("systemctl stop lightwelld; rm -f /var/lib/lightwell/ballast /var/lib/lightwell/full.lwr",
                      timeout_s=60)


def disk_full(rig: Rig, test: Any, measured: Measured) -> None:
    """A recording fills its disk: the recording ends, the estimates continue."""
    with (free_disk_afterwards(rig),
          streaming(rig, test, more='record { path: "/var/lib/lightwell/full.lwr" }\n') as (camera, uri, watcher)):
        before = rig.daemon()
        rig.board.run("fallocate -l $(( $(stat -f -c '%a * %S' /var/lib/lightwell) - 2000000 )) "
                      "/var/lib/lightwell/ballast || true")
        info = wait_for("the recording to be given up",
                        lambda: i if (i := rig.info(uri))["recording_faults"] else None, 120, every_s=1)
        lines = watcher.next_seconds(5)
        measured.figure("frames recorded before", info["frames_recorded"])
        measured.figure("faults of the recording, counted", info["recording_faults"], "", ">= 1")
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        check_daemon_survived(rig, before, measured)


def memory_exhausted(rig: Rig, test: Any, measured: Measured) -> None:
    """Another program exhausts the memory: the kernel kills it, and lightwelld survives or is restarted."""
    with streaming(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        # tail buffers a line until it ends, and this line never ends.
        rig.board.run("systemd-run --wait --collect --quiet -p OOMScoreAdjust=1000 tail /dev/zero", timeout_s=240)
        ended = rig.board.run("dmesg | grep -c 'Killed process.*(tail)'; true", timeout_s=120).out.strip()
        measured.figure("gluttons that the kernel ended", float(ended or 0), "", "== 1")
        measured.time("light again", watcher.back_after("light after memory was exhausted", 120), "s", "<= 30")
        measured.figure("restarts of lightwelld", rig.daemon()["restarts"] - before["restarts"], "", "<= 1")
