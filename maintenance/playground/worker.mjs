// idlc in a worker: Python, its packages and the session come from this folder.
import { loadPyodide } from "./pyodide.mjs";

const began = performance.now();
const base = new URL(".", import.meta.url).href;

async function loaded() {
  const [python, packages] = await Promise.all([
    loadPyodide({ indexURL: base }),
    fetch(`${base}packages.zip`).then((answer) => answer.arrayBuffer()),
  ]);
  const bare = performance.now() - began;
  python.unpackArchive(packages, "zip", { extractDir: "/packages" });
  python.runPython(`
import sys
sys.path.insert(0, "/packages")
from pathlib import Path
from maintenance.playground.session import Session
session = Session(Path("/"))
`);
  return { session: python.globals.get("session"), bare };
}

const { session, bare } = await loaded().catch((error) => {
  postMessage({ failed: `${error.message}`.trim().split("\n").pop() });
  throw error;
});
// From here on there is nothing to load, and nothing to send but answers. Prototypes have these
// names, too. The service worker refuses what import() asks of other hosts.
const connecting = ["fetch", "XMLHttpRequest", "WebSocket", "WebSocketStream", "WebTransport", "EventSource"];
const others = ["Worker", "SharedWorker", "BroadcastChannel", "importScripts", "indexedDB", "caches", "FontFace"];
for (let place = globalThis; place; place = Object.getPrototypeOf(place)) {
  for (const name of [...connecting, ...others]) {
    if (place === globalThis || Object.hasOwn(place, name)) {
      Object.defineProperty(place, name, { value: undefined, configurable: false, writable: false });
    }
  }
}
onmessage = ({ data: { id, request } }) => {
  const start = performance.now();
  let answer;
  let failure = null;
  try {
    answer = JSON.parse(session.handle(JSON.stringify(request)));
  } catch (error) {
    failure = `${error.message}`.trim().split("\n").pop();
  }
  postMessage({ id, answer, failure, time: performance.now() - start });
};
postMessage({ ready: { bare, all: performance.now() - began } });
