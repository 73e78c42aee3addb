"""Endless waits end at Ctrl-C even where the signal does not wake the main thread."""

from __future__ import annotations

import signal
import subprocess
import sys
import time

import pytest

SIGNAL_OF_ANOTHER_THREAD = """
import signal, threading, time
from hovi.system.terminal import wait_for_interrupt
from hovi.viewing.documents.demo import DemoServer
server = DemoServer() if {demo} else None
if server is not None:
    server._page = lambda chosen, tell: ""  # the first motion, so that it waits at once
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Thread(target=time.sleep, args=(60,), daemon=True).start()
signal.pthread_sigmask(signal.SIG_BLOCK, [signal.SIGINT])  # of the main thread alone
print("waits", flush=True)
try:
    server.plan_what_is_chosen() if {demo} else wait_for_interrupt()
except KeyboardInterrupt:
    pass
"""


@pytest.mark.parametrize("demo", [False, True])
def test_a_signal_that_another_thread_receives_ends_the_wait(demo: bool) -> None:
    command = [sys.executable, "-c", SIGNAL_OF_ANOTHER_THREAD.format(demo=demo)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE)
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == b"waits\n"
        time.sleep(1.0)  # until the wait has begun
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=60) == 0
    finally:
        process.kill()
        process.communicate()
