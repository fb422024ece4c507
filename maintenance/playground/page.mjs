// The page: an editor whose language server is the worker, and views of what it holds.
// Text of the reader only ever becomes text: nothing here writes HTML.
import { autocompletion, completionKeymap } from "@codemirror/autocomplete";
import { defaultKeymap, history as undoing, historyKeymap } from "@codemirror/commands";
import { lintGutter, setDiagnostics } from "@codemirror/lint";
import { StateEffect, StateField } from "@codemirror/state";
import { Decoration, EditorView, hoverTooltip, keymap, lineNumbers } from "@codemirror/view";

const DRIVE = '# How to drive.\nfloat64 speed 0.5  # forward [m/s]\nstring<=16 frame "base"\nuint8[] gears [1, 2]\n';
// What a reader can choose; those with a task are tutorials of a minute.
const EXAMPLES = {
  "A message": { kind: "msg", name: "Drive", text: DRIVE.replace("float64", "std_msgs/Header header\nfloat64") },
  "A service": { kind: "srv", name: "AddTwoInts", text: "int64 a\nint64 b\n---\nint64 sum\n" },
  "An action": { kind: "action", name: "Countdown", text: "int32 start 10\n---\nbool done\n---\nint32 current\n" },
  "Tutorial: mend a mistake": {
    kind: "msg", name: "Scan", text: "# One turn of the scanner.\n\nfloat64 stamp\nflot64[<=3] ranges  # [m]\nfloat32 angle  # [deg]\n",
    task: "Point at the marked word, and write float64. Then read what idlc says about [deg], and write [rad].",
  },
  "Tutorial: see the bytes": {
    kind: "msg", name: "Drive", text: DRIVE, tab: "bytes",
    task: "Change the value of speed on the right, and watch its eight bytes. Then write float32 on the left: four bytes are left.",
  },
  "Tutorial: break a message": {
    kind: "msg", name: "Drive", text: DRIVE, tab: "breaking",
    task: "Rename speed to velocity: old and new nodes can no longer talk. Undo it, and add a field at the end.",
  },
};
const START = EXAMPLES["A message"];
const TABS = {
  bytes: "Bytes", python: "Python class", hash: "Type hash", schema: "JSON Schema", breaking: "What breaks",
};
const COLOURS = 6;
const LONGEST_LINK = 100_000;
const $ = (id) => document.getElementById(id);

function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// `#msg/Drive?text=…&before=…`: what a link shares. Anything else is the example.
function linked() {
  const match = /^#(msg|srv|action)\/([A-Z][A-Za-z0-9]{0,99})\?(.*)$/s.exec(location.hash.slice(0, LONGEST_LINK));
  if (!match) return { ...START, before: START.text };
  const values = new URLSearchParams(match[3]);
  const text = values.get("text") ?? "";
  return { kind: match[1], name: match[2], text, before: values.get("before") ?? text };
}

// Requests to the worker, answered in order.
const worker = new Worker("worker.mjs", { type: "module" });
const waiting = new Map();
let count = 0;
function ask(method, params = {}) {
  count += 1;
  worker.postMessage({ id: count, request: [method, params] });
  return new Promise((resolve, reject) => waiting.set(count, { resolve, reject }));
}
const ready = new Promise((resolve, reject) => {
  worker.onerror = (event) => reject(new Error(event.message));
  worker.onmessage = ({ data }) => {
    if (data.failed || data.ready) {
      if (data.failed) reject(new Error(data.failed));
      else resolve(data.ready);
      return;
    }
    const { resolve: done, reject: failed } = waiting.get(data.id);
    waiting.delete(data.id);
    if (data.failure) failed(new Error(data.failure));
    else done(data.answer);
  };
});

const state = { tab: "bytes", values: {}, ...linked() };
const offset = (doc, { line, character }) => Math.min(doc.line(Math.min(line + 1, doc.lines)).from + character, doc.length);
const position = (doc, at) => {
  const line = doc.lineAt(at);
  return { line: line.number - 1, character: at - line.from };
};

