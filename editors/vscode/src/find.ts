/** Where the server is: idlc in an interpreter, on PATH, or run by uvx. */

import { execFile } from "node:child_process";
import { existsSync } from "node:fs";
import { homedir } from "node:os";
import { join } from "node:path";
import { promisify } from "node:util";
import * as vscode from "vscode";

/** How idlc is started, without its own arguments. */
export interface Command {
  readonly program: string;
  readonly args: readonly string[];
}

export interface Found {
  readonly command: Command;
  readonly version: string;
}

/** Seconds for a first start, in which Python may compile and uvx download. */
const PATIENCE = 120;
const run = promisify(execFile);

/** What the user set, with `~` and `${workspaceFolder}` replaced. */
export function setting(name: "path" | "interpreter" | "installFrom"): string {
  const text = vscode.workspace.getConfiguration("idlc").get<string>(name, "").trim();
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri.fsPath ?? "";
  return text.replace(/^~(?=[/\\])/, homedir()).replaceAll("${workspaceFolder}", folder);
}

/** The interpreter that is meant: that of the settings, of the Python extension, of a `.venv`. */
export async function interpreter(): Promise<string | undefined> {
  return setting("interpreter") || ((await chosenInPython()) ?? virtualEnvironment());
}

/** The words of a command for people. */
export function words(command: Command): string {
  return [command.program, ...command.args].join(" ");
}

/** Return the first command that serves editors; what was tried goes to `log`. */
export async function find(log: (line: string) => void, cwd: string): Promise<Found | undefined> {
  for (const command of await candidates()) {
    const version = await versionOf(command, log, cwd);
    if (version !== undefined) {
      return { command, version };
    }
  }
  return undefined;
}

/** What to try, in order. What the user named is never replaced by something else. */
async function candidates(): Promise<Command[]> {
  const path = setting("path");
  if (path) {
    return [{ program: path, args: [] }];
  }
  const python = await interpreter();
  const inPython = python ? [{ program: python, args: ["-m", "idlc"] }] : [];
  if (setting("interpreter")) {
    return inPython;
  }
  // Cyclone DDS has another program that is called idlc; rosidlc is always this one.
  const onPath = ["rosidlc", "idlc"].map((program) => ({ program, args: [] }));
  const uvx = vscode.workspace.getConfiguration("idlc").get<boolean>("uvx", false);
  const byUvx = { program: "uvx", args: ["--from", setting("installFrom"), "idlc"] };
  return [...inPython, ...onPath, ...(uvx ? [byUvx] : [])];
}

/**
 * Return the version of idlc if a command is idlc and serves editors.
 *
 * It runs in a folder of the extension: `python -m` imports from the working folder first, and a
 * workspace may have a `logging.py`.
 */
async function versionOf(
  command: Command,
  log: (line: string) => void,
  cwd: string,
): Promise<string | undefined> {
  const args = [...command.args, "lsp", "--check"];
  try {
    const { stdout } = await run(command.program, args, { cwd, timeout: PATIENCE * 1000 });
    const { serverInfo } = JSON.parse(stdout);
    if (serverInfo.name === "idlc") {
      return String(serverInfo.version);
    }
    log(`${words(command)}: is another program`);
  } catch (error) {
    const lines = String(error instanceof Error ? error.message : error).trim().split("\n");
    log(`${words(command)}: ${lines.at(-1)}`);
  }
  return undefined;
}

/** What is used of the Python extension. */
interface PythonApi {
  readonly environments: {
    getActiveEnvironmentPath(resource?: vscode.Uri): { path: string };
    resolveEnvironment(
      path: object,
    ): Promise<{ executable: { uri?: vscode.Uri | undefined } } | undefined>;
    onDidChangeActiveEnvironmentPath(listener: () => void): vscode.Disposable;
  };
}

/** The Python extension, if there is one. */
async function python(): Promise<PythonApi["environments"] | undefined> {
  const extension = vscode.extensions.getExtension<Partial<PythonApi>>("ms-python.python");
  try {
    return (await extension?.activate())?.environments;
  } catch {
    return undefined; // it has told what is wrong with it
  }
}

async function chosenInPython(): Promise<string | undefined> {
  const environments = await python();
  const folder = vscode.workspace.workspaceFolders?.[0]?.uri;
  const path = environments?.getActiveEnvironmentPath(folder);
  const environment = path && (await environments?.resolveEnvironment(path));
  return environment?.executable.uri?.fsPath;
}

function virtualEnvironment(): string | undefined {
  const inside = process.platform === "win32" ? ["Scripts", "python.exe"] : ["bin", "python"];
  return vscode.workspace.workspaceFolders
    ?.map((folder) => join(folder.uri.fsPath, ".venv", ...inside))
    .find((path) => existsSync(path));
}

/** Call a function when another interpreter is chosen in the Python extension. */
export async function onOtherInterpreter(then: () => void): Promise<vscode.Disposable> {
  const environments = await python();
  return environments?.onDidChangeActiveEnvironmentPath(then) ?? new vscode.Disposable(() => {});
}
