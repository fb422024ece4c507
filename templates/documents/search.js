"use strict";
// INDEX, which comes when somebody wants to search, has [name, page, what it is for, what is in it]
// of packages and interfaces. Text is set as text, never as HTML.
const field = document.getElementById("search");
const found = document.getElementById("found");
const root = document.body.dataset.root;
let entries = null;
let asked = false;

function load() {
  if (asked) return;
  asked = true;
  const script = document.createElement("script");
  script.src = `${root}index.js`;
  script.addEventListener("load", () => {
    entries = INDEX.flatMap(([name, page, about, items]) => [
      [name, page, about],
      ...items.map(([item, note]) => [name + item, `${page}#${item.slice(1)}`, note]),
    ]);
    search();
  });
  document.head.append(script);
}

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
  if (entries === null) return;
  const words = field.value.toLowerCase().split(/\s+/).filter(Boolean);
  const hits = entries
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

field.addEventListener("focus", load);
field.addEventListener("input", () => {
  load();
  search();
});
field.addEventListener("keydown", (event) => {
  if (event.key === "Enter" && found.querySelector("a")) found.querySelector("a").click();
});
document.addEventListener("keydown", (event) => {
  if (event.key === "/" && document.activeElement !== field) {
    event.preventDefault();
    field.focus();
  }
});
