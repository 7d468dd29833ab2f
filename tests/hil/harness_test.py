#!/usr/bin/env python3
"""Tests of the harness with fake boards and fake tests."""

import struct
import tempfile
import threading
import time
import unittest
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from unittest import mock

import harness_path  # noqa: F401
from hil.harness import recording, report, rig, roster, runner, waits
from hil.harness.recording import message_class
from hil.harness.runs import BoardError
from hil.harness.ssh import CommandFailed
from hil.harness.vivid import VividLoop

SMALL = """
board { name: "box" qemu { cpus: 2 } }
camera { name: "eye" uri: "v4l2:/dev/video0" }
link { name: "wire" }
test { name: "a.b" description: "x" board: "box" camera: "eye" link: "wire" limit_s: 3 }
"""


class Locks(unittest.TestCase):
    def test_a_lock_is_exclusive_and_names_its_holder(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            where = Path(folder)
            with waits.held(where / "box", "the box", 1):
                with self.assertRaisesRegex(waits.TimedOut, "for the box .*last seen: process [0-9]+ since .* has it"):
                    with waits.held(where / "box", "the box", 0.05):
                        self.fail("two hold it")
                with waits.held(where / "other", "the other", 0.05):
                    pass
            with waits.held(where / "box", "the box", 0.05):
                pass

    def test_a_waiting_thread_gets_the_lock(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            got = threading.Event()

            def second() -> None:
                with waits.held(Path(folder) / "box", "the box", 10):
                    got.set()

            with waits.held(Path(folder) / "box", "the box", 1):
                thread = threading.Thread(target=second)
                thread.start()
                time.sleep(0.05)
                self.assertFalse(got.is_set())
            thread.join()
            self.assertTrue(got.is_set())


class TheRoster(unittest.TestCase):
    def refusal(self, text: str) -> str:
        with self.assertRaises(roster.RosterError) as caught:
            roster.parse(text, "r.textproto")
        return str(caught.exception)

    def test_the_roster_is_valid(self) -> None:
        ours = roster.load()
        for test in ours.test:
            self.assertTrue(callable(runner.case_of(test)), test.name)
        self.assertTrue(any(test.short for test in ours.test))

    def test_errors_name_the_entry(self) -> None:
        roster.parse(SMALL, "r")
        self.assertIn("r.textproto:2:", self.refusal(SMALL.replace("cpus", "cups")))
        self.assertIn("camera 'nose'; there are eye", self.refusal(SMALL.replace('camera: "eye"', 'camera: "nose"')))
        self.assertIn("board ''", self.refusal(SMALL.replace('board: "box"', "")))
        self.assertIn("no limit_s", self.refusal(SMALL.replace("limit_s: 3", "")))
        self.assertIn("FILE.FUNCTION", self.refusal(SMALL.replace("a.b", "ab")))
        self.assertIn("a name of its own", self.refusal(SMALL + 'board { name: "box" qemu {} }'))
        self.assertIn("of no kind", self.refusal(SMALL.replace("qemu { cpus: 2 }", "")))
        self.assertIn("no test", self.refusal('board { name: "box" qemu {} }'))
        self.assertIn("nothing renders 'GREY' for vivid; there are bayer10",
                      self.refusal(SMALL.replace('uri: "v4l2:/dev/video0"', 'vivid { format: "GREY" }')))

    def test_a_peer_is_a_second_board_on_the_same_wire(self) -> None:
        two = (
            SMALL.replace("cpus: 2", 'net: "tap"')
            .replace("limit_s: 3", 'limit_s: 3 peer: "head" needs_fresh_board_after: true')
            + 'board { name: "head" qemu { net: "tap" } }'
        )
        self.assertEqual(roster.parse(two, "r").test[0].peer, "head")
        self.assertIn("peer 'hat'; there are box, head", self.refusal(two.replace('peer: "head"', 'peer: "hat"')))
        self.assertIn("another board than box", self.refusal(two.replace('peer: "head"', 'peer: "box"')))
        self.assertIn("box is on no wire", self.refusal(two.replace('net: "tap"', 'net: "user"', 1)))
        self.assertIn("head is on no wire", self.refusal(two.replace('"head" qemu { net: "tap" }', '"head" qemu {}')))
        self.assertIn("set needs_fresh_board_after", self.refusal(two.replace("needs_fresh_board_after: true", "")))


class Order(unittest.TestCase):
    tests = [SimpleNamespace(name=f"t.{i}", board="ab"[i % 2], needs_fresh_board_after=i < 4) for i in range(20)]

    def names(self, seed: int) -> list[str]:
        return [test.name for test in runner.shuffled(self.tests, seed)]

    def test_depends_only_on_the_seed(self) -> None:
        self.assertEqual(self.names(5), self.names(5))
        self.assertGreater(len({tuple(self.names(seed)) for seed in range(10)}), 8)
        self.assertEqual(sorted(self.names(5)), sorted(test.name for test in self.tests))

    def test_keeps_boards_together_and_spoiling_tests_last(self) -> None:
        for seed in range(10):
            boards = [test.board for test in runner.shuffled(self.tests, seed)]
            self.assertEqual(sum(1 for a, b in zip(boards, boards[1:]) if a != b), 1)
            for board in "ab":
                spoiling = [t.needs_fresh_board_after for t in runner.shuffled(self.tests, seed) if t.board == board]
                self.assertEqual(spoiling, sorted(spoiling))


class Reports(unittest.TestCase):
    def test_a_figure_holds_within_its_limit(self) -> None:
        for asked, measured, holds in [
            ("<= 3", 3, True),
            ("<= 3", 3.1, False),
            (">= 30", 29.9, False),
            ("== 0", 0, True),
            ("== 0", 1, False),
            ("", 1e9, True),
            ("<= 3", float("nan"), False),
            (">= 3", float("nan"), False),
            ("== same", "same", True),
            ("== same", "other", False),
        ]:
            self.assertEqual(report.Figure("f", measured, "", asked).holds, holds, (asked, measured))
        with self.assertRaises(KeyError):
            _ = report.Figure("f", 1, "", "about 3").holds

    def test_a_good_result_is_complete_and_all_its_figures_hold(self) -> None:
        good = [report.Figure("f", 1)]
        self.assertTrue(report.Result("t", "c", 1, good).good)
        self.assertFalse(report.Result("t", "c", 1, []).good)
        self.assertFalse(report.Result("t", "c", 1, good, error="x").good)
        self.assertFalse(report.Result("t", "c", 1, good, skipped="no QEMU").good)
        self.assertFalse(report.Result("t", "c", 1, [*good, report.Figure("f", 4, "", "<= 3")]).good)

    def test_limits_of_times_may_be_ignored(self) -> None:
        late = [report.Figure("f", 1, "", "<= 2"), report.Figure("t", 9, "s", "<= 3", timed=True)]
        self.assertFalse(report.Result("t", "c", 1, late).good)
        self.assertTrue(report.Result("t", "c", 1, late, check_times=False).good)
        wrong = [report.Figure("f", 3, "", "<= 2")]
        self.assertFalse(report.Result("t", "c", 1, wrong, check_times=False).good)

    def test_an_entry_without_a_run_of_this_commit_is_stale(self) -> None:
        tests = [SimpleNamespace(name=name) for name in ("never", "old", "bad", "skipped", "good")]
        good = [report.Figure("f", 1)]
        results = {"old": report.Result("old", "before", 1, good), "bad": report.Result("bad", "now", 1, good, "broke"),
                   "skipped": report.Result("skipped", "now", 1, [], skipped="no QEMU"),
                   "good": report.Result("good", "now", 1, good)}
        stale = report.stale(tests, results, "now")
        self.assertEqual([line.split(":")[0] for line in stale], ["never", "old", "bad", "skipped"])

    def test_is_saved_loaded_and_written_as_markdown(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "deep" / "hil.json"
            self.assertEqual(report.load(path), {})
            results = {"a.b": report.Result("a.b", "c", 2, [report.Figure("rate", 29, "frames/s", ">= 30")])}
            report.save(results, path)
            self.assertEqual(report.load(path), results)
            self.assertEqual(list(path.parent.iterdir()), [path])
        text = report.markdown(roster.parse(SMALL, "r"), results, {"seed": "5"})
        self.assertIn("## a.b: FAILED", text)
        self.assertIn("| rate | >= 30 | 29 frames/s | **no** |", text)
        self.assertIn("## a.b: not run", report.markdown(roster.parse(SMALL, "r"), {}, {}))


class Runs(unittest.TestCase):
    """Fake tests are functions; fake boards are consecutive numbers."""

    def setUp(self) -> None:
        self.started: list[int] = []
        self.ended: list[int] = []
        self.peers: list[Any] = []
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def start(self, _: Any, peer: Any, stack: ExitStack) -> int:
        self.peers.append(peer)
        number = len(self.started)
        self.started.append(number)
        stack.callback(lambda: self.ended.append(number))
        return number

    def run_them(self, **cases: Any) -> dict[str, report.Result]:
        tests = [SimpleNamespace(name=name, description="", board="box", limit_s=1,
                                 needs_fresh_board_after=name.startswith("spoils"),
                                 peer="another" if name.startswith("spoils_two") else "") for name in cases]
        heard: list[report.Result] = []
        results = runner.run(
            tests,
            {"box": "the box", "another": "the other"},
            self.start,
            seed=1,
            commit="c",
            lock_limit_s=1,
            finished=heard.append,
            case=lambda test: cases[test.name],
            lock_folder=Path(self.folder.name),
        )
        self.assertEqual(results, heard)
        self.assertEqual(self.started, self.ended, "every board that was started was ended")
        return {result.test: result for result in results}

    @staticmethod
    def well(_: Any, __: Any, measured: runner.Measured) -> None:
        measured.figure("f", 1, "", "<= 2")

    def test_good_tests_share_a_board(self) -> None:
        results = self.run_them(a=self.well, b=self.well, c=self.well)
        self.assertTrue(all(result.good for result in results.values()))
        self.assertEqual(len(self.started), 1)

    def test_errors_are_reported_and_the_next_test_gets_a_new_board(self) -> None:
        def breaks(*_: Any) -> None:
            raise runner.TestFailure("the light is wrong")

        def stumbles(*_: Any) -> None:
            raise KeyError("typing mistake")

        def hangs(*_: Any) -> None:
            time.sleep(60)

        def cannot(*_: Any) -> None:
            raise runner.CannotRun("there is no camera")

        def idle(*_: Any) -> None:
            pass

        results = self.run_them(breaks=breaks, stumbles=stumbles, hangs=hangs, cannot=cannot, idle=idle, well=self.well)
        self.assertEqual(results["breaks"].error, "the light is wrong")
        self.assertIn("typing mistake", results["stumbles"].error)
        self.assertIn("took longer than its 1 s", results["hangs"].error)
        self.assertEqual(results["cannot"].skipped, "there is no camera")
        self.assertEqual(results["idle"].error, "it measured nothing")
        self.assertEqual([name for name, result in results.items() if result.good], ["well"])
        self.assertGreaterEqual(len(self.started), 3)

    def test_a_spoiled_board_is_not_used_again(self) -> None:
        boards: list[int] = []

        def looks(board: int, _: Any, measured: runner.Measured) -> None:
            boards.append(board)
            measured.figure("f", 1)

        self.run_them(spoils_a=looks, spoils_b=looks, c=looks)
        # Spoiling tests come last, and the test after one gets another board.
        self.assertEqual(boards, [0, 0, 1])

    def test_a_peer_is_started_for_one_test_and_locked_meanwhile(self) -> None:
        def looks(_: int, __: Any, measured: runner.Measured) -> None:
            with self.assertRaises(waits.TimedOut):
                with waits.held(Path(self.folder.name) / "board-another.lock", "the other", 0.05):
                    self.fail("two hold it")
            measured.figure("f", 1)

        results = self.run_them(a=self.well, spoils_two=looks)
        self.assertTrue(all(result.good for result in results.values()), results)
        self.assertEqual(self.peers, [None, "the other"])
        with waits.held(Path(self.folder.name) / "board-another.lock", "the other", 0.05):
            pass

    def test_a_board_that_does_not_start_fails_its_tests(self) -> None:
        def broken_start(_: Any, __: Any, ___: ExitStack) -> None:
            raise waits.TimedOut("waited 90 s for the board to boot and it did not come")

        self.start = broken_start  # type: ignore[method-assign]
        results = self.run_them(a=self.well, b=self.well)
        self.assertTrue(all("to boot" in result.error for result in results.values()))


class Rigs(unittest.TestCase):
    """Fake boards record their calls in a list."""

    def setUp(self) -> None:
        self.notes = notes = []
        self.roster = roster.parse(SMALL + 'board { name: "head" qemu { memory_mb: 512 net: "tap" } }', "r")
        self.tools = rig.Tools(Path("."), Path("."), Path("."))

        class FakeBoard:
            def __init__(self, name: str, options: Any) -> None:
                self.name, self.folder, self.options = name, Path("/boards/" + name), options

            def start(self, *, fresh: bool) -> None:
                notes.append(f"{self.name} on {self.options.wire or 'its own wire'} as {self.options.number}")
                if self.options.memory_mb == 1:
                    raise BoardError("too small")

            def power_cut(self) -> None:
                notes.append(f"{self.name} off")

            def run(self, command: str, *, check: bool) -> None:
                notes.append(f"{self.name}: {command}")

        patch = mock.patch.object(rig, "Board", FakeBoard)
        patch.start()
        self.addCleanup(patch.stop)

    def test_a_board_alone_has_no_peer(self) -> None:
        with rig.open_rig(self.roster.board[0], self.roster, self.tools) as alone:
            self.assertIsNone(alone.peer)
        self.assertEqual(self.notes, ["hil-box on its own wire as 1", "hil-box off"])

    def test_a_recording_does_not_continue_that_of_another_test(self) -> None:
        with (
            tempfile.TemporaryDirectory() as folder,
            rig.open_rig(self.roster.board[0], self.roster, self.tools) as alone,
        ):
            file = Path(folder) / "board.lwr"
            there = []
            with mock.patch.object(alone, "client", lambda *_, **__: there.append(file.exists())), \
                    mock.patch.object(rig, "output_of", lambda *_: there.append(file.exists())):
                for record in (alone.record, alone.record_here):
                    file.write_bytes(b"of another test")
                    record("grpc://127.0.0.1:1", 1, file)
        self.assertEqual(there, [False, False])

    def test_a_peer_shares_the_wire_runs_no_firmware_and_ends_with_the_board(self) -> None:
        with rig.open_rig(self.roster.board[0], self.roster, self.tools, self.roster.board[1]) as both:
            self.assertEqual((both.board.name, both.peer.name), ("hil-box", "hil-head"))
        self.assertEqual(
            self.notes,
            [
                "hil-box on its own wire as 1",
                "hil-head on hil-box as 2",
                "hil-head: systemctl mask --runtime --now lightwelld",
                "hil-head off",
                "hil-box off",
            ],
        )

    def test_a_peer_that_does_not_start_leaves_nothing_running(self) -> None:
        self.roster.board[1].qemu.memory_mb = 1
        with self.assertRaises(BoardError):
            with rig.open_rig(self.roster.board[0], self.roster, self.tools, self.roster.board[1]):
                self.fail("it started")
        self.assertEqual(self.notes[-2:], ["hil-head off", "hil-box off"])


class Recordings(unittest.TestCase):
    """The container is written by hand from its description in proto/README.md."""

    def setUp(self) -> None:
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.path = Path(folder.name) / "frames.lwr"
        types = {name: message_class(recording.PROTO, "lightwell/v1/recording.proto", f"lightwell.v1.{name}")
                 for name in ("RecordingHeader", "FrameRecord")}
        header = types["RecordingHeader"](kind=2)
        header.calibration.nits_per_unit = 0.25
        self.records = [header.SerializeToString()]
        for sequence in (3, 4, 7, 9, 10):
            frame = types["FrameRecord"](sequence=sequence)
            frame.view.add(format="bayer10", width=2, height=1, data=bytes([sequence] * 4))
            self.records.append(frame.SerializeToString())
        self.write(b"LWREC\x01\r\n" + b"".join(struct.pack("<IIq", len(r), 77, 5) + r for r in self.records))

    def write(self, content: bytes) -> None:
        self.path.write_bytes(content)

    def test_frames_and_calibration_are_read(self) -> None:
        calibration, frames = recording.read(self.path)
        self.assertEqual(calibration.strip(), "nits_per_unit: 0.25")
        self.assertEqual([frame.sequence for frame in frames], [3, 4, 7, 9, 10])
        self.assertEqual(frames[2], recording.Frame(7, "bayer10", 2, 1, b"\7\7\7\7"))

    def test_a_truncated_recording_is_read_up_to_its_last_complete_record(self) -> None:
        whole = self.path.read_bytes()
        for less in (1, len(self.records[-1]), len(self.records[-1]) + 15):
            self.write(whole[:-less])
            self.assertEqual([frame.sequence for frame in recording.read(self.path)[1]], [3, 4, 7, 9], less)

    def test_errors_name_the_file(self) -> None:
        for content in (b"", b"RIFFxxxxx", b"LWREC\x01\r\n", b"LWREC\x01\r\n" + bytes(16)):
            self.write(content)
            with self.assertRaisesRegex(recording.RecordingError, "frames.lwr"):
                recording.read(self.path)

    def test_thinning_copies_frames_with_a_minimum_distance_unchanged(self) -> None:
        target = self.path.with_name("thin.lwr")
        self.assertEqual(recording.thin(self.path, target, apart=3, frames=9), 3)
        self.assertEqual([frame.sequence for frame in recording.read(target)[1]], [3, 7, 10])
        self.assertEqual(recording.read(target)[0], recording.read(self.path)[0])
        self.assertEqual(recording.thin(self.path, target, apart=1, frames=2), 2)
        # Byte for byte, including checksums and times.
        self.assertTrue(self.path.read_bytes().startswith(target.read_bytes()))


class Vivid(unittest.TestCase):
    """The fake board records its commands."""

    def setUp(self) -> None:
        self.commands: list[str] = []
        self.fails = "nothing"
        self.fed = b""
        self.camera = SimpleNamespace(format="bayer10", width=640, height=480)

    def board(self) -> Any:
        def run(command: Any, *, check: bool = False, timeout_s: float = 60) -> SimpleNamespace:
            text = command if isinstance(command, str) else " ".join(command)
            self.commands.append(text)
            if self.fails in text:
                if check:
                    raise CommandFailed(text)
                return SimpleNamespace(status=1, out="")
            said = (
                "/sys/class/video4linux/video" + ("4" if "vid-cap" in text else "5") + "/name\n"
                if text.startswith("grep")
                else (
                    "Frames per second: 58.750 (235000/4000)"
                    if "--get-parm" in text
                    else (
                        "".join(f"cap dqbuf: 0 seq: {n:6} bytesused\n" for n in (7, 8, 10, 11))
                        if "--stream-mmap" in text
                        else ""
                    )
                )
            )
            return SimpleNamespace(status=0, out=said)

        def copy_in(source: Path, _: str) -> None:
            self.fed = source.read_bytes()

        return SimpleNamespace(run=run, copy_in=copy_in)

    def test_is_loaded_fed_and_unloaded(self) -> None:
        with VividLoop(self.board(), self.camera, [b"one", b"two"]) as loop:
            self.assertEqual((loop.device, loop.rate, self.fed), ("/dev/video4", 58.75, b"onetwo"))
            # Sequence numbers 7, 8, 10, 11: of four frame periods, three delivered a frame.
            self.assertAlmostEqual(loop.tool_frame_rate(), 58.75 * 3 / 4)
        setup = next(text for text in self.commands if "--set-dv-bt-timings" in text)
        self.assertIn("--set-fmt-video=width=640,height=480,pixelformat=RG10", setup)
        self.assertIn("-d /dev/video5 --stream-out-mmap", setup)
        self.assertIn("modprobe -r vivid", self.commands[-1])

    def test_is_unloaded_after_an_error(self) -> None:
        self.fails = "--set-dv-bt-timings"
        with self.assertRaises(CommandFailed):
            with VividLoop(self.board(), self.camera, [b"one"]):
                self.fail("it started")
        self.assertIn("modprobe -r vivid", self.commands[-1])

    def test_a_driver_that_is_missing_or_cannot_be_unloaded_is_an_error(self) -> None:
        for self.fails, what in (("modprobe vivid", "has no vivid"), ("modprobe -r", "cannot be unloaded")):
            with self.assertRaisesRegex(runner.TestFailure, what):
                with VividLoop(self.board(), self.camera, [b"one"]):
                    pass


if __name__ == "__main__":
    unittest.main()
