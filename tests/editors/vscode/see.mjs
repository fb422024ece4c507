/**
 * What VS Code shows of a package, as JSON in the file that $SEEN names, and pictures beside it.
 *
 * VS Code runs as code-server, and a browser without a window shows it. All is done as people do
 * it, with keys; what was edited is saved, and read from disk.
 *
 *     node see.mjs FOLDER EXTENSION.vsix CHROMIUM RENAMING
 *
 * In the workspace RENAMING, a message is renamed.
 */

import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, readFileSync, readdirSync, rmSync, statSync } from "node:fs";
import { writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { chromium } from "playwright-core";

const [folder, vsix, browserPath, renaming] = process.argv.slice(2);
const out = dirname(process.env.SEEN);
const entry = fileURLToPath(new URL("node_modules/code-server/out/node/entry.js", import.meta.url));
const data = join(out, "data");
const SETTINGS = {
  "security.workspace.trust.enabled": false,
  "telemetry.telemetryLevel": "off",
  "workbench.startupEditor": "none",
  "workbench.tips.enabled": false,
  "workbench.enableExperiments": false,
  "extensions.autoUpdate": false,
  "extensions.autoCheckUpdates": false,
  "editor.minimap.enabled": false,
  "editor.fontSize": 14,
  "window.commandCenter": false,
  "git.enabled": false,
  "explorer.autoReveal": false, // where a definition leads is not where the next file is
};
const MINUTE = 1000 * (process.env.PATIENCE ?? 60);

/** Write settings; what a server would be taken from is set for a machine. */
function settle(scope, settings) {
  mkdirSync(join(data, scope), { recursive: true });
  writeFileSync(join(data, scope, "settings.json"), JSON.stringify(settings));
}

const common = ["--user-data-dir", data, "--extensions-dir", join(out, "extensions")];
common.push("--config", join(out, "config.yaml"));
settle("User", SETTINGS);
settle("Machine", {});
execFileSync(process.execPath, [entry, ...common, "--install-extension", vsix], { stdio: "inherit" });

const quiet = ["--disable-telemetry", "--disable-update-check", "--disable-getting-started-override"];
const server = spawn(
  process.execPath,
  [entry, ...common, ...quiet, "--auth", "none", "--bind-addr", "127.0.0.1:0"],
  { stdio: ["ignore", "pipe", "inherit"], detached: true }, // it has children, which end with it
);
const port = await new Promise((resolve, reject) => {
  let told = "";
  server.stdout.on("data", (part) => {
    told += part;
    const found = /listening on http:\/\/127\.0\.0\.1:(\d+)/.exec(told);
    if (found) {
      resolve(found[1]);
    }
  });
  server.on("exit", () => reject(new Error(`code-server ended: ${told}`)));
});
const browser = await chromium.launch({ executablePath: browserPath, args: ["--no-sandbox"] });
const page = await browser.newPage({ viewport: { width: 1180, height: 720 } });
page.setDefaultTimeout(MINUTE);
const { keyboard } = page;

const original = new Map();
function disk(path) {
  return readFileSync(join(folder, path), "utf8");
}

async function pick(text) {
  await keyboard.press("F1");
  const input = page.locator(".quick-input-widget input[type=text]").first();
  await input.waitFor();
  await input.fill(`>${text}`);
  await page.locator(".quick-input-widget .monaco-list-row.focused").waitFor();
  await keyboard.press("Enter");
  // a command may ask something, in the same place
  await until("end of the commands", async () => {
    return !(await input.isVisible()) || !(await input.inputValue()).startsWith(">");
  });
}

/** Answer a question: choose from a list, or type a text. */
async function reply(text, isChoice = false) {
  const input = page.locator(".quick-input-widget input[type=text]").first();
  await input.waitFor();
  if (text !== undefined) {
    await input.fill(text);
  }
  if (isChoice) {
    await page.locator(".quick-input-widget .monaco-list-row.focused").waitFor();
  }
  await keyboard.press("Enter");
}

async function open(path, line = 1, column = 1) {
  if (!original.has(path)) {
    original.set(path, disk(path));
  }
  const name = path.split("/").at(-1);
  const row = page.locator(`.explorer-folders-view .monaco-list-row[aria-label^="${name}"]`);
  const tab = page.locator(`.tab.active[data-resource-name="${name}"]`);
  await until(`tab of ${name}`, async () => {
    // where the pointer rests on a row, its full path comes up and covers the row below
    await page.mouse.move(0, 0);
    await page.locator(".workbench-hover").waitFor({ state: "hidden" });
    await row.dblclick(); // which hits another row where files come or go meanwhile
    return tab.waitFor({ timeout: 2000 }).then(() => true, () => false);
  });
  await keyboard.press("Control+g");
  const input = page.locator(".quick-input-widget input[type=text]").first();
  await input.waitFor();
  await until("line", async () => {
    await input.fill(`:${line}:${column}`);
    await keyboard.press("Enter");
    await page.waitForTimeout(50);
    return !(await input.isVisible());
  });
}

/** Save, return the file on disk once it is another one, and take back what was done. */
async function saved(path) {
  const before = original.get(path);
  await keyboard.press("Control+s");
  const after = await until(`change of ${path}`, () => disk(path) !== before && disk(path));
  await until("way back", async () => {
    await keyboard.press("Control+z");
    await keyboard.press("Control+s");
    await page.waitForTimeout(300);
    return disk(path) === before;
  });
  return after;
}

async function until(what, check) {
  for (let left = MINUTE / 50; left > 0; left--) {
    const found = await check();
    if (found) {
      return found;
    }
    await page.waitForTimeout(50);
  }
  throw new Error(`there was no ${what}`);
}

function lines() {
  return page.locator(".editor-instance .view-line").evaluateAll((all) =>
    all
      .map((one) => [Number.parseFloat(one.style.top), one.textContent.replaceAll("\u00a0", " ")])
      .sort(([one], [other]) => one - other)
      .map(([, text]) => text),
  );
}

function picture(name) {
  return page.screenshot({ path: join(out, `${name}.png`) });
}

/** The words that a squiggle is under: where the first is exactly as long as it. */
function marked() {
  return page.locator(".squiggly-error").first().evaluate((squiggle) => {
    const place = squiggle.getBoundingClientRect();
    const near = (one, other) => Math.abs(one - other) < 2;
    return [...document.querySelectorAll(".view-line span span")]
      .filter((word) => {
        const box = word.getBoundingClientRect();
        return near(box.left, place.left) && near(box.width, place.width);
      })
      .map((word) => word.textContent)[0];
  });
}

/** Show a workspace, with one of its files open. */
async function goTo(workspace, path) {
  const file = encodeURIComponent(
    JSON.stringify([["openFile", `vscode-remote://127.0.0.1:${port}${workspace}/${path}`]]),
  );
  await page.goto(`http://127.0.0.1:${port}/?folder=${workspace}&payload=${file}`);
  await page.locator(".view-line").first().waitFor();
}

/** The files of the packages in which a message is renamed, as they are on disk. */
function renamingOnDisk() {
  const list = (name) => readdirSync(join(renaming, name), { recursive: true }).map((one) => join(name, one));
  const isFile = (path) => statSync(join(renaming, path), { throwIfNoEntry: false })?.isFile();
  const paths = ["base", "fleet"].flatMap(list).filter(isFile); // some are renamed meanwhile
  return Object.fromEntries(paths.map((path) => [path, readFileSync(join(renaming, path), "utf8")]));
}

/** Save everything, and return what is on disk after some time in which nothing changes there. */
async function settled() {
  await keyboard.press("Control+k");
  await keyboard.press("s");
  let last = "";
  let times = 0;
  await until("rest", async () => {
    const now = JSON.stringify(renamingOnDisk());
    times = now === last ? times + 1 : 0;
    last = now;
    return times > 20;
  });
  return renamingOnDisk();
}

/** Ask for another name of the message in the first line; return the dialog that VS Code shows. */
async function askForRename(newName) {
  const box = page.locator(".rename-box input");
  await until("box for a name", async () => {
    await page.locator(".tab.active .monaco-icon-label").first().click();
    await keyboard.press("Control+Home");
    for (let column = 0; column < 6; column++) {
      await keyboard.press("ArrowRight");
    }
    await keyboard.press("F2");
    return box.waitFor({ timeout: 3000 }).then(() => true, () => false);
  });
  await box.fill(newName);
  await keyboard.press("Enter");
  const dialog = page.locator(".monaco-dialog-box", { hasText: "changes the type hash of" });
  await dialog.waitFor();
  return dialog;
}

/** Rename, undo and redo; return the files after each. */
async function renameUndoRedo(newName) {
  const dialog = await askForRename(newName);
  await dialog.getByText("Rename", { exact: true }).click();
  await dialog.waitFor({ state: "detached" });
  const seenFiles = { renamed: await settled() };
  await picture("rename-message");
  await keyboard.press("Control+z");
  const all = page.locator(".monaco-dialog-box").getByText(/^Undo in \d+ Files$/);
  await all.click({ timeout: 5000 }).catch(() => undefined); // it does not always ask
  seenFiles.undone = await settled();
  await keyboard.press("Control+y");
  seenFiles.redone = await settled();
  seenFiles.dialogs = await page.locator(".monaco-dialog-box").count();
  return seenFiles;
}

/** Rename a file in the explorer, and let the server edit what names it. */
async function renameFile(oldName, newName) {
  const row = page.locator(`.explorer-folders-view .monaco-list-row[aria-label^="${oldName}"]`);
  if (!(await row.count())) {
    for (const name of ["base", "msg"]) {
      await page.locator(`.explorer-folders-view .monaco-list-row[aria-label^="${name}"]`).first().click();
    }
  }
  await row.click();
  await keyboard.press("F2");
  const input = page.locator(".explorer-folders-view input");
  await input.fill(newName);
  await keyboard.press("Enter");
  await page.locator(".monaco-dialog-box").getByText("OK", { exact: true }).click();
  return settled();
}

const LOOKS = {
  async diagnostic() {
    await open("msg/Broken.msg");
    await page.locator(".squiggly-error").first().waitFor();
    const words = await marked();
    await keyboard.press("Control+Shift+m");
    const row = page.locator(".markers-panel .monaco-list-row .marker-message-line").first();
    await row.waitFor();
    const [, message, code] = /^(.*?)idlc\(?(IDL\d+)/.exec(await row.textContent());
    await picture("problem");
    await keyboard.press("Control+j");
    return [[`${code}: ${message}`, words]];
  },
  async fix() {
    await open("msg/Broken.msg");
    await page.locator(".squiggly-error").first().waitFor();
    const row = page.locator(".action-widget .monaco-list-row", { hasText: "float64" }).first();
    // a busy machine may answer before the squiggle's problem is known there
    await until("fix", async () => {
      await keyboard.press("Control+.");
      return row.waitFor({ timeout: 5000 }).then(() => true, () => false);
    });
    await picture("fix");
    await keyboard.press("Enter");
    await page.locator(".squiggly-error").first().waitFor({ state: "detached" });
    return saved("msg/Broken.msg");
  },
  async hover() {
    await open("msg/Fleet.msg", 1, 2);
    await keyboard.press("Control+k");
    await keyboard.press("Control+i");
    const hover = page.locator(".monaco-hover .hover-contents", { hasText: "RIHS01" }).first();
    await hover.waitFor();
    await picture("hover");
    const text = await hover.textContent();
    await keyboard.press("Escape");
    return text.replaceAll("\u00a0", " ");
  },
  async definition() {
    await open("msg/Fleet.msg", 1, 2);
    await keyboard.press("F12");
    const active = page.locator('.tab.active:not([data-resource-name="Fleet.msg"])');
    await active.waitFor();
    return active.getAttribute("data-resource-name");
  },
  async built_in() {
    await open("msg/Drive.msg", 3, 12);
    await keyboard.press("F12");
    await page.locator('.tab.active[data-resource-name="Header.msg"]').waitFor();
    const language = page.locator(".statusbar-item", { hasText: "ROS 2 interface" });
    await language.first().waitFor();
    await page.locator(".view-line", { hasText: "Time stamp" }).first().waitFor();
    return { language: "rosmsg", text: (await lines()).join("\n") };
  },
  async references() {
    await open("msg/Fleet.msg", 1, 2);
    await pick("Go to References");
    const list = page.locator(".peekview-widget .ref-tree");
    await list.locator(".monaco-list-row").first().waitFor();
    await picture("references");
    await list.locator(".monaco-list-row").first().click();
    for (let times = 0; times < 3; times++) {
      for (const closed of await list.locator('.monaco-list-row[aria-expanded="false"]').all()) {
        await closed.click();
      }
    }
    const labels = await list
      .locator(".monaco-list-row")
      .evaluateAll((rows) => rows.map((row) => row.getAttribute("aria-label")));
    await keyboard.press("Escape");
    return labels
      .map((label) => /(\w+\.msg) on line (\d+)/.exec(label))
      .filter(Boolean)
      .map(([, file, line]) => [file, Number(line)]);
  },
  async completion() {
    await open("msg/Fleet.msg", 3, 1);
    await keyboard.type("std_msgs/Head", { delay: 30 });
    await keyboard.press("Control+Space");
    const rows = page.locator(".suggest-widget.visible .monaco-list-row");
    await rows.filter({ hasText: "std_msgs/Header" }).first().waitFor();
    const words = await rows.locator(".label-name").allTextContents();
    await picture("completion");
    await keyboard.press("Enter");
    await page.locator(".view-line", { hasText: "std_msgs/Header" }).first().waitFor();
    const text = await saved("msg/Fleet.msg");
    return { words, line: text.trimEnd().split("\n").at(-1) };
  },
  async rename() {
    await open("msg/Drive.msg", 4, 10);
    await keyboard.press("F2");
    const box = page.locator(".rename-box input");
    await box.waitFor();
    await box.fill("velocity");
    await keyboard.press("Enter");
    // it breaks something, and says so before it does it
    const dialog = page.locator(".monaco-dialog-box", { hasText: "breaks hash, source" });
    await dialog.waitFor();
    await picture("rename");
    await dialog.getByText("Rename", { exact: true }).click();
    await page.locator(".view-line", { hasText: "velocity" }).first().waitFor();
    return saved("msg/Drive.msg");
  },
  async format() {
    await open("msg/Untidy.msg");
    await pick("Format Document");
    await page.locator(".view-line", { hasText: /^float64.speed/ }).first().waitFor();
    return saved("msg/Untidy.msg");
  },
  async symbol() {
    await open("msg/Drive.msg");
    await keyboard.press("Control+Shift+o");
    const rows = page.locator(".quick-input-list .monaco-list-row .label-name");
    await rows.first().waitFor();
    const found = await until("symbols", async () => {
      const names = await rows.allTextContents();
      return names.length > 3 && names;
    });
    await keyboard.press("Escape");
    return found;
  },
  async inlay_hint() {
    await open("msg/Drive.msg", 4, 8);
    const found = await until("hints", async () => {
      const text = (await lines()).map((line, at) => [at, /@[^#]*? B\b/.exec(line)?.[0]]);
      const hints = text.filter(([, hint]) => hint);
      return hints.length > 2 && hints;
    });
    await keyboard.press("Control+Shift+m");
    await page.locator(".markers-panel .monaco-list-row").nth(1).waitFor();
    await picture("hints");
    await keyboard.press("Control+j");
    return found;
  },
  async lens() {
    await open("msg/Drive.msg");
    const shown = page.locator(".codelens-decoration");
    const found = await until("lenses", async () => {
      const texts = (await shown.allTextContents()).join(" | ");
      return ["RIHS01_", "2 uses", "defaults: speed 0.5"].every((one) => texts.includes(one)) && texts;
    });
    await keyboard.press("Control+Shift+m");
    await page.locator(".markers-panel .monaco-list-row").nth(1).waitFor();
    await shown.first().waitFor();
    await picture("lens");
    await keyboard.press("Control+j");
    return found;
  },
  async update() {
    writeFileSync(join(folder, "pyproject.toml"), '[tool.idlc]\npaths = ["msg"]\nout = "new/demo_msgs"\n');
    writeFileSync(join(folder, "msg/Broken.msg"), "float64 x\n"); // or nothing would be written
    await open("msg/Fleet.msg");
    await until("action", async () => {
      await pick("Source Action...");
      const rows = page.locator(".action-widget .monaco-list-row");
      await rows.first().waitFor({ timeout: 2000 }).catch(() => undefined);
      const row = rows.filter({ hasText: "Update the generated package" });
      if (!(await row.count())) {
        await keyboard.press("Escape");
        return false;
      }
      await picture("update");
      await keyboard.press("Enter");
      return true;
    });
    const found = await until("result", () => existsSync(join(folder, "new/demo_msgs/msg/_drive.py")));
    rmSync(join(folder, "pyproject.toml"));
    return found;
  },
  async show() {
    await open("msg/Fleet.msg");
    await pick("idlc: Show an Interface");
    await reply();
    await page.locator('.tab.active[data-resource-name="Fleet"]').waitFor();
    await page.locator(".view-line", { hasText: "int32" }).first().waitFor();
    return (await lines()).join("\n");
  },
  async gen() {
    await open("msg/Untidy.msg");
    writeFileSync(join(folder, "msg/Broken.msg"), "float64 x\n"); // or nothing would be written
    await pick("idlc: Generate Python");
    await reply("out/demo_msgs");
    return until("result", () => existsSync(join(folder, "out/demo_msgs/msg/_drive.py")));
  },
  async scaffold() {
    await open("msg/Untidy.msg");
    await pick("idlc: New Package");
    await reply("Message", true);
    await page.locator(".quick-input-title", { hasText: "New Message" }).waitFor();
    await reply("Scan");
    return until("result", () => existsSync(join(folder, "msg/Scan.msg")));
  },
  async rename_message() {
    await goTo(renaming, "fleet/msg/Robot.msg");
    const closed = await renameUndoRedo("Waypoint");
    await goTo(renaming, "base/CMakeLists.txt");
    await goTo(renaming, "fleet/msg/Robot.msg");
    const open = await renameUndoRedo("Pose");
    return { closed, open };
  },
  async rename_file() {
    await goTo(renaming, "fleet/msg/Robot.msg");
    const dialog = await askForRename("Waypoint");
    await dialog.getByText("Cancel", { exact: true }).click();
    const renamed = await renameFile("Pose.msg", "Waypoint.msg");
    return { renamed, back: await renameFile("Waypoint.msg", "Pose.msg") };
  },
  async missing() {
    await goTo(folder, "msg/Drive.msg");
    settle("Machine", { "idlc.path": "/there/is/no/idlc" });
    const told = page.locator(".notification-list-item", { hasText: "does not serve editors" });
    await told.first().waitFor();
    await page.waitForTimeout(500); // for it to come to rest
    await picture("missing");
    return told.first().textContent();
  },
};

const seen = {};
try {
  await goTo(folder, "msg/Drive.msg");
  await page.locator('.explorer-folders-view .monaco-list-row[aria-label^="msg"]').click();
  for (const [name, look] of Object.entries(LOOKS)) {
    if (process.env.LOOK && !process.env.LOOK.split(",").includes(name)) {
      continue;
    }
    try {
      seen[name] = await look();
    } catch (error) {
      seen[name] = { failed: String(error) };
      await picture(`failed-${name}`);
      await keyboard.press("Escape");
      await keyboard.press("Escape");
    }
  }
  seen.errors = await page.locator(".notification-list-item .codicon-error").count();
} finally {
  writeFileSync(process.env.SEEN, JSON.stringify(seen));
  await browser.close();
  process.kill(-server.pid);
}
