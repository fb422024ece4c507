// Compiles the packages with the Python that imports them: `node compile.mjs ARCHIVE`.
import { readFileSync, writeFileSync } from "node:fs";
import { loadPyodide } from "pyodide";

const [, , path] = process.argv;
const python = await loadPyodide();
python.FS.writeFile("/packages.zip", readFileSync(path));
python.runPython(`
import io, py_compile, zipfile

with zipfile.ZipFile("/packages.zip") as given, zipfile.ZipFile("/compiled.zip", "w") as made:
    for name in given.namelist():
        data = given.read(name)
        if name.endswith(".py"):
            with open("/module.py", "wb") as file:
                file.write(data)
            mode = py_compile.PycInvalidationMode.UNCHECKED_HASH
            py_compile.compile("/module.py", "/module.pyc", f"/packages/{name}", True, -1, mode)
            with open("/module.pyc", "rb") as file:
                made.writestr(zipfile.ZipInfo(f"{name}c"), file.read(), zipfile.ZIP_DEFLATED)
        if not name.endswith(".py") or name.startswith("idlc/runtime/"):  # packages carry these
            made.writestr(zipfile.ZipInfo(name), data, zipfile.ZIP_DEFLATED)
`);
writeFileSync(path, python.FS.readFile("/compiled.zip"));
