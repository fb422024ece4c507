/** The server's life: found, started, stopped, started again; and what is told of it. */

import * as vscode from "vscode";
import { LanguageClient, RenameRequest, State } from "vscode-languageclient/node";
import { find, setting, words, type Found } from "./find";

/** What is synchronized: interfaces, and the files that say what they belong to. */
const DOCUMENTS = [
  { language: "rosmsg" },
  { scheme: "file", pattern: "**/package.xml" },
  { scheme: "file", pattern: "**/pyproject.toml" },
  { scheme: "file", pattern: "**/CMakeLists.txt" },
];

export class Server {
  /** Which idlc serves, once it was found. */
  found: Found | undefined;
  private client: LanguageClient | undefined;
  private ending = false;
  private last: Promise<void> = Promise.resolve();
  private readonly status: vscode.LanguageStatusItem;

  constructor(
    private readonly log: vscode.LogOutputChannel,
    private readonly folder: string,
  ) {
    this.status = vscode.languages.createLanguageStatusItem("idlc", { language: "rosmsg" });
    this.status.name = "idlc";
  }

  /** Start the server, or stop it and start it again. */
  restart(): Promise<void> {
    this.ending = true;
    return this.next(async () => {
      await this.end();
      await this.begin();
    });
  }

  stop(): Promise<void> {
    this.ending = true;
    return this.next(() => this.end());
  }

  /** Do one thing after the other, whatever became of the one before. */
  private next(work: () => Promise<void>): Promise<void> {
    this.last = this.last.then(work).catch((error: unknown) => {
      this.log.error(String(error));
      this.show("idlc failed", vscode.LanguageStatusSeverity.Error, "idlc.log", "Show the log");
    });
    return this.last;
  }

  private async end(): Promise<void> {
    const client = this.client;
    this.client = undefined;
    await client?.dispose();
  }

  private async begin(): Promise<void> {
    this.status.busy = true;
    this.found = await find((line) => this.log.info(line), this.folder);
    this.status.busy = false;
    if (this.found === undefined) {
      this.missing();
      return;
    }
    const { command, version } = this.found;
    this.log.info(`${words(command)}: idlc ${version}`);
    const options = {
      command: command.program,
      args: [...command.args, "lsp"],
      options: { cwd: this.folder },
    };
    this.client = new LanguageClient("idlc", "idlc", options, {
      documentSelector: DOCUMENTS,
      outputChannel: this.log,
      middleware: {
        provideRenameEdits: (document, position, newName) =>
          this.renamed(document, position, newName),
        workspace: {
          // a server that is about to be stopped needs no news of settings
          didChangeConfiguration: async (sections, next) => {
            if (!this.ending) {
              await next(sections);
            }
          },
        },
      },
    });
    this.client.onDidChangeState(({ newState }) => {
      if (newState === State.Running) {
        this.show(`idlc ${version}`, vscode.LanguageStatusSeverity.Information);
        this.status.detail = words(command);
      } else if (newState === State.Stopped) {
        this.show("idlc stopped", vscode.LanguageStatusSeverity.Error, "idlc.restart", "Restart");
      }
    });
    this.ending = false;
    await this.client.start();
  }

  /**
   * Return the edits of a rename, once the user knows what it breaks.
   *
   * VS Code would show them with all boxes open, and not the words of the server.
   */
  private async renamed(
    document: vscode.TextDocument,
    position: vscode.Position,
    newName: string,
  ): Promise<vscode.WorkspaceEdit | undefined> {
    const client = this.client;
    if (client === undefined) {
      return undefined;
    }
    const edit = await client.sendRequest(RenameRequest.type, {
      textDocument: client.code2ProtocolConverter.asTextDocumentIdentifier(document),
      position: client.code2ProtocolConverter.asPosition(position),
      newName,
    });
    for (const note of Object.values(edit?.changeAnnotations ?? {})) {
      if (note.needsConfirmation) {
        const options = { modal: true, detail: note.description ?? "" };
        const chosen = await vscode.window.showWarningMessage(`${note.label}?`, options, "Rename");
        if (chosen === undefined) {
          return undefined;
        }
        note.needsConfirmation = false;
      }
    }
    return client.protocol2CodeConverter.asWorkspaceEdit(edit);
  }

  private show(
    text: string,
    severity: vscode.LanguageStatusSeverity,
    command = "idlc.log",
    title = "Log",
  ): void {
    this.status.text = text;
    this.status.detail = "";
    this.status.severity = severity;
    this.status.command = { command, title };
  }

  /** Say that there is no server, and what leads on. */
  private missing(): void {
    const named = setting("path") || setting("interpreter");
    const text = named ? `${named} does not serve editors` : "idlc is not installed";
    this.show(text, vscode.LanguageStatusSeverity.Warning, "idlc.install", "Install idlc");
    const ways: Record<string, () => unknown> = {
      "Install": () => vscode.commands.executeCommand("idlc.install"),
      "Use uvx": () => vscode.workspace.getConfiguration("idlc").update("uvx", true, true),
      "Settings": () => vscode.commands.executeCommand("workbench.action.openSettings", "idlc."),
      "Log": () => this.log.show(),
    };
    const offered = Object.keys(ways).filter((way) => !(named && way === "Use uvx"));
    void vscode.window
      .showWarningMessage(`${text}, so .msg, .srv and .action files only have colours.`, ...offered)
      .then((way) => way && ways[way]?.());
  }

  dispose(): void {
    this.status.dispose();
  }
}
