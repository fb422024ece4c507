"""Pages of the site as axe judges them in Chromium, on light and dark screens.

axe comes from npm, in the version of the playground's lock file, so this takes long.
"""

import functools
import shutil
import subprocess
import threading
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer

import pytest

from maintenance.playground import build as playground
from tests.support.tab import START, tab

pytestmark = pytest.mark.long

LOADED = "document.readyState === 'complete'"
#: The pages, each with the condition that holds when it is complete.
PAGES = {
    "index.html": LOADED,
    "contents.html": LOADED,
    "first-message.html": LOADED,
    "rules/IDL504.html": LOADED,
    "interfaces/index.html": LOADED,
    "interfaces/sensor_msgs/msg-Imu.html": LOADED,
    "playground/index.html": "document.body?.dataset.first",
}
VIOLATIONS = """axe.run().then(({ violations }) => violations
    .filter(({ impact }) => ["serious", "critical"].includes(impact))
    .map(({ id, nodes }) => [id, ...nodes.slice(0, 3).map(({ html }) => html)]))"""


class Handler(SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@pytest.fixture(scope="module")
def axe(tmp_path_factory):
    folder = tmp_path_factory.mktemp("axe")
    for name in ("package.json", "package-lock.json", ".npmrc"):
        shutil.copy(playground.HERE / name, folder)
    subprocess.run(["npm", "ci"], cwd=folder, check=True, capture_output=True)  # noqa: S607
    return (folder / "node_modules/axe-core/axe.min.js").read_text(encoding="utf-8")


@pytest.fixture
def opened(site, tmp_path):
    """Return a function that opens a page of the site and returns its tab."""
    folder = shutil.copytree(site, tmp_path / "site")
    playground.build(folder / "playground")
    handler = functools.partial(Handler, directory=str(folder))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server, tab() as page:
        threading.Thread(target=server.serve_forever, daemon=True).start()

        def opened(name, ready=LOADED):
            page.open("about:blank")
            page.until("location.href === 'about:blank'")
            page.open(f"http://127.0.0.1:{server.server_port}/{name}")
            page.until(f"location.protocol === 'http:' && {ready}", START)
            return page

        yield opened
        server.shutdown()


def violations(page, axe):
    page.run(axe)
    return page.run(VIOLATIONS)


def test_axe_finds_nothing_serious(opened, axe):
    page = opened("404.html")
    page.run("document.body.innerHTML = '<img src=x.png><button></button>'")
    assert {"image-alt", "button-name"} <= {each[0] for each in violations(page, axe)}
    problems = {}
    for scheme in ("light", "dark"):
        media = [{"name": "prefers-color-scheme", "value": scheme}]
        page.send("Emulation.setEmulatedMedia", features=media)
        for name, ready in PAGES.items():
            if serious := violations(opened(name, ready), axe):
                problems[name, scheme] = serious
    assert problems == {}
