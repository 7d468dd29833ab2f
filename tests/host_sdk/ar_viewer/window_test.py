"""ar_viewer in a real window, on a virtual display: keys, screenshot, video, end.

Exit code 77, with the reason, where there is no Xvfb or no libXtst."""
import ctypes
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time
import unittest

PROGRAM = sys.argv.pop(1)
LIMIT_S = 60  # Generous: software rendering on a busy machine.


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


class Keyboard:
    """Presses keys on a display, through the extension XTEST."""

    def __init__(self, display):
        self.x11 = ctypes.CDLL("libX11.so.6")
        self.xtst = ctypes.CDLL("libXtst.so.6")
        self.x11.XOpenDisplay.restype = ctypes.c_void_p
        self.x11.XOpenDisplay.argtypes = [ctypes.c_char_p]
        self.x11.XStringToKeysym.restype = ctypes.c_ulong
        self.x11.XKeysymToKeycode.argtypes = [ctypes.c_void_p, ctypes.c_ulong]
        self.x11.XSync.argtypes = [ctypes.c_void_p, ctypes.c_int]
        self.xtst.XTestFakeKeyEvent.argtypes = [ctypes.c_void_p, ctypes.c_uint, ctypes.c_int, ctypes.c_ulong]
        self.display = self.x11.XOpenDisplay(display.encode())
        if not self.display:
            raise RuntimeError(f"the display {display} cannot be opened")

    def press(self, name):
        code = self.x11.XKeysymToKeycode(self.display, self.x11.XStringToKeysym(name.encode()))
        for down in (1, 0):
            self.xtst.XTestFakeKeyEvent(self.display, code, down, 0)
            self.x11.XSync(self.display, 0)


class WindowTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp(prefix="lightwell_"))
        self.addCleanup(shutil.rmtree, self.folder)
        # Xvfb chooses a free display and writes its number.
        read, write = os.pipe()
        self.server = subprocess.Popen(
            ["Xvfb", "-displayfd", str(write), "-screen", "0", "640x480x24"], pass_fds=[write],
            stderr=subprocess.DEVNULL)
        self.addCleanup(self.server.wait)
        self.addCleanup(self.server.terminate)
        os.close(write)
        with os.fdopen(read) as numbers:
            self.display = ":" + numbers.readline().strip()
        scene = self.folder / "scene.json"
        scene.write_text(
            '{"camera": {"width": 128, "height": 96, "fx": 100, "fy": 100, "cx": 63.5, "cy": 47.5},'
            ' "T_world_camera": {"position": [0, 0.05, 0.4]}, "objects": [{"material": "matte"}],'
            ' "light": {"constant": [1, 0, 0]}, "sources": {"other": {"constant": [0, 1, 0]}}}')
        self.viewer = subprocess.Popen(
            [PROGRAM, str(scene), "--out", str(self.folder)], env={**os.environ, "DISPLAY": self.display},
            stderr=subprocess.PIPE, text=True)
        self.addCleanup(self.viewer.stderr.close)
        self.addCleanup(self.viewer.wait)
        self.addCleanup(self.viewer.kill)

    def press_until(self, keyboard, key, done):
        """A key that comes before the window has the focus is lost."""
        end = time.monotonic() + LIMIT_S
        while time.monotonic() < end:
            keyboard.press(key)
            for _ in range(20):
                if done():
                    return
                time.sleep(0.1)
        self.fail(f"nothing happened after {key}; {self.viewer.poll()}")

    def files(self, pattern):
        return sorted(self.folder.glob(pattern))

    def test_keys_take_pictures_and_end_the_program(self):
        keyboard = Keyboard(self.display)
        self.press_until(keyboard, "p", lambda: len(self.files("screenshot_*.png")) > 0)
        self.press_until(keyboard, "v", lambda: len(self.files("video_*.avi")) > 0)
        # Source "light" is red, "other" is green; the key may come before or after the frame of the first screenshot.
        keyboard.press("n")
        self.press_until(
            keyboard, "p", lambda: len({path.read_bytes() for path in self.files("screenshot_*.png")}) > 1)
        self.press_until(keyboard, "Escape", lambda: self.viewer.poll() is not None)
        self.assertEqual(self.viewer.returncode, 0, self.viewer.stderr.read())
        self.assertGreater(self.files("video_*.avi")[0].stat().st_size, 5000)

    def test_without_a_display_it_says_so(self):
        environment = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
        scene = str(self.folder / "scene.json")
        done = subprocess.run([PROGRAM, scene], env=environment, capture_output=True, text=True)
        self.assertEqual(done.returncode, 4)
        self.assertIn("--headless", done.stderr)


if __name__ == "__main__":
    if shutil.which("Xvfb") is None:
        skip("there is no Xvfb (package xvfb)")
    try:
        ctypes.CDLL("libXtst.so.6")
    except OSError:
        skip("there is no libXtst.so.6 (package libxtst6)")
    unittest.main()
