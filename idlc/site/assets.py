"""What all pages share: how they look, light and dark, and the search."""

from __future__ import annotations

STYLE = """\
:root {
  --back: #fff; --text: #1c2430; --soft: #5a6675; --line: #dde3ea; --card: #f5f7fa;
  --link: #0b5cad; --msg: #0b6e4f; --srv: #8a4b08; --action: #6b2fa0;
}
@media (prefers-color-scheme: dark) {
  :root {
    --back: #12161c; --text: #e4e9f0; --soft: #9aa7b6; --line: #2b3440; --card: #1a2028;
    --link: #7db8f5; --msg: #6fd3ae; --srv: #f0b26b; --action: #c9a2f2;
  }
}
* { box-sizing: border-box; }
body {
  margin: 0 auto; max-width: 68rem; padding: 0 1rem 4rem; background: var(--back);
  color: var(--text); font: 16px/1.55 system-ui, sans-serif; overflow-wrap: anywhere;
}
header {
  display: flex; gap: 1rem; align-items: center; justify-content: space-between;
  padding: 1rem 0; border-bottom: 1px solid var(--line);
}
a { color: var(--link); text-decoration: none; }
a:hover, a:focus { text-decoration: underline; }
.search span { position: absolute; left: -99rem; }
input {
  width: min(22rem, 55vw); padding: .45rem .7rem; border: 1px solid var(--line);
  border-radius: 6px; background: var(--card); color: inherit; font: inherit;
}
#found {
  margin: .5rem 0 0; padding: .5rem .5rem .5rem 2.5rem; border: 1px solid var(--line);
  border-radius: 6px; background: var(--card);
}
#found small { color: var(--soft); margin-left: .6rem; }
#found.none { padding-left: .7rem; list-style: none; color: var(--soft); }
h1 { margin: .2rem 0 1rem; }
h2 { margin: 2rem 0 .6rem; font-size: 1.15rem; }
h1 small, td small {
  padding: .1rem .5rem; border: 1px solid; border-radius: 1rem; font-size: .8rem; font-weight: 500;
}
.msg { color: var(--msg); } .srv { color: var(--srv); } .action { color: var(--action); }
.path { margin: 0; }
.path, .facts { color: var(--soft); }
.picture { overflow-x: auto; }
table { width: 100%; margin: .6rem 0 1.2rem; border-collapse: collapse; table-layout: fixed; }
th, td { padding: .45rem .8rem .45rem 0; border-bottom: 1px solid var(--line); text-align: left;
  vertical-align: top; }
th { color: var(--soft); font-size: .85rem; font-weight: 500; }
th.name { width: 23%; } th.type { width: 24%; } th.unit { width: 5.5rem; }
th.value { width: 14%; } th.title { width: 34%; } th.kind { width: 6.5rem; }
td p, td pre { margin: 0; }
td p + p, td p + pre, td pre + p, td pre + pre { margin-top: .5rem; }
code, pre, td.type, td.title, text { font-family: ui-monospace, monospace; font-size: .9rem; }
pre { white-space: pre-wrap; }
td.value code { display: block; max-height: 8rem; overflow-y: auto; }
@media (max-width: 46rem) {
  thead { display: none; }
  table, tbody, tr, td { display: block; }
  tr { padding: .5rem 0; border-bottom: 1px solid var(--line); }
  td { padding: .1rem 0; border: 0; }
  td:empty { display: none; }
  td { vertical-align: baseline; }
  td.name, td.type, td.title, td.kind { display: inline-block; margin-right: .8rem; }
  td.name, td.title { font-weight: 600; }
  td.value code { display: inline-block; vertical-align: top; line-height: 1.8; }
  td.unit::before, td.value::before { content: attr(data-head) " "; color: var(--soft); }
}
details { margin: 2rem 0; }
summary { cursor: pointer; color: var(--link); }
details pre {
  padding: .8rem; border: 1px solid var(--line); border-radius: 6px; background: var(--card);
}
main { padding-top: 1rem; }
p { white-space: pre-line; }
td.unit span { padding: 0 .35rem; border-radius: 4px; background: var(--card); }
.empty { color: var(--soft); }
:target { background: var(--card); outline: 2px solid var(--link); }
svg rect { fill: var(--card); stroke: var(--line); }
svg rect.own { stroke: var(--link); stroke-width: 2; }
svg path { fill: none; stroke: var(--soft); }
svg text { fill: var(--text); text-anchor: middle; font-size: 12px; }
svg a text { fill: var(--link); }
"""

SEARCH = """\
"use strict";
// INDEX holds [name, page, what it is for]; text is set as text, never as HTML.
const field = document.getElementById("search");
const found = document.getElementById("found");
const root = document.body.dataset.root;

// The smaller, the better: all words in the name before words in what it is for.
function rank([name, , about], words) {
  const text = name.toLowerCase();
  if (!words.every((word) => text.includes(word))) {
    const all = `${text} ${about.toLowerCase()}`;
    return words.every((word) => all.includes(word)) ? 3 + text.length / 1000 : -1;
  }
  const last = text.split(/[/.]/).pop();
  return (last === words[0] ? 0 : last.startsWith(words[0]) ? 1 : 2) + text.length / 1000;
}

function line([name, page, about]) {
  const item = document.createElement("li");
  const link = document.createElement("a");
  const note = document.createElement("small");
  link.href = root + page;
  link.textContent = name;
  note.textContent = about;
  item.append(link, note);
  return item;
}

function search() {
  const words = field.value.toLowerCase().split(/\\s+/).filter(Boolean);
  const hits = INDEX
    .map((entry) => [words.length === 0 ? -1 : rank(entry, words), entry])
    .filter(([place]) => place >= 0)
    .sort(([one], [other]) => one - other)
    .slice(0, 20);
  found.replaceChildren(...hits.map(([, entry]) => line(entry)));
  found.className = hits.length === 0 ? "none" : "";
  if (hits.length === 0) {
    const item = document.createElement("li");
    item.textContent = "Nothing found: no name and no comment has all these words.";
    found.append(item);
  }
  found.hidden = words.length === 0;
}

field.addEventListener("input", search);
field.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && found.querySelector("a")) found.querySelector("a").click();
});
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== field) {
    event.preventDefault();
    field.focus();
  }
});
"""
