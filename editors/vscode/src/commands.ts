/** Commands that run idlc: they show what they run, in a terminal where it may ask or change files. */

import { execFile } from "node:child_process";
import { existsSync, readFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { promisify } from "node:util";
import * as vscode from "vscode";
import { interpreter, setting, type Command } from "./find";
import type { Server } from "./server";

const run = promisify(execFile);
/** `python -m` would import from the folder in which it runs first, and that is the user's. */
const SAFE = { PYTHONSAFEPATH: "1" };

/** Run a program in a terminal; return whether it ended well. */
async function inTerminal(command: Command, title: string, cwd: string): Promise<boolean> {
  const { program, args } = command;
  const task = new vscode.Task(
    { type: "idlc" },
    vscode.TaskScope.Workspace,
    title,
    "idlc",
    new vscode.ProcessExecution(program, [...args], { cwd, env: SAFE }),
  );
  task.presentationOptions = { focus: true, clear: true };
  const execution = await vscode.tasks.executeTask(task);
  return new Promise((resolve) => {
    const listener = vscode.tasks.onDidEndTaskProcess((event) => {
      if (event.execution === execution) {
        listener.dispose();
        resolve(event.exitCode === 0);
      }
    });
  });
}

/** Install idlc into the interpreter that is chosen, or as a tool of uv's. */
export async function install(server: Server): Promise<void> {
  const python = await interpreter();
  const from = setting("installFrom") || "idlc";
  const command = python
    ? { program: python, args: ["-m", "pip", "install", from] }
    : { program: "uv", args: ["tool", "install", from] };
  if (await inTerminal(command, "Install idlc", process.cwd())) {
    await server.restart();
  }
}

/** The command that runs idlc with some words; tells the user if there is none. */
function idlc(server: Server, ...args: string[]): Command | undefined {
  if (server.found === undefined) {
    void vscode.window.showWarningMessage("idlc: the server was not found.");
    return undefined;
  }
  const { command } = server.found;
  return { program: command.program, args: [...command.args, ...args] };
}

/** The path that a command is about: what was clicked, or else what is edited. */
function pathOf(clicked?: vscode.Uri): string | undefined {
  const edited = vscode.window.activeTextEditor?.document.uri;
  const uri = clicked ?? (edited?.scheme === "file" ? edited : undefined);
  return uri?.fsPath ?? vscode.workspace.workspaceFolders?.[0]?.uri.fsPath;
}

/** The nearest folder at or above a path that holds a file which passes a test. */
function nearest(path: string, name: string, test = (_: string) => true): string | undefined {
  for (let folder = path; ; folder = dirname(folder)) {
    const file = join(folder, name);
    if (existsSync(file) && test(file)) {
      return folder;
    }
    if (folder === dirname(folder)) {
      return undefined;
    }
  }
}

/** Whether a pyproject.toml says where `idlc gen` writes. */
function saysWhere(file: string): boolean {
  return /^\[tool\.idlc\](?:\r?\n(?!\[).*)*?\r?\nout\s*=/m.test(readFileSync(file, "utf8"));
}

/** Generate the Python package of what is edited, as its settings say or into a folder. */
export async function gen(server: Server, clicked?: vscode.Uri): Promise<void> {
  const path = pathOf(clicked);
  if (path === undefined) {
    return;
  }
  const settled = nearest(path, "pyproject.toml", saysWhere);
  if (settled !== undefined) {
    const command = idlc(server, "gen");
    await (command && inTerminal(command, "idlc gen", settled));
    return;
  }
  const source = nearest(path, "package.xml") ?? dirname(path);
  const out = await vscode.window.showInputBox({
    title: "Generate Python",
    prompt: `The folder to write, from ${source}`,
    value: join("build", "idlc", basename(source)),
  });
  const command = out ? idlc(server, "gen", source, "--out", out) : undefined;
  await (command && inTerminal(command, "idlc gen", source));
}

/** Show an interface with all that is in it, as a document that cannot be edited. */
export async function show(server: Server, shown: Shown): Promise<void> {
  const editor = vscode.window.activeTextEditor;
  const edited = editor?.document.languageId === "rosmsg" ? editor : undefined;
  const path = edited?.document.uri.scheme === "file" ? edited.document.uri.fsPath : undefined;
  const name = await vscode.window.showInputBox({
    title: "Show an Interface",
    prompt: "A type such as std_msgs/msg/Header, or a file",
    value: path ?? "",
  });
  const command = name ? idlc(server, "show", name) : undefined;
  if (name === undefined || command === undefined) {
    return;
  }
  const cwd = dirname(path ?? join(pathOf() ?? process.cwd(), "any"));
  try {
    const env = { ...process.env, ...SAFE };
    const { stdout } = await run(command.program, [...command.args], { cwd, env });
    await shown.open(basename(name).replace(/\.\w+$/, ""), stdout);
  } catch (error) {
    const told = (error as { stderr?: string }).stderr?.trim() || String(error);
    void vscode.window.showErrorMessage(told);
  }
}

/** Documents that show what a command printed. */
export class Shown implements vscode.TextDocumentContentProvider {
  static readonly scheme = "idlc-show";
  private readonly texts = new Map<string, string>();
  private readonly changed = new vscode.EventEmitter<vscode.Uri>();
  readonly onDidChange = this.changed.event;

  provideTextDocumentContent(uri: vscode.Uri): string {
    return this.texts.get(uri.path) ?? "";
  }

  async open(name: string, text: string): Promise<void> {
    const uri = vscode.Uri.from({ scheme: Shown.scheme, path: `/${name}` });
    this.texts.set(uri.path, text);
    this.changed.fire(uri);
    const document = await vscode.workspace.openTextDocument(uri);
    await vscode.languages.setTextDocumentLanguage(document, "rosmsg");
    await vscode.window.showTextDocument(document, { preview: true });
  }
}

/** What `idlc scaffold` can write: its words, what its name looks like, and where it runs. */
const KINDS: Record<string, { words: string[]; value: string; inPackage: boolean }> = {
  "Package": { words: ["package"], value: "my_robot", inPackage: false },
  "Message": { words: ["interface", "msg"], value: "MyMessage", inPackage: true },
  "Service": { words: ["interface", "srv"], value: "MyService", inPackage: true },
  "Action": { words: ["interface", "action"], value: "MyAction", inPackage: true },
  "Node": { words: ["node"], value: "my_node", inPackage: true },
};

/** Write a new package, interface or node; idlc asks for the rest in the terminal. */
export async function scaffold(server: Server, clicked?: vscode.Uri): Promise<void> {
  const title = await vscode.window.showQuickPick(Object.keys(KINDS), { title: "What shall it be?" });
  const kind = KINDS[title ?? ""];
  const path = pathOf(clicked);
  if (kind === undefined || path === undefined) {
    return;
  }
  const { words, value, inPackage } = kind;
  const name = await vscode.window.showInputBox({ title: `New ${title}`, prompt: "Its name", value });
  const root = vscode.workspace.getWorkspaceFolder(vscode.Uri.file(path))?.uri.fsPath;
  const around = nearest(path, "package.xml");
  const cwd = (inPackage ? around : (around && dirname(around)) ?? root) ?? root;
  const command = name ? idlc(server, "scaffold", ...words, name) : undefined;
  if (command !== undefined && cwd !== undefined) {
    await inTerminal(command, `New ${title}`, cwd);
  }
}
