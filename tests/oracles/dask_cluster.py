"""A Dask scheduler and workers as processes of their own, to be killed."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from oracles.processes import children, is_running, wait_until

PORT_FILE = "scheduler.json"
QUIET = {"DASK_LOGGING__DISTRIBUTED": "critical", "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "20"}


class Cluster:
    """A scheduler and workers as processes of their own. threads: of both workers together."""

    threads = 2

    def __init__(self, folder: Path) -> None:
        self.folder, self.started = folder, list[subprocess.Popen[bytes]]()
        self.scheduler = self.start_scheduler(0)
        for _ in range(self.threads):
            self.start("worker", self.address, "--nthreads", "1", "--no-dashboard")

    def start(self, *arguments: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", "dask", *arguments]
        process = subprocess.Popen(
            command,
            cwd=self.folder,
            env=os.environ | QUIET,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        self.started.append(process)
        return process

    def start_scheduler(self, port: int) -> subprocess.Popen[bytes]:
        about = self.folder / PORT_FILE
        about.unlink(missing_ok=True)
        process = self.start(
            "scheduler", "--host", f"127.0.0.1:{port}", "--no-dashboard", "--scheduler-file", about
        )
        wait_until(lambda: about.exists() and about.read_text().endswith("}"))
        self.address = json.loads(about.read_text())["address"]
        return process

    def start_again(self) -> None:
        """Kill the scheduler, and start it at the same port, with new workers."""
        self.scheduler.kill()
        self.scheduler.wait()
        self.scheduler = self.start_scheduler(int(self.address.rpartition(":")[2]))
        for _ in range(self.threads):
            self.start("worker", self.address, "--nthreads", "1", "--no-dashboard")

    def end(self) -> None:
        everyone = [pid for process in self.started for pid in children(process.pid)]
        for process in self.started:
            process.kill()
        for pid in everyone:
            if is_running(pid):
                os.kill(pid, signal.SIGKILL)
        for process in self.started:
            process.wait()