async function complete(context) {
  const word = context.matchBefore(/\w+/);
  if (!word && !context.explicit && !context.matchBefore(/[/=[( ]/)) return null;
  const answer = await ask("completion", position(context.state.doc, context.pos));
  const items = answer?.items ?? answer ?? [];
  return {
    from: word ? word.from : context.pos,
    options: items.map((item) => ({ label: item.label, detail: item.detail, apply: applied(item) })),
  };
}

// What a completion writes: its edit, or its text; placeholders of snippets are left out.
function applied(item) {
  const plain = (text) => (item.insertTextFormat === 2 ? text.replace(/\$\{\d+:([^}]*)\}|\$\d+/g, "$1") : text);
  if (!item.textEdit) return plain(item.insertText ?? item.label);
  return (view, completion, from, to) => {
    const { range, newText } = item.textEdit;
    const start = offset(view.state.doc, range.start);
    const insert = plain(newText);
    view.dispatch({ changes: { from: start, to: Math.max(to, start), insert }, selection: { anchor: start + insert.length } });
  };
}

const hover = hoverTooltip(async (view, at) => {
  const answer = await ask("hover", position(view.state.doc, at));
  if (!answer) return null;
  // Markdown as plain text
  const text = answer.contents.value.replace(/^```\w*$/gm, "").replace(/\*\*|`|\\(?=\W)/g, "").replace(/\n{3,}/g, "\n\n").trim();
  return { pos: at, create: () => ({ dom: element("pre", { className: "hover", textContent: text }) }) };
});

// Colours of the text as the worker last saw it; they move with what is typed.
const setColours = StateEffect.define();
const colours = StateField.define({
  create: () => Decoration.none,
  update(marks, { changes, effects }) {
    const effect = effects.find((each) => each.is(setColours));
    return effect ? effect.value : marks.map(changes);
  },
  provide: (field) => EditorView.decorations.from(field),
});

async function colour(text) {
  const marks = [];
  let at = 0;
  for (const [piece, name] of await ask("colours", { text })) {
    if (piece && name) marks.push(Decoration.mark({ class: name }).range(at, at + piece.length));
    at += piece.length;
  }
  if (view.state.doc.toString() === text) view.dispatch({ effects: setColours.of(Decoration.set(marks)) });
}

const view = new EditorView({
  parent: $("editor"),
  doc: state.text,
  extensions: [
    lineNumbers(), undoing(), lintGutter(), hover, colours, autocompletion({ override: [complete] }),
    keymap.of([...completionKeymap, ...defaultKeymap, ...historyKeymap]),
    EditorView.contentAttributes.of({ "aria-label": "Interface file" }),
    EditorView.updateListener.of((update) => {
      if (update.docChanged) changed();
    }),
  ],
});

const counted = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;

let isOpen = false;
let isReady = false;
async function changed() {
  if (!isOpen) return;
  const text = view.state.doc.toString();
  show(await ask("change", { text }), text);
}

async function open(before) {
  const text = view.state.doc.toString();
  state.before = before;
  isOpen = true;
  show(await ask("open", { kind: state.kind, name: state.name, text, before }), text);
}

// Show problems, unless the text has changed since.
function show(report, text) {
  const { doc } = view.state;
  if (doc.toString() !== text) return;
  const problems = report.items.map((problem) => ({
    from: offset(doc, problem.range.start),
    to: offset(doc, problem.range.end),
    severity: problem.severity === 1 ? "error" : "warning",
    message: `${problem.code}: ${problem.message}`,
    line: problem.range.start.line + 1,
  }));
  view.dispatch(setDiagnostics(view.state, problems));
  $("problems").replaceChildren(...problems.map(({ line, severity, message }) => element("li", { className: severity, textContent: `${line}: ${message}` })));
  const errors = problems.filter(({ severity }) => severity === "error").length;
  $("status").textContent = problems.length === 0 ? "No problems" : `${counted(errors, "error")}, ${counted(problems.length - errors, "warning")}`;
  performance.mark("problems");
  colour(text);
  refresh();
}

let timer;
function refresh() {
  clearTimeout(timer);
  timer = setTimeout(draw, 120);
}

async function draw() {
  if (!isOpen) return;
  const { tab } = state;
  const answer = await ask(tab, tab === "bytes" ? { values: state.values } : {});
  if (tab !== state.tab) return;
  const panel = $("view");
  if (tab === "breaking") panel.replaceChildren(changes(answer));
  else if (!answer) panel.replaceChildren(element("p", { textContent: "The text has errors." }));
  else if (tab === "bytes") drawBytes(panel, answer);
  else panel.replaceChildren(element("pre", { textContent: answer }));
  panel.dataset.tab = tab;
}

function changes(answer) {
  if (typeof answer === "string") return element("p", { textContent: `Not compared: ${answer}.` });
  if (answer.length === 0) return element("p", { textContent: "No breaking changes yet. Change a field on the left." });
  const items = answer.map(({ code, message, levels, hint }) => element("li", {
    textContent: `${code}: ${message} (breaks: ${levels.join(", ")})${hint ? ` – ${hint}` : ""}`,
  }));
  return element("ul", {}, ...items);
}

// A row is kept while its value is edited: only other cells change.
function drawBytes(panel, { hex, rows }) {
  const bytes = hex.match(/../g);
  const paths = JSON.stringify(rows.map(({ path, type }) => [path, type]));
  if (panel.dataset.paths !== paths || !panel.querySelector("table")) {
    const head = element("tr", {}, ...["field", "type", "value", "offset"].map((text) => element("th", { textContent: text })));
    const made = rows.map(({ path, type, value }, number) => {
      const input = element("input", { value, ariaLabel: path, spellcheck: false });
      input.oninput = () => {
        state.values[path] = input.value;
        refresh();
      };
      const name = element("td", {}, element("span", { className: `byte b${number % COLOURS}`, textContent: path }));
      return element("tr", {}, name, element("td", { textContent: type }), element("td", {}, input), element("td"), element("td", { className: "error" }));
    });
    panel.replaceChildren(element("table", {}, head, ...made), element("code"));
    panel.dataset.paths = paths;
  }
  const owner = [];
  rows.forEach(({ start, end, error }, number) => {
    const cells = panel.querySelectorAll("tr")[number + 1].cells;
    cells[3].textContent = `${start - 4} to ${end - 5}`;
    cells[4].textContent = error;
    owner.fill(number, start, end);
    for (let at = start; at < end; at += 1) owner[at] = number;
  });
  panel.querySelector("code").replaceChildren(...bytes.flatMap((byte, at) => {
    const number = owner[at];
    const title = number === undefined ? (at < 4 ? "header" : "padding") : rows[number].path;
    return [element("span", { className: number === undefined ? "byte" : `byte b${number % COLOURS}`, title, textContent: byte }), " "];
  }));
}

function select(tab) {
  state.tab = tab;
  for (const button of $("tabs").children) {
    const isSelected = button.dataset.tab === tab;
    button.setAttribute("aria-selected", isSelected);
    button.tabIndex = isSelected ? 0 : -1;
  }
  draw();
}

for (const [tab, textContent] of Object.entries(TABS)) {
  const button = element("button", { type: "button", role: "tab", textContent, onclick: () => select(tab) });
  button.dataset.tab = tab;
  button.setAttribute("aria-controls", "view");
  button.setAttribute("aria-selected", tab === state.tab);
  $("tabs").append(button);
}
$("tabs").onkeydown = (event) => {
  const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
  if (!step) return;
  const tabs = Object.keys(TABS);
  select(tabs[(tabs.indexOf(state.tab) + step + tabs.length) % tabs.length]);
  document.querySelector("[role=tab][aria-selected=true]").focus();
};

$("example").append(element("option", { textContent: "Choose…", value: "" }), ...Object.keys(EXAMPLES).map((textContent) => element("option", { textContent })));
$("example").onchange = () => {
  const example = EXAMPLES[$("example").value];
  if (!example) return;
  Object.assign(state, { kind: example.kind, values: {} });
  $("kind").value = example.kind;
  $("name").value = state.name = example.name;
  $("task").textContent = example.task ?? "";
  select(example.tab ?? state.tab);
  isOpen = false; // the text is of the document that opens next
  view.dispatch({ changes: { from: 0, to: view.state.doc.length, insert: example.text } });
  if (isReady) open(example.text);
  else state.before = example.text;
};
$("kind").value = state.kind;
$("name").value = state.name;
$("kind").onchange = $("name").onchange = () => {
  state.kind = $("kind").value;
  if (/^[A-Z][A-Za-z0-9]{0,99}$/.test($("name").value)) state.name = $("name").value;
  $("name").value = state.name;
  open(view.state.doc.toString());
};
$("share").onclick = async () => {
  const text = view.state.doc.toString();
  const values = new URLSearchParams(text === state.before ? { text } : { text, before: state.before });
  window.history.replaceState(null, "", `#${state.kind}/${state.name}?${values}`);
  const isCopied = await navigator.clipboard?.writeText(location.href).then(() => true, () => false);
  $("status").textContent = isCopied ? "Link copied" : "The link is in the address bar";
};
window.addEventListener("hashchange", () => location.reload());

navigator.serviceWorker?.register("sw.mjs").then(() => navigator.serviceWorker.ready).then(() => {
  document.body.dataset.offline = "ready";
});
const times = await ready.catch((error) => {
  $("status").textContent = `Python did not start: ${error.message}`;
  throw error;
});
document.body.dataset.bare = times.bare;
isReady = true;
await open(state.before);
document.body.dataset.first = performance.now();
