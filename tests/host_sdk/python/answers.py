"""Reads the files of make_answers: messages, queries and the results of C++. Format: make_answers.cpp."""

import collections
import pathlib


class Message:
    """A message's bytes (None: the recording's last lighting) and its lines by their first word, numbers as floats."""

    def __init__(self, payload):
        self.payload = payload
        self.lines = collections.defaultdict(list)


def read(folder):
    messages = []
    for line in (pathlib.Path(folder) / "answers.txt").read_text().splitlines():
        word, *rest = line.split()
        if word in ("message", "final"):
            messages.append(Message(bytes.fromhex(rest[0]) if rest else None))
        elif word == "info":
            messages[-1].sequence = int(rest[0])
            messages[-1].lines[word].append([float(v) for v in rest[1:]])
        elif word == "engine":
            messages[-1].lines[word].append((rest[0], [float(v) for v in rest[1:]]))
        else:
            messages[-1].lines[word].append([float(v) for v in rest])
    return messages
