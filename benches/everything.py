"""All that may watch a worm, at once, against the lateness of its loop.

    cargo build --release --features bridge
    python3 benches/everything.py --minutes 10        # one run with everything: samples lost, processor time of each process
    python3 benches/everything.py --pairs 6           # 20 s with and without it in turns: wake lateness
    python3 benches/everything.py --pairs 6 --pages stream   # the same with pages that nobody draws on this computer

Everything is: a recording, a black box, a dashboard with three pages in headless Chromium, a scrape of its metrics every two seconds, and a bridge
with a laptop on the loopback interface. The processor time of Chromium, of the virtual worm, of controller and estimator is not counted.
A browser draws on a laptop or a phone, not on the robot; with `--pages stream` a page is what the robot has of it, a connection that reads the
same stream. Needs Linux, openssl, and `chromium` for `--pages browser`.
"""

import argparse
import contextlib
import http.client
import json
import os
import shutil
import signal
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
WORMD = ROOT / "target/release/wormd"
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def processor_s(pid):
    """What a process has used; None when it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()
    except OSError:
        return None
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def children(pid):
    """Processes that this one has started, by the name of their subcommand."""
    found = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parent = int(stat.read_text().rsplit(")", 1)[1].split()[1])
            words = (stat.parent / "cmdline").read_bytes().split(b"\0")
        except OSError:
            continue
        if parent == pid and len(words) > 1:
            name = words[1].decode()
            found[f"{name} --black-box" if b"--black-box" in words else name] = int(stat.parent.name)
    return found


class Everything:
    """What watches, from when it has started to its end."""

    def __init__(self, folder, config, pages):
        self.folder, self.processes, self.end = folder, {}, threading.Event()
        keys = folder / "keys"
        if not keys.exists():
            make = [ROOT / "config/bridge/make-keys", keys]
            for arguments in (["authority"], ["robot", "robot1", "127.0.0.1"], ["laptop", "anna"]):
                subprocess.run([*make, *arguments], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        port = 17447
        (folder / "bridge.toml").write_text(
            f'certificate = "keys/robot1.pem"\nkey = "keys/robot1.key"\nauthority = "keys/ca.pem"\nlisten = ["tls/127.0.0.1:{port}"]\n'
            f'[access]\ndrive = ["anna"]\nwatch = []\n[[worms]]\nconfig = "{config}"\n'
        )
        (folder / "fleet.toml").write_text(
            f'certificate = "keys/anna.pem"\nkey = "keys/anna.key"\nauthority = "keys/ca.pem"\nroot = "{folder}/far"\n'
            f'[[robots]]\nname = "robot1"\nconnect = "tls/127.0.0.1:{port}"\n'
        )
        dashboard = self.start("dashboard", "--listen", "127.0.0.1:0", "--config", config, stdout=subprocess.PIPE)
        address = next(line for line in iter(dashboard.stdout.readline, "") if "http://" in line).split()[-1].strip("/")
        self.start("bridge", "--config", folder / "bridge.toml")
        self.start("fleet", "--config", folder / "fleet.toml")
        self.pages = []
        for number in range(3):
            if pages == "browser":
                command = ["chromium", "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"]
                command += [f"--user-data-dir={folder}/page{number}", address]
                quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "start_new_session": True}
                self.pages.append(subprocess.Popen(command, **quiet))
            else:
                threading.Thread(target=self.read, args=(f"{address}/api/events",), daemon=True).start()
        threading.Thread(target=self.scrape, args=(f"{address}/metrics",), daemon=True).start()

    def start(self, subcommand, *arguments, **how):
        how = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "text": True} | how
        self.processes[subcommand] = subprocess.Popen([WORMD, subcommand, *map(str, arguments)], **how)
        return self.processes[subcommand]

    def scrape(self, url):
        while not self.end.wait(2):
            urllib.request.urlopen(url, timeout=10).read()

    def read(self, url):
        # The dashboard ends the stream in the middle of a chunk when it is stopped.
        with contextlib.suppress(http.client.IncompleteRead), urllib.request.urlopen(url) as stream:
            while not self.end.is_set() and stream.read(4096):
                pass

    def stop(self):
        self.end.set()
        for page in self.pages:
            os.killpg(page.pid, signal.SIGTERM)
            page.wait()
        for process in self.processes.values():
            process.terminate()
            process.wait()


def run(seconds, pages, number):
    """The summary of `up`, and the processor time by process; with everything, unless `pages` is None."""
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        name = f"ev{os.getpid() % 10000}-{number}"
        config = folder / "worm.toml"
        config.write_text(f'[worm]\nname = "{name}"\n')
        command = [WORMD, "up", "--config", config, "--json", "--duration", str(seconds)]
        if pages:
            command += ["--record", folder / "run.mcap", "--black-box", folder / "boxes"]
        up = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        time.sleep(3)
        used = {}
        if pages:
            everything = Everything(folder, config, pages)
            time.sleep(5)
            pids = {name: process.pid for name, process in everything.processes.items()} | children(up.pid)
            pgrep = ["pgrep", "-f", f"wormd relay.*{folder}"]
            relay = subprocess.run(pgrep, check=False, capture_output=True, text=True).stdout.split()
            if relay:
                pids["relay"] = int(relay[0])
            before, began = {name: processor_s(pid) for name, pid in pids.items()}, time.monotonic()
            time.sleep(max(1, seconds - 12))
            took_s = time.monotonic() - began
            for name, pid in pids.items():
                after = processor_s(pid)
                if after is not None and before[name] is not None:
                    used[name] = (after - before[name]) / took_s
        summary = json.loads(up.communicate()[0])
        if pages:
            everything.stop()
        return summary, used


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=0)
    parser.add_argument("--pairs", type=int, default=0)
    parser.add_argument("--pages", choices=("browser", "stream"), default="browser")
    arguments = parser.parse_args()
    if not (arguments.minutes or arguments.pairs):
        parser.error("nothing to measure: give --minutes or --pairs")
    needed = ("openssl", "chromium") if arguments.pages == "browser" else ("openssl",)
    if missing := [name for name in needed if shutil.which(name) is None]:
        instead = ", or give --pages stream for pages that nobody draws here" if missing == ["chromium"] else ""
        parser.error(f"{' and '.join(missing)} not found: install that first{instead}")
    if not WORMD.exists():
        parser.error(f"{WORMD} not found: cargo build --release --features bridge")
    if arguments.minutes:
        summary, used = run(60 * arguments.minutes, arguments.pages, 0)
        print(f"{summary['ticks']} ticks, {summary['samples_lost']} samples lost")
        for name, share in sorted(used.items(), key=lambda entry: -entry[1]):
            print(f"  {name}: {100 * share:.2f} % of a core")
        counted = [share for name, share in used.items() if name not in ("control", "estimate", "virtual-worm")]
        print(f"  together, without the worm itself: {100 * sum(counted):.2f} % of a core")
    wake = {False: [], True: []}
    for pair in range(arguments.pairs):
        for kind in (False, True):
            summary, _ = run(20, arguments.pages if kind else None, f"{pair}{int(kind)}")
            wake[kind].append(summary["timing"]["wake_us"])
            print(f"{'with' if kind else 'without'} everything: {summary['timing']['wake_us']}")
    for quantile in ("p50", "p99") if arguments.pairs else ():
        without, among = (statistics.median(run[quantile] for run in wake[kind]) for kind in (False, True))
        print(f"{quantile}: {without:.1f} us without, {among:.1f} us with everything, ratio {among / without:.2f}")


main()
