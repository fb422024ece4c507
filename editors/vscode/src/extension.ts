/** The extension for VS Code: it finds `idlc lsp`, starts it, and has commands for the rest of idlc. */

import * as vscode from "vscode";
import { gen, install, scaffold, show, Shown } from "./commands";
import { onOtherInterpreter } from "./find";
import { Server } from "./server";

/** Settings that say which server is meant; the server reads the others itself. */
const WHICH = ["path", "interpreter", "uvx", "installFrom"].map((name) => `idlc.${name}`);
let server: Server | undefined;

export async function activate(context: vscode.ExtensionContext): Promise<void> {
  const log = vscode.window.createOutputChannel("idlc", { log: true });
  const here = new Server(log, context.extensionPath);
  const shown = new Shown();
  server = here;
  const commands: Record<string, (clicked?: vscode.Uri) => unknown> = {
    restart: () => here.restart(),
    log: () => log.show(),
    install: () => install(here),
    gen: (clicked) => gen(here, clicked),
    show: () => show(here, shown),
    scaffold: (clicked) => scaffold(here, clicked),
  };
  context.subscriptions.push(
    log,
    here,
    vscode.workspace.registerTextDocumentContentProvider(Shown.scheme, shown),
    ...Object.entries(commands).map(([name, does]) =>
      vscode.commands.registerCommand(`idlc.${name}`, does),
    ),
    vscode.workspace.onDidChangeConfiguration((change) => {
      if (WHICH.some((name) => change.affectsConfiguration(name))) {
        void start(here);
      }
    }),
    vscode.workspace.onDidGrantWorkspaceTrust(() => void start(here)),
  );
  await start(here);
  context.subscriptions.push(await onOtherInterpreter(() => void start(here)));
}

/** Start the server anew, in a workspace that is trusted: what serves may come from there. */
async function start(here: Server): Promise<void> {
  if (vscode.workspace.isTrusted) {
    await here.restart();
  }
}

export async function deactivate(): Promise<void> {
  await server?.stop();
}
