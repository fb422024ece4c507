/** What the grammar calls each word, as VS Code reads it. */

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { test } from "node:test";

const require = createRequire(import.meta.url);
const { loadWASM, OnigScanner, OnigString } = require("vscode-oniguruma");
const { INITIAL, Registry, parseRawGrammar } = require("vscode-textmate");

const file = new URL("../syntaxes/rosmsg.tmLanguage.json", import.meta.url);
const wasm = loadWASM(readFileSync(require.resolve("vscode-oniguruma/release/onig.wasm")).buffer);
const registry = new Registry({
  onigLib: wasm.then(() => ({
    createOnigScanner: (patterns) => new OnigScanner(patterns),
    createOnigString: (text) => new OnigString(text),
  })),
  loadGrammar: async () => parseRawGrammar(readFileSync(file, "utf8"), "grammar.json"),
});
const grammar = await registry.loadGrammar("source.rosmsg");

/** The words of a line that have a name, as `word: name`. */
function named(line) {
  return grammar
    .tokenizeLine(line, INITIAL)
    .tokens.map(({ startIndex, endIndex, scopes }) => [
      line.slice(startIndex, endIndex).trim(),
      scopes.at(-1).replace(/^source$|\.rosmsg$/, ""),
    ])
    .filter(([word, name]) => word && name !== "source")
    .map(([word, name]) => `${word}: ${name}`);
}

const CASES = {
  "---": ["---: keyword.control.separator"],
  "float64 speed 0.5": [
    "float64: storage.type",
    "speed: variable.other.member",
    "0.5: constant.numeric",
  ],
  "std_msgs/msg/Header[<=3] stamps": [
    "std_msgs: entity.name.namespace",
    "/: punctuation.separator",
    "msg: entity.name.namespace",
    "/: punctuation.separator",
    "Header: entity.name.type",
    "[: punctuation.definition.array",
    "<=: keyword.operator.bound",
    "3: constant.numeric.bound",
    "]: punctuation.definition.array",
    "stamps: variable.other.member",
  ],
  "string<=10[4] names": [
    "string: storage.type",
    "<=: keyword.operator.bound",
    "10: constant.numeric.bound",
    "[: punctuation.definition.array",
    "4: constant.numeric.bound",
    "]: punctuation.definition.array",
    "names: variable.other.member",
  ],
  "Pose2D p": ["Pose2D: entity.name.type", "p: variable.other.member"],
  "stringy s": ["stringy: entity.name.type", "s: variable.other.member"],
  "uint8 MAX=0xFF": [
    "uint8: storage.type",
    "MAX: variable.other.constant",
    "=: keyword.operator.assignment",
    "0xFF: constant.numeric",
  ],
  "string GREETING = hello 5x": [
    "string: storage.type",
    "GREETING: variable.other.constant",
    "=: keyword.operator.assignment",
    "hello: string.unquoted",
    "5x: string.unquoted",
  ],
  "@optional bool ok TRUE": [
    "@optional: storage.modifier",
    "bool: storage.type",
    "ok: variable.other.member",
    "TRUE: constant.language",
  ],
  'string[] words ["a b", c]': [
    "string: storage.type",
    "[: punctuation.definition.array",
    "]: punctuation.definition.array",
    "words: variable.other.member",
    "[: punctuation.definition.array",
    '"a b": string.quoted',
    ",: punctuation.definition.array",
    "c: string.unquoted",
    "]: punctuation.definition.array",
  ],
  // a comment begins at the first #, even inside quotes
  'string s "a#b"': [
    "string: storage.type",
    "s: variable.other.member",
    '"a: string.unquoted',
    "#: punctuation.definition.comment",
    'b": comment.line.number-sign',
  ],
  "int8 x  # speed [m/s], idlc: ignore[IDL421] as before": [
    "int8: storage.type",
    "x: variable.other.member",
    "#: punctuation.definition.comment",
    "speed: comment.line.number-sign",
    "[m/s]: constant.other.unit",
    ",: comment.line.number-sign",
    "idlc:: keyword.other.remark",
    "ignore: keyword.other.remark",
    "[: comment.line.number-sign",
    "IDL421: constant.other.code",
    "]: comment.line.number-sign",
    "as before: comment.line.number-sign",
  ],
};

for (const [line, expected] of Object.entries(CASES)) {
  test(line, () => assert.deepEqual(named(line), expected));
}

test("every primitive type is one", () => {
  for (const size of [8, 16, 32, 64]) {
    assert.deepEqual(named(`int${size}`), [`int${size}: storage.type`]);
    assert.deepEqual(named(`uint${size}`), [`uint${size}: storage.type`]);
  }
  for (const name of ["bool", "byte", "char", "float32", "float64", "string", "wstring"]) {
    assert.deepEqual(named(name), [`${name}: storage.type`]);
  }
});
