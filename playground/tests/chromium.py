"""Drives a headless Chromium by its DevTools protocol, over pipes and with the standard library alone."""

import base64
import fcntl
import json
import os
import shutil
import subprocess
import tempfile
import time
from pathlib import Path


class Failed(Exception):
    """What the browser or the page says is wrong."""


class Chromium:
    """One page in a browser of its own."""

    def __init__(self, width: int = 1280, height: int = 800):
        program = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
        if program is None:
            raise Failed("no Chromium on the PATH")
        self.profile = tempfile.mkdtemp(prefix="n3p-play-")
        self.downloads = tempfile.mkdtemp(prefix="n3p-play-")
        # Commands go in by descriptor 3 and answers come out by 4; none of ours may be in their way.
        (theirs_in, ours_out), (ours_in, theirs_out) = os.pipe(), os.pipe()
        ends = [fcntl.fcntl(fd, fcntl.F_DUPFD, 10) for fd in (theirs_in, theirs_out)]

        def connect():
            os.dup2(ends[0], 3)
            os.dup2(ends[1], 4)

        arguments = [
            program, "--headless=new", "--no-sandbox", "--disable-gpu", "--no-first-run", "--hide-scrollbars",
            "--remote-debugging-pipe", f"--user-data-dir={self.profile}", f"--window-size={width},{height}", "about:blank",
        ]
        self.process = subprocess.Popen(
            arguments, preexec_fn=connect, close_fds=False, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        for fd in (theirs_in, theirs_out, *ends):
            os.close(fd)
        self.input, self.output = ours_out, os.fdopen(ours_in, "rb")
        self.last, self.session, self.complaints = 0, None, []
        target = next(t for t in self.call("Target.getTargets")["targetInfos"] if t["type"] == "page")
        self.session = self.call("Target.attachToTarget", targetId=target["targetId"], flatten=True)["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Browser.setDownloadBehavior", behavior="allow", downloadPath=self.downloads)
        self.size(width, height)

    def call(self, method: str, **parameters):
        self.last += 1
        message = {"id": self.last, "method": method, "params": parameters}
        if self.session:
            message["sessionId"] = self.session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self.input, data):]
        while True:
            answer = self.read()
            if answer.get("id") == self.last:
                if "error" in answer:
                    raise Failed(f"{method}: {answer['error']['message']}")
                return answer["result"]

    def read(self) -> dict:
        data = bytearray()
        while (byte := self.output.read(1)) != b"\0":
            if not byte:
                raise Failed("the browser ended")
            data += byte
        message = json.loads(data)
        # What the page throws, and what it was kept from loading.
        if message.get("method") == "Runtime.exceptionThrown":
            details = message["params"]["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", details["text"]))
        elif message.get("method") == "Log.entryAdded" and message["params"]["entry"]["level"] == "error":
            self.complaints.append(message["params"]["entry"]["text"])
        return message

    def run(self, script: str):
        """The value of an expression in the page; a promise's is waited for."""
        result = self.call("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in result:
            details = result["exceptionDetails"]
            raise Failed(details.get("exception", {}).get("description", details["text"]) + f"\nin {script[:200]}")
        return result["result"].get("value")

    def wait(self, condition: str, seconds: float = 20):
        """Until a condition holds in the page."""
        end = time.monotonic() + seconds
        while not self.run(f"Boolean({condition})"):
            if time.monotonic() > end:
                raise Failed(f"after {seconds} s not yet: {condition}")
            time.sleep(0.03)

    def open(self, address: str):
        self.call("Page.navigate", url="about:blank")
        self.call("Page.navigate", url=address)
        self.wait("document.documentElement?.dataset.ready !== undefined", 60)

    def size(self, width: int, height: int, touch: bool = False):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=1, mobile=touch)

    def dark(self, on: bool):
        value = "dark" if on else "light"
        self.call("Emulation.setEmulatedMedia", features=[{"name": "prefers-color-scheme", "value": value}])

    def mouse(self, kind: str, x: float, y: float, buttons: int = 1):
        self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left" if buttons else "none", buttons=buttons, clickCount=1)

    def drag(self, points, between=lambda i: None):
        self.mouse("mouseMoved", *points[0], buttons=0)
        self.mouse("mousePressed", *points[0])
        for i, point in enumerate(points[1:]):
            self.mouse("mouseMoved", *point)
            between(i)
        self.mouse("mouseReleased", *points[-1])

    def key(self, key: str, code: int = 0, modifiers: int = 0):
        text = {"text": key} if len(key) == 1 and not modifiers & 2 else {}
        for kind in ("keyDown", "keyUp"):
            self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code, modifiers=modifiers,
                      **(text if kind == "keyDown" else {}))

    def choose(self, element: str, value: str):
        self.run(f"(() => {{ const e = document.getElementById({element!r}); e.value = {value!r};"
                 " e.dispatchEvent(new Event('input')); e.dispatchEvent(new Event('change')); })()")

    def files(self, element: str, *paths):
        root = self.call("DOM.getDocument")["root"]["nodeId"]
        node = self.call("DOM.querySelector", nodeId=root, selector=f"#{element}")["nodeId"]
        self.call("DOM.setFileInputFiles", nodeId=node, files=[str(p) for p in paths])

    def picture(self, file: Path):
        data = self.call("Page.captureScreenshot", format="png")["data"]
        file.write_bytes(base64.b64decode(data))

    def processor_seconds(self, *others: int) -> float:
        """What the browser's processes, and others with theirs, have taken so far of the processors."""
        parents, taken = {}, {}
        for folder in Path("/proc").glob("[0-9]*"):
            try:
                fields = (folder / "stat").read_text().rpartition(")")[2].split()
            except OSError:
                continue
            parents[int(folder.name)] = int(fields[1])
            taken[int(folder.name)] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
        family = {self.process.pid, *others}
        while grown := {pid for pid, parent in parents.items() if parent in family} - family:
            family |= grown
        return sum(taken.get(pid, 0) for pid in family)

    def close(self):
        try:
            self.session = None
            self.call("Browser.close")
        except (Failed, OSError):
            pass
        try:
            self.process.wait(10)
        except subprocess.TimeoutExpired:
            self.process.kill()
        for folder in (self.profile, self.downloads):
            shutil.rmtree(folder, ignore_errors=True)
