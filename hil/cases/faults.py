"""What goes wrong around a probe: each is survived, counted, and over within a stated time."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from hil.cases.stream import ahead, calibrate, camera_text
from hil.harness.camera import UsbCamera
from hil.harness.rig import Rig, Watcher
from hil.harness.runner import Measured
from hil.harness.waits import wait_for


@contextmanager
def running(rig: Rig, test: Any, *, more: str = "") -> Iterator[tuple[UsbCamera, str, Watcher]]:
    """A camera that streams, lightwelld with it, and a client that watches."""
    camera = rig.described(test.camera).usb_simulated
    with rig.usb_camera(test.camera, arguments=ahead(camera)) as outside:
        uri = rig.configure(camera_text(rig, camera, rig.wait_for_video()), more=calibrate(rig, camera) + more)
        with rig.watcher(uri) as watcher:
            watcher.wait_for("light before the fault", 60, since=0)
            yield outside, uri, watcher


def back_after(watcher: Watcher, what: str, limit_s: float) -> float:
    """Seconds until the client has news again. It tells them once a second: a second more than it was, at most."""
    begun, since = time.monotonic(), len(watcher.seconds())
    # The second that is under way when the fault ends may hold frames of before it.
    watcher.wait_for(what, limit_s, since=since + 1)
    return time.monotonic() - begun


def dark(watcher: Watcher, limit_s: float = 60) -> None:
    """Until a whole second brought the client nothing."""
    since = len(watcher.seconds())
    wait_for("the light to stop", lambda: any(line["frames"] == 0 for line in watcher.seconds()[since + 1:]), limit_s)


def the_same_daemon(rig: Rig, before: dict[str, int], measured: Measured) -> None:
    after = rig.daemon()
    measured.figure("restarts of lightwelld", after["restarts"] - before["restarts"], "", "== 0")
    measured.figure("lightwelld's process is the same", str(after["pid"] == before["pid"]), "", "== True")
    measured.figure("handles more than before", after["handles"] - before["handles"], "", "<= 0")


def camera_unplugged(rig: Rig, test: Any, measured: Measured) -> None:
    """Pulled out and put in again, five times."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        times = []
        for _ in range(5):
            camera.command("unplug")
            rig.wait_for_no_video()
            camera.command("plug")
            rig.wait_for_video()
            times.append(back_after(watcher, "light after the camera was put in again", 60))
        measured.time("light again after the kernel has its device, largest of five", max(times), "s", "<= 6")
        the_same_daemon(rig, before, measured)
        if "came back" not in rig.journal(60) and "is back" not in rig.journal(60):
            measured.figure("the log's last word", rig.journal(1).strip())


def camera_silent(rig: Rig, test: Any, measured: Measured) -> None:
    """It takes transfers and sends nothing for ten seconds."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        camera.command("silence", seconds=10)
        dark(watcher)
        silent = wait_for("its silence to end", lambda: camera.counters()["counters"]["silent"] or None, 30)
        time.sleep(8)
        measured.time("light again after ten seconds of silence", back_after(watcher, "light after the silence", 60), "s", "<= 6")
        measured.figure("frames that the camera withheld", silent)
        the_same_daemon(rig, before, measured)


def camera_stalled(rig: Rig, test: Any, measured: Measured) -> None:
    """Its endpoint stalls in the middle of a frame, and stays so until somebody clears it."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        camera.command("stall")
        measured.time("light again after the endpoint stalled", back_after(watcher, "light after the stall", 90), "s", "<= 15")
        the_same_daemon(rig, before, measured)


def frames_damaged(rig: Rig, test: Any, measured: Measured) -> None:
    """Frames without their middle, without their end, and marked as bad: none becomes light, each is counted."""
    with running(rig, test) as (camera, uri, watcher):
        before, begun = rig.daemon(), rig.snapshot(camera, uri)
        for fault in ("tear", "shorten", "mark"):
            camera.command(fault, frames=20)
        counts: Callable[[], dict[str, int]] = lambda: camera.counters()["counters"]
        wait_for("sixty damaged frames", lambda: sum(counts()[name] for name in ("torn", "shortened", "marked")) >= 60, 120,
                 state=lambda: str({name: counts()[name] for name in ("sent", "torn", "shortened", "marked", "replaced", "busy")}))
        time.sleep(3)
        ended = rig.snapshot(camera, uri)
        lost = ended["frames_lost"] - begun["frames_lost"]
        measured.figure("damaged frames that were sent", 60)
        measured.figure("frames counted as lost meanwhile", lost, "", ">= 60")
        sent, came = ended["sent"] - begun["sent"], ended["frames"] - begun["frames"]
        measured.figure("frames neither whole nor counted (looks up to 0.6 s apart)", abs(sent - came - lost), "", "<= 36")
        measured.time("light again", back_after(watcher, "light after damaged frames", 30), "s", "<= 4")
        the_same_daemon(rig, before, measured)


