"""A real Chromium, without a window, that opens pages of a folder and measures them."""

import contextlib
import functools
import json
import os
import queue
import shutil
import subprocess
import tempfile
import threading
from collections.abc import Iterator
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

from tests.support.waiting import WORK

NAMES = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable")
FLAGS = (
    "--headless=new",
    "--no-sandbox",  # CI runs in containers, as root; the pages are our own
    "--disable-gpu",
    "--disable-dev-shm-usage",
    "--disable-background-networking",
    "--no-first-run",
    "--hide-scrollbars",  # a page is as wide as its frame
    "--window-size=1600,1200",
)
DARK = "--blink-settings=preferredColorScheme=0"
#: Opens each page in a frame and gives it each width: one start of the browser does for all.
HARNESS = """<!doctype html><body><script type="module">
import { measure } from "./measure.js";
const { pages, widths } = await (await fetch("/wanted")).json();
const found = [];
let failed = null;
try {
  for (const page of pages) {
    const frame = document.createElement("iframe");
    frame.style = `width: ${widths[0]}px; height: 900px; border: 0`;
    frame.src = `/site/${page}`;
    document.body.replaceChildren(frame);
    await new Promise((ready) => { frame.onload = ready; });
    for (const width of widths) {
      frame.style.width = `${width}px`;
      for (let count = 0; count < 2; count += 1) {
        await new Promise((ready) => { requestAnimationFrame(ready); });
      }
      found.push({ page, width, ...await measure(frame.contentWindow, width) });
    }
  }
} catch (error) { failed = `${error}\\n${error.stack}`; }
await fetch("/found", { method: "POST", body: JSON.stringify({ found, failed }) });
</script>
"""


def command() -> str:
    found = next(filter(None, map(shutil.which, NAMES)), None)
    assert found, f"no Chromium on PATH ({', '.join(NAMES)}): install it, or run with BROWSER=no"
    return found


class _Handler(SimpleHTTPRequestHandler):
    def __init__(self, *args, site, script, wanted, found):
        self.texts = {"/": HARNESS, "/measure.js": script, "/wanted": json.dumps(wanted)}
        self.found = found
        super().__init__(*args, directory=str(site))

    def translate_path(self, path):
        return super().translate_path(path.removeprefix("/site"))

    def do_GET(self):
        text = self.texts.get(self.path)
        if text is None:
            super().do_GET()
            return
        kind = "text/javascript" if self.path.endswith(".js") else "text/html; charset=utf-8"
        data = text.encode()
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def do_POST(self):
        self.found.put(self.rfile.read(int(self.headers["Content-Length"])))
        self.send_response(204)
        self.end_headers()

    def log_message(self, *_):
        pass


def measured(
    site: Path, pages: list[str], widths: list[int], script: str, *, dark: bool = False
) -> list[dict]:
    """Return what the JavaScript function `measure(window, width)` says of each page.

    `dark` is whether the browser's user prefers dark pages.
    """
    found: queue.Queue[bytes] = queue.Queue()
    wanted = {"pages": pages, "widths": widths}
    handler = functools.partial(_Handler, site=site, script=script, wanted=wanted, found=found)
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        with _started(*([DARK] if dark else []), address) as process:
            try:
                answer = json.loads(found.get(timeout=WORK))
            finally:
                process.terminate()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(timeout=20)
                process.kill()
                server.shutdown()
    assert not answer["failed"], answer["failed"]
    return answer["found"]


def dumped(page: Path) -> str:
    """Return a page that was opened as a file, as it is after five seconds of its own clock."""
    words = ("--virtual-time-budget=5000", "--dump-dom", page.as_uri())
    with _started(*words, stdout=subprocess.PIPE) as process:
        try:
            return process.communicate(timeout=WORK)[0].decode("utf-8")
        finally:
            process.kill()


@contextlib.contextmanager
def _started(*words: str, stdout: int = subprocess.DEVNULL) -> Iterator[subprocess.Popen]:
    """Start a browser with a profile of its own."""
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as profile,
        subprocess.Popen(
            [command(), *FLAGS, f"--user-data-dir={profile}", *words],
            stdin=subprocess.DEVNULL,
            stdout=stdout,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "HOME": profile},
            start_new_session=True,
        ) as process,
    ):
        yield process
