// The page: asks the server, shows what it answers, and keeps what was clicked.

import { Trace, rawSpectrum, histogram, drawn, masks, together } from "./plots.js";

const $ = (id) => document.getElementById(id);
const PAGE = Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, "0")).join("");
const READING = [
  ["columns", "x=NAME,z=NAME"], ["gyros", "x,z"], ["kind", "angle, increment, rate", ["rate", "increment", "angle"]],
  ["unit", "deg/s", ["deg/s", "deg/h", "rad/s", "arcsec", "deg", "rad", "counts"]], ["scale", "0.1arcsec"], ["rate", "samples a second"],
  ["time", "COLUMN:UNIT"], ["table", "COLUMN:UNIT"], ["accelerometers", "ax,ay,az"], ["slice", "START:STOP, s"],
  ["null_pulse", "COLUMN"], ["counter_bits", ""], ["counter_period", ""], ["layout", "preset or TOML"],
];
const ANALYSIS = [
  ["method", "fos", ["fos", "fos-paper", "fos-korenberg", "fris", "none"]], ["interval", "s; every sample"], ["confidence", "0.95"],
  ["spec", "3e-4deg/sqrt(h)"], ["accept", "clipping"], ["covariates", "temperature"],
];
const state = { path: "", facts: null, look: null, runs: new Map(), current: null, channel: 0, off: new Set(), bands: [] };
// ---- asking ----------------------------------------------------------------------------------
async function call(name, asked = {}) {
  let answer;
  try {
    const response = await fetch(`call/${name}`, { method: "POST", headers: { "Content-Type": "application/json", "X-Page": PAGE }, body: JSON.stringify(asked) });
    if (!response.ok) throw new Error(`refused: ${await response.text()}`);
    answer = await response.json();
  } catch (error) {
    throw error instanceof TypeError ? new Error("the server does not answer; is sagnac app still running?") : error;
  }
  if (answer.error) throw new Error(answer.error);
  return answer;
}
function say(text) { $("message").textContent = text; $("message").hidden = !text; }
async function trying(what, work) {
  $("busy").textContent = what; $("busy").hidden = false;
  try { say(""); return await work(); } catch (error) { say(error.message); return null; } finally { $("busy").hidden = true; }
}
function listen() {
  const events = new EventSource(`events?page=${PAGE}`);
  let lost = false;
  events.onopen = () => { document.body.dataset.live = "yes"; if (lost) { lost = false; say(""); } };
  events.onerror = () => { document.body.dataset.live = "no"; lost = true; if (state.facts) say("the server does not answer; the page comes back when it does"); };
  events.onmessage = (message) => happened(JSON.parse(message.data));
}
addEventListener("pagehide", (event) => { if (!event.persisted) navigator.sendBeacon(`call/bye?page=${PAGE}`, JSON.stringify({ left: PAGE })); });
// ---- small parts of the page -------------------------------------------------------------------
function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}
const row = (...cells) => element("tr", {}, ...cells.map((cell) => (cell instanceof Node ? element("td", {}, cell) : element("td", { textContent: cell ?? "" }))));
const head = (...cells) => element("tr", {}, ...cells.map((cell) => element("th", { textContent: cell })));
const answers = (channel) => [...Object.entries(channel.of_each), [channel.name, channel.answer.text]].map(([name, text]) => `${name}  ${text}`).join("\n");
const digits = (value, count = 4) => (value === null || value === undefined ? "–" : String(Number(Number(value).toPrecision(count))));
function form(place, fields, changed) {
  place.replaceChildren(...fields.map(([name, hint, choices]) => {
    const input = element("input", { name, placeholder: hint, title: hint, autocomplete: "off", spellcheck: false });
    const made = element("label", {}, name.replace("_", " "), input);
    if (choices) {
      const list = element("datalist", { id: `${place.id}-${name}` }, ...choices.map((value) => element("option", { value })));
      input.setAttribute("list", list.id);
      made.append(list);
    }
    input.addEventListener("change", changed);
    return made;
  }));
}
const texts = (place) => Object.fromEntries([...place.querySelectorAll("input")].map((one) => [one.name, one.value.trim()]).filter(([, text]) => text));
function fill(place, values) {
  for (const one of place.querySelectorAll("input")) { if (one !== document.activeElement) one.value = values[one.name] ?? ""; one.parentElement.className = ""; one.placeholder = one.title; }
}
function notes(place, found, empty) {
  place.replaceChildren(...found.map((note) => {
    const made = element("li", { className: note.level, textContent: note.text });
    if (note.spans.length) {
      made.classList.add("place");
      made.title = "show it on the trace";
      made.addEventListener("click", () => near(note.spans[0]));
    }
    return made;
  }));
  if (!found.length) place.append(element("li", { textContent: empty }));
}
// ---- files --------------------------------------------------------------------------------------
function listed(found) {
  $("folder").textContent = found.folder === "." ? found.root : `${found.root}/${found.folder}`;
  const inside = (name) => (found.folder === "." ? name : `${found.folder}/${name}`);
  const entries = found.folder === "." ? [] : [{ name: "..", kind: "up" }];
  $("listing").replaceChildren(...[...entries, ...found.entries].map((one) => {
    const size = one.kind === "file" ? (one.size > 1e6 ? `${(one.size / 1e6).toFixed(0)} MB` : one.size ? `${Math.ceil(one.size / 1e3)} kB` : "") : one.kind === "up" ? "" : one.kind;
    const button = element("button", { type: "button" }, element("span", { textContent: one.name }), element("span", { className: "size", textContent: size }));
    button.addEventListener("click", () => {
      if (one.kind === "file") open(inside(one.name), {});
      else if (one.kind === "campaign") campaign(inside(one.name));
      else list(one.kind === "up" ? found.folder.split("/").slice(0, -1).join("/") || "." : inside(one.name));
    });
    return element("li", {}, button);
  }));
  if (found.left_out) $("listing").append(element("li", { className: "small", textContent: `and ${found.left_out} more` }));
}
const list = (folder) => trying("list", async () => listed(await call("list", { folder })));
async function campaign(folder) {
  await trying("open", async () => {
    const found = await call("campaign", { folder });
    $("campaign").hidden = false;
    $("campaign-name").textContent = folder;
    $("campaign-table").replaceChildren(head(...found.head), ...found.rows.map((cells) => row(...cells)));
    if (found.left_out) $("campaign-table").append(row(`and ${found.left_out} more`));
    $("campaign").scrollIntoView();
  });
}
async function drop(file) {
  await trying(`take ${file.name}`, async () => {
    const response = await fetch(`drop?name=${encodeURIComponent(file.name)}`, { method: "POST", headers: { "X-Page": PAGE }, body: file });
    if (!response.ok) throw new Error(`${file.name}: ${await response.text()}`);
    await open((await response.json()).path, {});
  });
}
// ---- a recording ---------------------------------------------------------------------------------
const trace = new Trace($("trace"), {
  ask: async (start, stop, pixels) => (await call("window", { look: state.look, start, stop, pixels })).channels,
  moved: (start, stop) => { $("window-text").textContent = `${digits(start, 6)} s to ${digits(stop, 6)} s`; },
  chosen: (start, stop) => {
    const offset = offsetOf();
    const text = `${Math.max(0, start + offset).toFixed(3)}:${(Math.min(stop, state.facts.duration) + offset).toFixed(3)}`;
    $("reading-form").querySelector("[name=slice]").value = text;
    trace.choosing(false);
    reread();
  },
});
const offsetOf = () => Number((state.facts?.texts.slice || "").split(":")[0]) || 0;
function near([from, to]) {
  const offset = offsetOf(), half = Math.max(2 * (to - from), 0.01 * state.facts.duration, 20 / state.facts.rate);
  trace.zoom(0.5 * (from + to) - offset - half, 0.5 * (from + to) - offset + half);
  $("recording").scrollIntoView();
}
async function open(path, stated) {
  const opened = await trying("read", async () => {
    const began = performance.now();
    // A file that says too little of itself is stated in the form, whether or not it can be drawn.
    // What is shown of another file, or of an earlier statement, is not analyzed by mistake.
    if (path !== state.path) { $("recording").hidden = true; if (!state.running) $("stage").textContent = ""; }
    $("lacking").hidden = $("analysis").hidden = true; $("facts").textContent = "";
    state.path = path; $("reading").hidden = false; $("name").textContent = path.split("/").pop();
    if (!Object.keys(stated).length) fill($("reading-form"), {});
    const number = (state.opens = (state.opens ?? 0) + 1), facts = await call("open", { path, texts: stated }).catch((error) => { if (number === state.opens) throw error; });
    // Several fields may be stated before the first of them is read: only the latest counts, be it refused or not.
    if (number !== state.opens) return;
    Object.assign(state, { facts, look: facts.look }); $("recording").hidden = false; $("analysis").hidden = facts.raw;
    $("path").value = path; document.title = `${facts.name} · sagnac`;
    $("facts").textContent = facts.raw ? `${facts.samples} samples; kind, unit or rate not stated` : `${facts.samples} samples, ${digits(facts.rate, 6)} Hz, ${digits(facts.duration, 6)} s, ${facts.format}`;
    asked(facts);
    $("window-text").textContent = facts.raw ? "numbers as they are written, until it is stated what they are" : "";
    await trace.open(facts);
    document.body.dataset.first = (performance.now() - began).toFixed(0);
    beside(facts);
    repeat();
    return number === state.opens;
  });
  if (opened) look();
}
function asked(facts) {
  const place = $("reading-form");
  fill(place, { ...facts.lacking, ...facts.texts });
  for (const name of Object.keys(facts.lacking)) {
    const input = place.querySelector(`[name=${name}]`);
    input.parentElement.className = "asked";
    // What no file tells is for the reader to say.
    if (["KIND", "UNIT", "HZ", "SIZE"].includes(input.value)) { input.placeholder = "to be stated"; input.value = ""; }
  }
  $("lacking").textContent = facts.refusal;
  $("lacking").hidden = !facts.raw;
  $("columns").textContent = facts.columns.join(", ");
}
async function look() {
  const number = state.look; delete $("findings").dataset.done;
  const failed = (error) => { if (number === state.look) notes($("findings"), [{ level: "error", text: error.message, spans: [] }], ""); };
  const found = await call("spectra", { look: number }).catch(failed);
  if (!found || number !== state.look) return;
  await rawSpectrum($("raw-spectrum"), found.spectra);
  await histogram($("histogram"), found.histograms);
  notes($("findings"), [], "looking …");
  const checked = await call("check", { look: number }).catch(failed);
  if (!checked || number !== state.look) return;
  notes($("findings"), checked.findings, state.facts.raw ? "nothing is checked before it is stated what the numbers are" : "nothing");
  trace.mark(checked.findings, offsetOf());
  $("findings").dataset.done = "yes";
}
function beside(facts) {
  const rows = facts.channels.map((one) => row(`${one.name}: mean`, `${digits(one.mean)} ${one.unit}`, `deviation ${digits(one.deviation)} ${one.unit}`, ""));
  for (const one of facts.beside) rows.push(row(one.what, one.found, one.wanted, element("span", { className: one.verdict, textContent: one.verdict })));
  for (const one of facts.notes) rows.push(element("tr", {}, element("td", { colSpan: 4, textContent: one })));
  $("beside").replaceChildren(...rows);
}
const reread = () => open(state.path, texts($("reading-form")));
// ---- runs -----------------------------------------------------------------------------------------
async function run() {
  await trying("start", async () => {
    const analysis = texts($("analysis-form"));
    const { run: number } = await call("analyze", { look: state.look, path: state.facts.path, texts: state.facts.texts, analysis });
    const { slice, gyros } = state.facts.texts, chosen = Object.entries({ slice, gyros, ...analysis }).filter(([name, text]) => name !== "method" && text);
    const changed = chosen.map(([name, text]) => `${name} ${text}`).join(", ");
    state.runs.set(number, { number, place: (state.started = (state.started ?? 0) + 1), file: state.facts.name, path: state.facts.path, texts: state.facts.texts, analysis, method: analysis.method || "fos", changed, stage: "start", fraction: 0 });
    running(number);
    runs();
  });
}
function running(number) {
  const one = state.runs.get(number);
  const busy = one && !one.result && !one.failed;
  state.running = busy ? number : null;
  for (const id of ["cancel", "progress"]) $(id).hidden = !busy;
  $("stage").textContent = busy ? one.stage : one?.failed ? "" : $("stage").textContent;
  if (busy) $("progress").value = one.fraction;
  $("run").disabled = Boolean(busy);
}
async function cancel() {
  const number = state.running;
  if (!number) return;
  await trying("cancel", () => call("cancel", { run: number }));
  state.runs.delete(number);
  running(null);
  $("stage").textContent = "cancelled";
  runs();
}
function happened(event) {
  const one = state.runs.get(event.run);
  if (!one) return;
  if (event.event === "progress") {
    Object.assign(one, { stage: event.stage, fraction: event.fraction });
    if (state.running === event.run) running(event.run);
  } else if (event.event === "done") {
    if (one.result) return;
    one.result = event.result;
    running(event.run);
    const seconds = Object.values(event.result.seconds).reduce((a, b) => a + b, 0);
    $("stage").textContent = `done in ${digits(seconds, 3)} s`;
    runs();
    shown(event.run);
  } else if (event.event === "failed") {
    if (one.result) { say(event.line); return; }
    one.failed = event.line;
    running(event.run);
    say(event.line);
    runs();
  } else if (event.event === "verdict") {
    one.result.verdict = event.verdict;
    verdict(one);
  } else if (event.event === "saved") {
    $("saved").textContent = `written: ${event.path}`;
  } else if (event.event === "trial" && event.run === state.current) tried(event);
}
function runs() {
  $("results").hidden = !state.runs.size;
  const rows = [...state.runs.values()].map((one) => {
    const said = one.result ? [...one.result.channels.filter((c) => c.sensor === "gyro").map(answers), ...one.result.refused].join("\n") : one.failed || `${one.stage} …`;
    const show = element("button", { textContent: "show", disabled: !one.result, type: "button" });
    show.addEventListener("click", () => shown(one.number));
    const decision = one.result?.verdict.length ? one.result.verdict.map((v) => `${v.gyro} ${v.decision}`).join(", ") : "";
    const made = row(String(one.place), one.file, one.method, one.changed, element("span", { textContent: said, style: "white-space: pre-line" }), one.result ? String(one.result.channels.reduce((sum, c) => sum + c.lines.length, 0)) : "", decision, show);
    if (one.number === state.current) made.className = "chosen";
    return made;
  });
  $("runs").replaceChildren(head("", "recording", "method", "choices", "N", "lines", "verdict", ""), ...rows);
  const done = [...state.runs.values()].filter((one) => one.result).map((one) => one.number).join();
  if (done === state.drawn) return;
  state.drawn = done;
  const curves = [...state.runs.values()].filter((one) => one.result).flatMap((one) => one.result.channels.filter((c) => c.sensor === "gyro").map((c) => ({ label: `${one.place}: ${one.file} ${c.name} ${one.method}`, curve: c.curve })));
  together($("together"), curves);
}
// ---- a result -----------------------------------------------------------------------------------------
async function shown(number) {
  Object.assign(state, { current: number, channel: 0 });
  runs();
  const one = state.runs.get(number);
  $("result").hidden = false;
  $("result-name").textContent = `${one.file}, ${one.method}`;
  $("tabs").replaceChildren(...one.result.channels.map((channel, place) => {
    const button = element("button", { textContent: channel.name, type: "button" });
    button.addEventListener("click", () => { state.channel = place; channelShown(); });
    return button;
  }));
  verdict(one);
  notes($("notes"), one.result.notes, "none");
  for (const line of one.result.refused) $("notes").prepend(element("li", { className: "error", textContent: line }));
  $("target").value = `${one.file.replace(/\.[^.]*$/, "")} report`;
  await channelShown();
}
async function channelShown() {
  const channel = current();
  state.off = new Set();
  state.bands = [];
  [...$("tabs").children].forEach((button, place) => { button.className = place === state.channel ? "chosen" : ""; });
  $("answer").textContent = `N of ${channel.name}: ${channel.answer.text}` + (channel.answer.status !== "not observable" ? `, ${Number((100 * channel.answer.confidence).toPrecision(12))} %` : "");
  $("source").textContent = `Rests on: ${channel.source}`;
  $("coefficients").replaceChildren(head("coefficient", "value", "low", "high", "unit", ""), ...Object.entries(channel.coefficients).map(([name, one]) => row(name.replaceAll("_", " "), ...(one.status === "estimated" ? [one.value, one.low, one.high].map((value) => digits(value)) : [one.status === "upper bound" ? `< ${digits(one.high)}` : "–", "", ""]), one.unit, one.status)));
  lines(); bands(); $("trial").hidden = true; repeat(state.runs.get(state.current));
  const figures = channel.figures;
  await drawn($("stability"), figures.stability);
  await spectrum();
  for (const name of ["parts", "residual", "angle", "orders"]) {
    $(name).parentElement.hidden = !figures[name];
    if (figures[name]) await drawn($(name), figures[name], { height: 280 });
  }
  document.body.dataset.shown = `${state.current}:${state.channel}`;
}
const change = () => (state.bands.length || state.off.size ? { channel: state.channel, off: [...state.off], bands: state.bands } : null);
const current = () => state.runs.get(state.current).result.channels[state.channel];
async function spectrum(figure = current().figures.spectrum) {
  const made = await drawn($("spectrum"), figure, { height: 380, selected: (low, high) => { state.bands.push([low, high]); changed(); } });
  if (made) masks(made, state.bands);
}
function verdict(one) {
  $("verdict").replaceChildren(...one.result.verdict.map((v) => element("li", {}, element("span", { className: v.decision, textContent: `${v.gyro}: ${v.decision}` }), ` (${v.reason})`)));
}
function lines() {
  const found = current().lines;
  const rows = found.slice(0, 200).map((one, place) => {
    const box = element("input", { type: "checkbox", checked: !state.off.has(place), disabled: one.channel !== current().name, title: "taken out", ariaLabel: `${digits(one.frequency, 7)} ${one.scale === "time" ? "Hz" : "order"} taken out` });
    box.addEventListener("change", () => { if (box.checked) state.off.delete(place); else state.off.add(place); changed(); });
    const made = row(box, one.scale === "time" ? `${digits(one.frequency, 7)} Hz` : `order ${digits(one.frequency, 7)} (${digits(one.hz, 5)} Hz)`, `${digits(one.amplitude)} ± ${digits(one.error, 2)}${one.unit}`, one.name);
    if (state.off.has(place)) made.className = "off";
    return made;
  });
  $("lines").replaceChildren(head("out", "line", "amplitude", ""), ...rows);
  if (!found.length) $("lines").replaceChildren(row("none stands above the noise"));
}
function bands() {
  $("bands").replaceChildren(...state.bands.map((one, place) => {
    const button = element("button", { textContent: "take back", className: "link", type: "button" });
    button.addEventListener("click", () => { state.bands.splice(place, 1); changed(); });
    return element("li", {}, `${digits(one[0])} Hz to ${digits(one[1])} Hz `, button);
  }));
  if (!state.bands.length) $("bands").append(element("li", { textContent: "none" }));
}
async function changed() {
  // Asked at once; what the process answers is drawn if nothing was clicked since.
  lines(); bands();
  if (!change()) return channelShown();
  state.asked = performance.now();
  // What the server refuses is not left ticked as if it had been done.
  if (!(await trying("try", () => call("ask", { run: state.current, request: { ask: "trial", ...change() } })))) return channelShown();
}
async function tried(event) {
  const { off, bands: masked, channel } = event.asked;
  if (channel !== state.channel || JSON.stringify([off, masked]) !== JSON.stringify([[...state.off], state.bands])) return;
  const away = 100 * (event.ratio - 1);
  $("trial").hidden = false;
  $("trial").textContent = `At once, by the levels of the spectrum: N ${event.before.text} becomes ${event.after.text}` + (Number.isFinite(away) ? `, ${away >= 0 ? "+" : ""}${away.toFixed(1)} %` : "");
  $("trial").dataset.latency = (performance.now() - state.asked).toFixed(0);
  await drawn($("stability"), event.figures.stability);
  await spectrum(event.figures.spectrum);
  $("trial").dataset.drawn = (performance.now() - state.asked).toFixed(0);
  repeat(state.runs.get(state.current), event.asked);
}
// ---- repeating -------------------------------------------------------------------------------------------
async function repeat(one = null, changed = null) {
  if (state.facts.raw) { $("repeat").hidden = true; return; }
  const asked = one ? { path: one.path, texts: one.texts, analysis: one.analysis } : { path: state.facts.path, texts: state.facts.texts, analysis: texts($("analysis-form")) };
  const number = (state.repeats = (state.repeats ?? 0) + 1);
  const found = await call("repeat", { ...asked, changed }).catch((error) => say(error.message));
  if (!found || number !== state.repeats) return;
  $("repeat").hidden = false;
  for (const name of ["command", "script", "toml"]) $(name).textContent = found[name] || "(nothing is stated)";
}
function save(what) {
  const target = $("target").value.trim() + { report: "", json: ".json", toml: ".toml" }[what];
  return trying("save", async () => {
    if (!state.current) throw new Error("analyze a recording first");
    $("saved").textContent = "";
    await call("ask", { run: state.current, request: { ask: "save", what, target, changed: change() } });
  });
}
// ---- at the start --------------------------------------------------------------------------------------------
form($("reading-form"), READING, reread);
form($("analysis-form"), ANALYSIS, (event) => {
  if (event.target.name === "spec" && state.current && event.target.value.trim()) trying("judge", () => call("ask", { run: state.current, request: { ask: "verdict", spec: event.target.value.trim() } }));
  repeat();
});
$("reading-form").addEventListener("submit", (event) => { event.preventDefault(); reread(); });
$("analysis-form").addEventListener("submit", (event) => event.preventDefault());
$("open-form").addEventListener("submit", (event) => { event.preventDefault(); open($("path").value.trim(), {}); });
$("choose").addEventListener("click", () => { trace.choosing(true); $("window-text").textContent = "drag over the trace to take that span"; });
$("whole").addEventListener("click", () => { trace.zoom(0, state.facts.duration); if (texts($("reading-form")).slice) { $("reading-form").querySelector("[name=slice]").value = ""; reread(); } });
$("run").addEventListener("click", () => run());
$("cancel").addEventListener("click", cancel);
for (const what of ["report", "json", "toml"]) $(`save-${what}`).addEventListener("click", () => save(what));
for (const [name, over] of [["dragover", true], ["dragleave", false], ["drop", false]]) {
  addEventListener(name, (event) => {
    event.preventDefault();
    $("drop").classList.toggle("over", over);
    if (name === "drop" && event.dataTransfer.files.length) drop(event.dataTransfer.files[0]);
  });
}
listen();
trying("start", async () => {
  const found = await call("start");
  listed(found);
  if (found.first) await open(found.first, {});
});