def network_down(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's network card has no link for five seconds."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.qmp("set_link", name="net0", up=False)
        dark(watcher)
        time.sleep(3)
        rig.board.qmp("set_link", name="net0", up=True)
        measured.time("light again after the network is back", back_after(watcher, "light after the network came back", 60), "s",
                        "<= 8")
        the_same_daemon(rig, before, measured)


def clock_set_back(rig: Rig, test: Any, measured: Measured) -> None:
    """The board's calendar clock is an hour wrong from one moment to the next."""
    with running(rig, test) as (camera, uri, watcher):
        before, since = rig.daemon(), len(watcher.seconds())
        rig.board.run("date -s @$(( $(date +%s) - 3600 ))", check=True)
        lines = wait_for("eight seconds more", lambda: watcher.seconds()[since:] if len(watcher.seconds()) >= since + 8 else None, 60)
        rig.board.run("date -s @$(( $(date +%s) + 3600 ))", check=True)
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        measured.time("age of descriptors at their arrival, p99, largest second",
                        max(line["age_p99_ms"] or 0 for line in lines), "ms", "<= 2000")
        measured.figure("descriptors refused", lines[-1]["rejected"] - lines[0]["rejected"], "", "== 0")
        the_same_daemon(rig, before, measured)


def daemon_killed(rig: Rig, test: Any, measured: Measured) -> None:
    """SIGKILL, three times: systemd starts it anew, and the client goes on by itself."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        times = []
        for _ in range(3):
            rig.board.run("systemctl kill --signal=KILL lightwelld", check=True)
            times.append(back_after(watcher, "light after lightwelld was killed", 90))
        after = rig.daemon()
        measured.time("light again after lightwelld was killed, largest of three", max(times), "s", "<= 20")
        measured.figure("restarts by systemd", after["restarts"] - before["restarts"], "", "== 3")
        measured.figure("reconnects of the client", watcher.seconds()[-1]["reconnects"], "", ">= 3")


def disk_full(rig: Rig, test: Any, measured: Measured) -> None:
    """A recording fills its disk: the recording ends, the light does not."""
    with running(rig, test, more='record { path: "/var/lib/lightwell/full.lwr" }\n') as (camera, uri, watcher):
        before = rig.daemon()
        rig.board.run("fallocate -l $(( $(stat -f -c '%a * %S' /var/lib/lightwell) - 2000000 )) /var/lib/lightwell/ballast || true")
        info = wait_for("the recording to be given up",
                        lambda: i if (i := rig.info(uri))["recording_faults"] else None, 120, every_s=1)
        since = len(watcher.seconds())
        lines = wait_for("five seconds more", lambda: watcher.seconds()[since:] if len(watcher.seconds()) >= since + 5 else None, 60)
        measured.figure("frames recorded before", info["frames_recorded"])
        measured.figure("faults of the recording, counted", info["recording_faults"], "", ">= 1")
        measured.figure("seconds without light", sum(1 for line in lines if line["frames"] == 0), "", "== 0")
        the_same_daemon(rig, before, measured)
        rig.board.run("rm -f /var/lib/lightwell/ballast /var/lib/lightwell/full.lwr")


def memory_exhausted(rig: Rig, test: Any, measured: Measured) -> None:
    """Another program takes all memory: the kernel ends it, and the probe lives or comes back."""
    with running(rig, test) as (camera, uri, watcher):
        before = rig.daemon()
        # tail keeps a line until it ends, and this one does not.
        rig.board.run("systemd-run --wait --collect --quiet -p OOMScoreAdjust=1000 tail /dev/zero", timeout_s=240)
        ended = rig.board.run("dmesg | grep -c 'Killed process.*(tail)'; true", timeout_s=120).out.strip()
        measured.figure("gluttons that the kernel ended", float(ended or 0), "", "== 1")
        measured.time("light again", back_after(watcher, "light after memory was exhausted", 120), "s", "<= 30")
        measured.figure("restarts of lightwelld", rig.daemon()["restarts"] - before["restarts"], "", "<= 1")
