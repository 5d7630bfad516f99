"""A headless Chromium, started once and driven through its pipe; nothing but the standard library.

The protocol is that of its developer tools: JSON messages that end with a null byte.
"""

import base64
import fcntl
import json
import os
import select
import shutil
import subprocess
import time
from pathlib import Path

import pytest

COMMAND = shutil.which("chromium") or shutil.which("chromium-browser")
needs_chromium = pytest.mark.skipif(COMMAND is None, reason="chromium is not installed")

_LONGEST = 120.0  # s, for one answer


class Browser:
    """One tab of a browser that reaches no network."""

    def __init__(self, profile: Path):
        pipes = [os.pipe(), os.pipe()]
        # Above the numbers 3 and 4, which the browser expects.
        (theirs_in, self._out), (self._in, theirs_out) = [
            [fcntl.fcntl(end, fcntl.F_DUPFD_CLOEXEC, 20) for end in ends] for ends in pipes
        ]
        for end in (end for ends in pipes for end in ends):
            os.close(end)

        def numbered():
            os.dup2(theirs_in, 3)
            os.dup2(theirs_out, 4)

        self._process = subprocess.Popen(
            [COMMAND, "--headless", "--no-sandbox", "--disable-gpu", "--no-first-run",
             "--disable-background-networking", "--disable-component-update", "--disable-sync",
             "--disable-extensions", "--host-resolver-rules=MAP * ~NOTFOUND",
             "--remote-debugging-pipe", f"--user-data-dir={profile}", "about:blank"],
            preexec_fn=numbered, pass_fds=(3, 4),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        os.close(theirs_in)
        os.close(theirs_out)
        self._buffer, self._number, self._session, self.events = b"", 0, None, []
        targets = self.call("Target.getTargets")["targetInfos"]
        page = next(each for each in targets if each["type"] == "page")
        attached = self.call("Target.attachToTarget", targetId=page["targetId"], flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Network", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def close(self):
        self._process.terminate()
        self._process.wait(timeout=20)
        os.close(self._in)
        os.close(self._out)

    def call(self, method, **params):
        """Send a command and wait for its answer; events before it are kept."""
        self._number += 1
        message = {"id": self._number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        os.write(self._out, json.dumps(message).encode() + b"\0")
        while True:
            answer = self._next()
            if answer.get("id") == self._number:
                assert "error" not in answer, answer
                return answer["result"]
            self.events.append(answer)

    def _next(self):
        end = time.monotonic() + _LONGEST
        while b"\0" not in self._buffer:
            left = end - time.monotonic()
            assert left > 0.0 and select.select([self._in], [], [], left)[0], "no answer"
            part = os.read(self._in, 1 << 20)
            assert part, "the browser has gone"
            self._buffer += part
        message, _, self._buffer = self._buffer.partition(b"\0")
        return json.loads(message)

    def open(self, path: Path):
        """Load a file; returns when it has run."""
        self.events.clear()
        self.call("Page.navigate", url=path.as_uri())
        while not any(each.get("method") == "Page.loadEventFired" for each in self.events):
            self.events.append(self._next())

    def run(self, script):
        """The value of a JavaScript expression, of which a promise is waited for."""
        answer = self.call(
            "Runtime.evaluate", expression=script, returnByValue=True, awaitPromise=True,
            userGesture=True,
        )  # fmt: skip
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def size(self, width, height=900):
        self.call("Emulation.setDeviceMetricsOverride", width=width, height=height,
                  deviceScaleFactor=1, mobile=False)  # fmt: skip

    def scheme(self, name):
        features = [{"name": "prefers-color-scheme", "value": name}]
        self.call("Emulation.setEmulatedMedia", features=features)

    def pdf(self):
        answer = self.call("Page.printToPDF", printBackground=True, preferCSSPageSize=True)
        return base64.b64decode(answer["data"])

    def requests(self):
        """Addresses that were asked for since the page was opened; not what its policy refused."""
        refused = {each["params"]["requestId"] for each in self.events
                   if each.get("method") == "Network.loadingFailed"
                   and each["params"].get("blockedReason") == "csp"}  # fmt: skip
        return [each["params"]["request"]["url"] for each in self.events
                if each.get("method") == "Network.requestWillBeSent"
                and each["params"]["requestId"] not in refused]  # fmt: skip

    def errors(self):
        """What the page or the browser complained of."""
        return [each["params"] for each in self.events
                if each.get("method") in ("Runtime.exceptionThrown", "Log.entryAdded")]  # fmt: skip
