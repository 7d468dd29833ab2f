"""Programs whose rows are reported while they run."""
import json
import os
import queue
import subprocess
import threading

from figure_topics.rows import row


def rows_of_program(command, rows_of, say):
    """Runs a program and yields the rows that `rows_of` makes of each JSON object that it prints, one a line, as they
    come. A program that fails or gives no row ends with a row that does not hold; the rows before it stay."""
    shown = " ".join(str(getattr(part, "name", part)) for part in command)
    say(shown)
    count = 0
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as program:
        for line in program.stdout:
            for figure in rows_of(json.loads(line)):
                count += 1
                yield figure
    if program.returncode or not count:
        yield row(shown, "exit status 0, and figures", f"exit status {program.returncode}, {count} figures", "", False,
                  "")


def side_by_side(streams):
    """Yields the rows of several iterables of rows as they come. As many of them run at a time as there are
    processors, the first ones first."""
    rows, waiting = queue.Queue(), list(streams)
    lock, ended = threading.Lock(), object()

    def work():
        while True:
            with lock:
                if not waiting:
                    break
                stream = waiting.pop(0)
            try:
                for figure in stream:
                    rows.put(figure)
            except Exception as error:  # Raised again where the rows are read.
                rows.put(error)
        rows.put(ended)

    workers = [threading.Thread(target=work, daemon=True) for _ in range(min(len(waiting), os.cpu_count()))]
    for worker in workers:
        worker.start()
    running = len(workers)
    while running:
        item = rows.get()
        if item is ended:
            running -= 1
        elif isinstance(item, Exception):
            raise item
        else:
            yield item
