#!/usr/bin/env python3
"""The QMP client against a fake server."""
import json
import pathlib
import socket
import tempfile
import threading
import unittest

import harness_path  # noqa: F401
from hil.harness.qemu import Qmp, QmpError


class Server:
    """Sends the messages answers[i] in response to command i after qmp_capabilities."""

    def __init__(self, path, answers, greeting='{"QMP": {"version": {}, "capabilities": []}}'):
        self.asked = []
        self._listener = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        self._listener.bind(str(path))
        self._listener.listen(1)
        self._thread = threading.Thread(target=self._serve, args=(answers, greeting))
        self._thread.start()

    def _serve(self, answers, greeting):
        connection, _ = self._listener.accept()
        with connection, connection.makefile("rw") as lines:
            print(greeting, file=lines, flush=True)
            for answer, line in zip([[{"return": {}}], *answers], lines):
                self.asked.append(json.loads(line))
                for message in answer:
                    print(json.dumps(message), file=lines, flush=True)
            lines.read()

    def close(self):
        self._thread.join(10)
        self._listener.close()


class Sessions(unittest.TestCase):
    def serve(self, *answers, **options):
        self.path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / "qmp"
        server = Server(self.path, answers, **options)
        self.addCleanup(server.close)
        return server

    def test_an_answer_comes_back(self):
        server = self.serve([{"return": {"status": "running"}}])
        with Qmp(self.path) as qmp:
            self.assertEqual(qmp.command("query-status"), {"status": "running"})
        self.assertEqual(server.asked, [{"execute": "qmp_capabilities"}, {"execute": "query-status"}])

    def test_underscores_are_hyphens(self):
        server = self.serve([{"return": {}}])
        with Qmp(self.path) as qmp:
            qmp.command("x", in_command=1)
        self.assertEqual(server.asked[1], {"execute": "x", "arguments": {"in-command": 1}})

    def test_an_error_response_raises(self):
        self.serve([{"error": {"class": "GenericError", "desc": "Device 'cam9' not found"}}])
        with Qmp(self.path) as qmp, self.assertRaisesRegex(QmpError, "device_del: Device 'cam9' not found"):
            qmp.command("device_del", id="cam9")

    def test_events_before_the_answer_are_skipped(self):
        event = {"event": "DEVICE_DELETED", "data": {"device": "cam0", "path": "/x"}}
        self.serve([{"event": "RESUME"}, event, {"return": {"status": "running"}}])
        with Qmp(self.path) as qmp:
            self.assertEqual(qmp.command("device_del", id="cam0"), {"status": "running"})

    def test_no_answer_is_an_error(self):
        self.serve([])
        with Qmp(self.path, timeout_s=0.2) as qmp, self.assertRaisesRegex(QmpError, "did not answer in time"):
            qmp.command("query-status")

    def test_no_server_is_an_error(self):
        with self.assertRaisesRegex(QmpError, "does not answer"):
            Qmp(pathlib.Path("/nonexistent/qmp"))


if __name__ == "__main__":
    unittest.main()
