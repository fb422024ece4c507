"use strict";
// The theme's search wants every word of a question, as it is typed, and starts a worker, which browsers
// refuse to a page that was opened from a folder. Here a question loses its small words and its endings;
// after what has all the others comes what has some of them; and from a folder the worker's script runs
// in a frame.
const ENOUGH = 8;
const MOST = 5;
const SMALL = new Set(`a an and are as at be by can could do does for from get has have how i in into is
  it its may me my not of on or our should so some that the their there this to was we what when where which who
  why will with would you your`.split(/\s+/));

class FrameWorker {
  constructor(address) {
    this.frame = document.createElement("iframe");
    this.frame.hidden = true;
    this.waiting = [];
    document.body.append(this.frame);
    const inside = this.frame.contentWindow;
    inside.postMessage = (data) => setTimeout(() => this.onmessage?.({ data }));
    const script = inside.document.createElement("script");
    script.onload = () => {
      this.deliver = (data) => setTimeout(() => inside.onmessage({ data }));
      this.waiting.splice(0).forEach(this.deliver);
    };
    script.onerror = (event) => this.onerror?.(event);
    script.src = address;
    inside.document.body.append(script);
  }

  postMessage(data) {
    if (this.deliver) this.deliver(data);
    else this.waiting.push(data);
  }

  terminate() {
    this.frame.remove();
  }
}

// The engine finds what begins with a word: without its ending it finds the other forms, too.
function stem(word) {
  return word.replace(/(?<=\w{5})(?:ing|ed|es|s)$/, "");
}

// Two answers as one.
function joined(first, second) {
  const known = new Set(first.items.map(({ id }) => id));
  const items = [...first.items, ...second.items.filter(({ id }) => !known.has(id))];
  return { ...first, items };
}

// Messages of the theme: 0 has the index, 2 a query; 3 is its answer.
const Inner = location.protocol === "file:" ? FrameWorker : Worker;
window.Worker = class {
  constructor(address) {
    this.worker = new Inner(address);
    this.open = 0;
    this.worker.onmessage = (event) => this.answer(event);
    this.worker.onerror = (event) => this.onerror?.(event);
  }

  postMessage(message) {
    if (message.type === 0) {
      this.items = message.data.items;
      this.texts = this.items.map(({ title, text }) => `${title} ${text}`.toLowerCase());
    }
    if (typeof message.data?.input === "string") this.ask(message);
    else this.worker.postMessage(message);
  }

  ask(message) {
    const all = message.data.input.split(/[\s?]+/).filter(Boolean);
    const words = all.filter((word) => !SMALL.has(word.toLowerCase()));
    this.asked = message;
    this.queries = this.choices((words.length > 0 ? words : all).map(stem));
    this.found = null;
    this.send();
  }

  // The words, then all but one of them, and so on; rare words stay longest.
  choices(words) {
    const count = (word) => this.texts.filter((text) => text.includes(word.toLowerCase())).length;
    const counted = words.map((word) => [word, count(word)]);
    const rare = [...counted].sort(([, one], [, other]) => one - other).slice(0, MOST);
    const kept = counted.filter((one) => rare.includes(one));
    const sets = [...Array(2 ** kept.length).keys()].slice(1)
      .map((bits) => kept.filter((_, place) => bits & (1 << place)));
    const sum = (set) => set.reduce((all, [, one]) => all + one, 0);
    sets.sort((one, other) => other.length - one.length || sum(one) - sum(other));
    return [words, ...sets.map((set) => set.map(([word]) => word))];
  }

  send() {
    this.open += 1;
    const data = { ...this.asked.data, input: this.queries.shift()?.join(" ") ?? "" };
    this.worker.postMessage({ ...this.asked, data });
  }

  answer(event) {
    if (event.data.type !== 3) {
      this.onmessage?.(event);
      return;
    }
    this.open -= 1;
    if (this.open > 0) return; // something else was typed meanwhile
    this.found = this.found ? joined(this.found, event.data.data) : event.data.data;
    if (this.found.items.length < ENOUGH && this.queries.length > 0) {
      this.send();
    } else {
      this.deliver();
    }
  }

  deliver() {
    const pagination = { total: this.found.items.length }; // one page of results is enough
    this.onmessage?.({ data: { type: 3, data: { ...this.found, pagination } } });
  }

  terminate() {
    this.worker.terminate();
  }
};
