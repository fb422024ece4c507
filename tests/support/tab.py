"""A tab of a real Chromium, driven by the DevTools protocol over a pipe: real keys, no network."""

import contextlib
import itertools
import json
import os
import select
import subprocess
import tempfile

from tests.support.browser import FLAGS, command
from tests.support.waiting import LIMIT, WORK, wait_for

#: Seconds until the playground has started, which compiles WebAssembly on a busy machine.
START = 120


class Tab:
    """A tab; `events` are what it reported."""

    def __init__(self, reader, writer):
        self._reader, self._writer = reader, writer
        self._ids = itertools.count(1)
        self._rest = b""
        self._session = None
        self.events = []
        target = self.send("Target.createTarget", url="about:blank")["targetId"]
        attached = self.send("Target.attachToTarget", targetId=target, flatten=True)
        self._session = attached["sessionId"]
        for domain in ("Page", "Runtime", "Network"):
            self.send(f"{domain}.enable")

    def send(self, method, **params):
        """Return the result of a command."""
        number = next(self._ids)
        message = {"id": number, "method": method, "params": params}
        if self._session:
            message["sessionId"] = self._session
        data = json.dumps(message).encode() + b"\0"
        while data:
            data = data[os.write(self._writer, data) :]
        while True:
            answer = self._next()
            if answer.get("id") == number:
                assert "error" not in answer, answer["error"]
                return answer["result"]
            if "method" in answer:
                self.events.append(answer)

    def _next(self):
        while b"\0" not in self._rest:
            assert select.select([self._reader], [], [], WORK)[0], "Chromium does not answer"
            data = os.read(self._reader, 1 << 16)
            assert data, "Chromium ended"
            self._rest += data
        whole, _, self._rest = self._rest.partition(b"\0")
        return json.loads(whole)

    def run(self, script):
        """Return the value of an expression, which may be a promise."""
        words = {"expression": script, "awaitPromise": True, "returnByValue": True}
        result = self.send("Runtime.evaluate", **words)
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def until(self, script, limit=LIMIT):
        """Return the value of an expression as soon as it is true."""

        def value():
            with contextlib.suppress(AssertionError):  # the page is being replaced
                return self.run(script)

        return wait_for(value, script, limit=limit)

    def open(self, address):
        """Open a page; it may still be loading."""
        self.send("Page.navigate", url=address)

    def key(self, key, code, number, modifiers=0):
        """Press and release a key."""
        words = {"key": key, "code": code, "windowsVirtualKeyCode": number, "modifiers": modifiers}
        self.send("Input.dispatchKeyEvent", type="rawKeyDown", **words)
        self.send("Input.dispatchKeyEvent", type="keyUp", **words)

    def type(self, text):
        """Type characters, each as a key of its own."""
        for character in text:
            self.send("Input.dispatchKeyEvent", type="keyDown", text=character, key=character)
            self.send("Input.dispatchKeyEvent", type="keyUp", key=character)


@contextlib.contextmanager
def tab():
    """Start a browser and yield a tab of it."""
    from_us, to_browser = os.pipe()
    from_browser, to_us = os.pipe()

    def pipes():
        # the browser reads file descriptor 3 and writes 4
        reader, writer = os.dup(from_us), os.dup(to_us)
        os.dup2(reader, 3)
        os.dup2(writer, 4)

    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [command(), *FLAGS, "--remote-debugging-pipe", f"--user-data-dir={profile}"],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "HOME": profile},
            preexec_fn=pipes,
            close_fds=False,
            start_new_session=True,
        )
        os.close(from_us)
        os.close(to_us)
        try:
            yield Tab(from_browser, to_browser)
        finally:
            process.terminate()
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(timeout=20)
            process.kill()
            process.wait(LIMIT)
            os.close(from_browser)
            os.close(to_browser)
