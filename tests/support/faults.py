"""A process that commits faults: faults.py FOLDER < commands.

Each line of its input is a JSON object: `words` for idlc, and the fault. It forks for each, so that
what was imported is imported once. Faults are committed at the writes that Python's audit events
tell of, whichever function makes them: opening for writing, moving, making and removing.

    {"point": N}                     end the process, as kill -9 does, before write number N
    {"point": N, "torn": true}       the same, after a file that was being written got a few bytes
    {"point": N, "error": 28}        fail write number N, and all that follow, with an errno
    {"point": N, "remove": "out"}    remove a folder before write number N
    {"size": N}                      let no file become larger than N bytes
    {"user": N}                      run as another user
    {"cwd": "pkg"}                   run in a folder below

With `rewrite`, a recording and a target, it rewrites that instead of running words.

It answers with {"status": …, "points": …, "said": …}; status -9 is a killed process.
"""

import contextlib
import errno
import importlib
import io
import json
import os
import pkgutil
import resource
import shutil
import sys

import idlc
import idlc.generate.python.render
import idlc.generate.templates
import idlc.project.settings

WRITES = {"os.mkdir", "os.rmdir", "os.remove", "os.rename", "os.utime", "os.chmod", "os.truncate"}


class Fault:
    """Counts writes below a folder and commits a fault at one of them."""

    def __init__(self, folder, order):
        self.folder = folder
        self.order = order
        self.count = 0
        self.busy = False

    def hook(self, event, arguments):
        if self.busy or not self.is_write(event, arguments):
            return
        self.busy = True
        self.count += 1
        try:
            self.commit(event, str(arguments[0]))
        finally:
            self.busy = False

    def is_write(self, event, arguments):
        if event == "open":
            path, _, flags = arguments
            if not isinstance(path, str | bytes | os.PathLike):
                return False
            writes = flags & (os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC)
        else:
            path, writes = arguments[0] if arguments else None, event in WRITES
        whole = os.path.abspath(os.fsdecode(path)) if writes else ""  # noqa: PTH100 - keeps links
        return whole.startswith(self.folder)

    def commit(self, event, path):
        point = self.order.get("point")
        if point is None or self.count < point:
            return
        if "error" in self.order:
            number = self.order["error"]
            raise OSError(number, os.strerror(number), path)
        if self.count > point:
            return
        if "remove" in self.order:
            shutil.rmtree(f"{self.folder}/{self.order['remove']}", ignore_errors=True)
            return
        if self.order.get("torn") and event == "open":
            handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
            os.write(handle, b"to")
        os.kill(os.getpid(), 9)


def run(folder, order, answer):
    os.chdir(f"{folder}/{order.get('cwd', '')}")
    fault = Fault(os.path.realpath(folder), order)
    if "size" in order:
        resource.setrlimit(resource.RLIMIT_FSIZE, (order["size"], order["size"]))
    if "user" in order:
        os.setgroups([])
        os.setgid(order["user"])
        os.setuid(order["user"])
    from idlc.cli.main import main as main_main

    out = io.StringIO()
    sys.addaudithook(fault.hook)
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        recordings = order.get("rewrite")
        status = rewritten(*recordings) if recordings else main_main(order["words"])
    fault.order = {}
    text = json.dumps({"status": status, "points": fault.count, "said": out.getvalue()})
    os.write(answer, text.encode())


def rewritten(source, target):
    from idlc.recordings.containers.source import RecordingError
    from idlc.recordings.rewrite import Conversion, rewrite

    def convert(raws, _):
        return [bytes(raw) * 2 for raw in raws]

    try:
        rewrite(source, target, {"/imu": Conversion("a/msg/B", "ros2msg", "", "RIHS01_b", convert)})
    except RecordingError as error:
        print(error)
        return 1
    return 0


def main():
    folder = sys.argv[1]
    # everything that a run imports; another user may not be allowed to read it
    for found in pkgutil.walk_packages(idlc.__path__, "idlc."):
        if not found.name.startswith(("idlc.runtime.", "idlc.__main__", "idlc.cli.pytest_plugin")):
            importlib.import_module(found.name)
    names = ("difflib", "encodings.idna", "encodings.unicode_escape", "fcntl", "html", "tempfile")
    for name in (*names, "xml.parsers.expat"):
        importlib.import_module(name)
    idlc.generate.templates.environment()
    idlc.project.settings.toml("")
    for line in sys.stdin:
        order = json.loads(line)
        read, write = os.pipe()
        child = os.fork()
        if child == 0:
            os.close(read)
            try:
                run(folder, order, write)
            finally:
                os._exit(0)
        os.close(write)
        with os.fdopen(read, "rb") as stream:
            said = stream.read()
        _, status = os.waitpid(child, 0)
        killed = os.WIFSIGNALED(status) and os.WTERMSIG(status)
        found = (
            json.loads(said) if said else {"status": -killed if killed else errno.EIO, "said": ""}
        )
        print(json.dumps(found), flush=True)


if __name__ == "__main__":
    main()
