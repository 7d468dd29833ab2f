"""What goes wrong around a probe: each is survived, counted, and over within a stated time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hil.cases.stream import UNTOLD, ahead, calibrate, camera_text, unknown_to_client
from hil.harness.camera import UsbCamera
from hil.harness.rig import Rig
from hil.harness.runner import Measured
from hil.harness.waits import TimedOut, wait_for
from hil.harness.watcher import Watcher


@contextmanager
def running(rig: Rig, test: Any, *, more: str = "") -> Iterator[tuple[UsbCamera, str, Watcher]]:
    """A camera that streams, lightwelld with it, and a client that watches."""
    camera = rig.described(test.camera).usb_simulated
    with rig.usb_camera(test.camera, arguments=ahead(camera)) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera) + more)
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light before the fault", 60, since=0)
            yield outside, uri, watcher


def the_same_daemon(rig: Rig, before: dict[str, int], measured: Measured) -> None:
    # A connection that broke is held until its server notices, by its keepalive of 10 and 5 s; what leaks stays.
    looks: list[dict[str, int]] = []

    def given_back() -> bool:
        looks.append(rig.daemon())
        return looks[-1]["handles"] <= before["handles"]

    try:
        wait_for("handles to be given back", given_back, 20, every_s=1)
    except TimedOut:
        pass  # The figure says so.
    after = looks[-1]
    measured.figure("restarts of lightwelld", after["restarts"] - before["restarts"], "", "== 0")
    measured.figure("lightwelld's process is the same", str(after["pid"] == before["pid"]), "", "== True")
    measured.figure("handles more than before", after["handles"] - before["handles"], "", "<= 0")


def camera_unplugged(rig: Rig, test: Any, measured: Measured) -> None:
    """Pulled out and put in again, three times."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        times = []
        for _ in range(3):
            camera.command("unplug")
            rig.wait_for_no_video()
            camera.command("plug")
            rig.wait_for_video()
            times.append(watcher.back_after("light after the camera was put in again", 60))
        measured.time("light again after the kernel has its device, largest of three", max(times), "s", "<= 6")
        the_same_daemon(rig, before, measured)


def camera_silent(rig: Rig, test: Any, measured: Measured) -> None:
    """It takes transfers and sends nothing for ten seconds."""
    silence_s = 10
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        begun = time.monotonic()
        camera.command("silence", seconds=silence_s)
        watcher.dark()
        time.sleep(max(0.0, begun + silence_s - time.monotonic()))
        measured.time(
            "light again after ten seconds of silence", watcher.back_after("light after the silence", 60), "s", "<= 6"
        )
        withheld = camera.counters()["counters"]["silent"]
        measured.figure("frames that the camera withheld", withheld, "", f">= {silence_s}")
        the_same_daemon(rig, before, measured)


def camera_stalled(rig: Rig, test: Any, measured: Measured) -> None:
    """Its endpoint stalls in the middle of a frame, and stays so until somebody clears it."""
    with running(rig, test) as (camera, uri, watcher):
        before, streams = rig.daemon(), camera.counters()["counters"]["streams"]
        begun = time.monotonic()
        camera.command("stall")
        # Clearing the endpoint begins a new stream: without one the light that follows would be of before.
        wait_for("somebody to clear the endpoint", lambda: camera.counters()["counters"]["streams"] > streams, 90)
        watcher.back_after("light after the stall", 90)
        measured.time("light again after the endpoint stalled", time.monotonic() - begun, "s", "<= 15")
        measured.figure("streams begun anew", camera.counters()["counters"]["streams"] - streams, "", ">= 1")
        the_same_daemon(rig, before, measured)


def _damage(camera: UsbCamera, fault: str, outcome: str, frames: int) -> None:
    """So many, or one more. A frame that was to be damaged and found the one before still on its way counts as
    neither."""
    sent: Callable[[], int] = lambda: camera.counters()["counters"][outcome]
    end = sent() + frames

    def enough() -> bool:
        if (left := end - sent()) > 0:
            camera.command(fault, frames=left)
        return left <= 0

    wait_for(f"{frames} frames {outcome}", enough, 60, every_s=1, state=lambda: f"{end - sent()} left")


