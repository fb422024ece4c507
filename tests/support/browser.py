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
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

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
#: Opens each page in a frame of each width, so that one start of the browser does for all.
HARNESS = """<!doctype html><body><script type="module">
import { measure } from "./measure.js";
const { pages, widths } = await (await fetch("/wanted")).json();
const found = [];
let failed = null;
try {
  for (const width of widths) {
    for (const page of pages) {
      const frame = document.createElement("iframe");
      frame.style = `width: ${width}px; height: 900px; border: 0`;
      frame.src = `/site/${page}`;
      document.body.replaceChildren(frame);
      await new Promise((ready) => { frame.onload = ready; });
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


def measured(site: Path, pages: list[str], widths: list[int], script: str) -> list[dict]:
    """Return what the JavaScript function `measure(window, width)` says of each page."""
    found: queue.Queue[bytes] = queue.Queue()
    wanted = {"pages": pages, "widths": widths}
    handler = functools.partial(_Handler, site=site, script=script, wanted=wanted, found=found)
    with (
        tempfile.TemporaryDirectory() as profile,
        ThreadingHTTPServer(("127.0.0.1", 0), handler) as server,
    ):
        threading.Thread(target=server.serve_forever, daemon=True).start()
        address = f"http://127.0.0.1:{server.server_port}/"
        with subprocess.Popen(
            [command(), *FLAGS, f"--user-data-dir={profile}", address],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env={**os.environ, "HOME": profile},
            start_new_session=True,
        ) as process:
            try:
                answer = json.loads(found.get(timeout=120))
            finally:
                process.terminate()
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(timeout=20)
                process.kill()
                server.shutdown()
    assert not answer["failed"], answer["failed"]
    return answer["found"]