def frames_damaged(rig: Rig, test: Any, measured: Measured) -> None:
    """Frames without their middle, without their end, and marked as bad: none becomes light, each is counted."""
    # Of each kind, twice. More in a row would take two seconds on a busy machine, after which the firmware starts the
    # camera anew.
    in_a_row = 10
    with running(rig, test) as (camera, uri, watcher):
        before, streams = rig.daemon(), camera.counters()["counters"]["streams"]
        begun = rig.at_rest(camera, uri, watcher)
        for fault, outcome in 2 * (("tear", "torn"), ("shorten", "shortened"), ("mark", "marked")):
            _damage(camera, fault, outcome, in_a_row)
            # Whole ones behind them: a lost frame is known by the number of the next.
            watcher.back_after("light after damaged frames", 30)
        ended = rig.at_rest(camera, uri, watcher)
        grown = {name: ended[name] - begun[name] for name in ended}
        measured.figure("damaged frames that were sent", grown["damaged"], "", f">= {6 * in_a_row}")
        measured.figure("frames counted as lost meanwhile", grown["frames_lost"], "", f">= {grown['damaged']:.0f}")
        measured.figure(
            "frames that were neither whole nor counted",
            abs(grown["sent"] - grown["frames"] - grown["frames_lost"]),
            "",
            UNTOLD,
        )
        unknown_to_client(grown, measured)
        measured.figure("streams begun anew", camera.counters()["counters"]["streams"] - streams, "", "== 0")
        the_same_daemon(rig, before, measured)


def network_down(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's network card has no link for five seconds."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.qmp("set_link", name="net0", up=False)
        watcher.dark()
        time.sleep(3)
        rig.board.qmp("set_link", name="net0", up=True)
        measured.time(
            "light again after the network is back",
            watcher.back_after("light after the network came back", 60),
            "s",
            "<= 8",
        )
        the_same_daemon(rig, before, measured)


def clock_set_back(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's calendar clock is an hour wrong from one moment to the next."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.run("date -s @$(( $(date +%s) - 3600 ))", check=True)
        lines = watcher.next_seconds(8)
        rig.board.run("date -s @$(( $(date +%s) + 3600 ))", check=True)
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        measured.time("age of descriptors at their arrival, p99, largest second",
                        max(line["age_p99_ms"] or 0 for line in lines), "ms", "<= 2000")
        measured.figure("descriptors refused", lines[-1]["rejected"] - lines[0]["rejected"], "", "== 0")
        the_same_daemon(rig, before, measured)


def daemon_killed(rig: Rig, test: Any, measured: Measured) -> None:
    """SIGKILL, twice: systemd starts it anew, and the client goes on by itself."""
    with running(rig, test) as (camera, uri, watcher):
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
def room_again(rig: Rig) -> Iterator[None]:
    """The next test finds a disk with room: lightwelld, which would go on recording into it, ends first."""
    try:
        yield
    finally:
        rig.board.run(
            "systemctl stop lightwelld; rm -f /var/lib/lightwell/ballast /var/lib/lightwell/full.lwr", timeout_s=60
        )


def disk_full(rig: Rig, test: Any, measured: Measured) -> None:
    """A recording fills its disk: the recording ends, the light does not."""
    with (
        room_again(rig),
        running(rig, test, more='record { path: "/var/lib/lightwell/full.lwr" }\n') as (camera, uri, watcher),
    ):
        before = rig.daemon()
        rig.board.run(
            "fallocate -l $(( $(stat -f -c '%a * %S' /var/lib/lightwell) - 2000000 )) /var/lib/lightwell/ballast || "
            "true"
        )
        info = wait_for("the recording to be given up",
                        lambda: i if (i := rig.info(uri))["recording_faults"] else None, 120, every_s=1)
        lines = watcher.next_seconds(5)
        measured.figure("frames recorded before", info["frames_recorded"])
        measured.figure("faults of the recording, counted", info["recording_faults"], "", ">= 1")
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        the_same_daemon(rig, before, measured)


def memory_exhausted(rig: Rig, test: Any, measured: Measured) -> None:
    """Another program takes all memory: the kernel ends it, and the probe lives or comes back."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        # tail keeps a line until it ends, and this one does not.
        rig.board.run("systemd-run --wait --collect --quiet -p OOMScoreAdjust=1000 tail /dev/zero", timeout_s=240)
        ended = rig.board.run("dmesg | grep -c 'Killed process.*(tail)'; true", timeout_s=120).out.strip()
        measured.figure("gluttons that the kernel ended", float(ended or 0), "", "== 1")
        measured.time("light again", watcher.back_after("light after memory was exhausted", 120), "s", "<= 30")
        measured.figure("restarts of lightwelld", rig.daemon()["restarts"] - before["restarts"], "", "<= 1")
