// What is drawn: figures of the plotting library in the look of the report.
const INK = "#1f2933", TICKS = "#6b6b6b", FAINT = "#e4e4e4";
export const COLORS = ["#0b5fa5", "#d1761a", "#2e7d4f", "#7a4fa0", "#b3261e", "#4a6b8a"];
const MARKS = { error: "#b3261e", warning: "#d1761a", remark: "#8b96a1" };
const MARKERS = { o: "circle", s: "square", "^": "triangle", v: "inverted_triangle", D: "diamond", "|": "dash", x: "x" };
const P = Bokeh.Plotting;
function styled(figure) {
  for (const axis of figure.axes) {
    axis.setv({ axis_line_color: TICKS, major_tick_line_color: TICKS, minor_tick_line_color: TICKS, major_label_text_color: INK,
      major_label_text_font_size: "11px", axis_label_text_color: INK, axis_label_text_font_size: "12px", axis_label_text_font_style: "normal",
      major_label_text_font: "DejaVu Sans", axis_label_text_font: "DejaVu Sans", major_tick_in: 0 });
  }
  for (const grid of figure.grids) grid.grid_line_color = FAINT;
  figure.outline_line_color = null;
  return figure;
}
function figure({ height, x, y, tools, x_range, y_range, active_drag = null }) {
  const made = P.figure({
    height, sizing_mode: "stretch_width", tools, active_drag, active_scroll: tools.includes("wheel") ? undefined : null,
    x_axis_type: x.log ? "log" : "linear", y_axis_type: y.log ? "log" : "linear",
    x_axis_label: x.label || null, y_axis_label: y.label || null, ...(x_range ? { x_range } : {}), ...(y_range ? { y_range } : {}),
    toolbar_location: null, min_border_right: 12, lod_threshold: null, background_fill_color: "white", border_fill_color: "white",
  });
  return styled(made);
}
async function show(figure, place) { place.replaceChildren(); await P.show(figure, place); }
// ---- the trace -----------------------------------------------------------------------------
export class Trace {
  // One panel a channel, all of one time axis; `ask(start, stop, pixels)` gives what is drawn.
  constructor(place, { ask, moved, chosen }) { Object.assign(this, { place, ask, moved, chosen, panels: [], latest: 0, drawn: 0 }); }
  async open(facts) {
    this.duration = facts.duration;
    this.range = new Bokeh.Range1d({ start: 0, end: facts.duration });
    const pixels = (this.pixels = Math.max(300, Math.min(2400, this.place.clientWidth - 60)));
    this.facts = facts;
    const first = await this.ask(0, facts.duration, pixels);
    if (this.facts !== facts) return;
    this.place.replaceChildren();
    this.panels = first.map((channel, number) => this.panel(channel, number, number === first.length - 1));
    this.draw(first);
    // One document, since the panels share the range of time.
    await P.show(new Bokeh.Column({ children: this.panels.map((one) => one.figure), sizing_mode: "stretch_width", spacing: 0 }), this.place);
    for (const name of ["start", "end"]) this.range.properties[name].change.connect(() => this.later());
  }
  panel(channel, number, last) {
    const source = new Bokeh.ColumnDataSource({ data: { x: [], y: [] } });
    const wheel = new Bokeh.WheelZoomTool({ dimensions: "width", maintain_focus: false });
    const pan = new Bokeh.PanTool({ dimensions: "width" });
    const select = new Bokeh.BoxSelectTool({ dimensions: "width" });
    const unit = channel.unit || "as written";
    const made = P.figure({
      height: last ? 158 : 118, sizing_mode: "stretch_width", tools: [wheel, pan, select], toolbar_location: null, x_range: this.range,
      y_range: new Bokeh.DataRange1d({ range_padding: 0.06, only_visible: true }),
      x_axis_label: last ? ("rate" in this.facts.lacking ? "sample" : "time (s)") : null, y_axis_label: `${channel.name} (${unit})`, min_border_left: 84, min_border_right: 12, lod_threshold: null,
    });
    styled(made);
    made.toolbar.active_scroll = wheel;
    made.toolbar.active_drag = pan;
    if (!last) made.xaxes[0].visible = false;
    const color = channel.of === "table" ? "#8b96a1" : COLORS[number % COLORS.length];
    made.line({ field: "x" }, { field: "y" }, { source, line_color: color, line_width: 1 });
    made.on_event("selectiongeometry", (event) => { if (event.final && event.geometry.type === "rect") this.chosen(event.geometry.x0, event.geometry.x1); });
    return { name: channel.name, figure: made, source, pan, select };
  }
  choosing(on) { for (const one of this.panels) one.figure.toolbar.active_drag = on ? one.select : one.pan; for (const one of this.panels) { one.select.active = on; one.pan.active = !on; } }
  draw(channels) {
    channels.forEach((channel, number) => {
      const x = [], y = [];
      for (let place = 0; place < channel.time.length; place++) {
        const low = channel.low[place] ?? NaN, high = channel.high[place] ?? NaN;
        x.push(channel.time[place]); y.push(low);
        if (high !== low) { x.push(channel.time[place]); y.push(high); }
      }
      this.panels[number].source.data = { x, y };
    });
    this.drawn++;
    this.place.dataset.drawn = this.drawn;
  }
  later() {
    if (this.waiting) { this.dirty = true; return; }
    this.waiting = true;
    requestAnimationFrame(async () => {
      const { start, end } = this.range, width = end - start, number = ++this.latest;
      const began = performance.now();
      try {
        // A margin on either side, so that what is moved into view is there already.
        const found = await this.ask(start - 0.25 * width, end + 0.25 * width, Math.round(1.5 * this.pixels));
        if (number === this.latest) { this.draw(found); this.moved(start, end); }
      } catch (error) { console.warn(String(error)); }
      this.place.dataset.latency = (performance.now() - began).toFixed(1);
      this.waiting = false;
      if (this.dirty) { this.dirty = false; this.later(); }
    });
  }
  zoom(start, stop) { this.range.setv({ start: Math.max(0, start), end: Math.min(this.duration, stop) }); }
  mark(findings, offset) {
    for (const one of this.panels) {
      const marks = [];
      for (const note of findings) for (const [from, to] of note.spans) {
        if (note.channel && !note.channel.split(", ").includes(one.name) && note.channel !== "time") continue;
        const color = MARKS[note.level], start = from - offset, stop = to - offset;
        marks.push(stop > start
          ? new Bokeh.BoxAnnotation({ left: start, right: stop, fill_color: color, fill_alpha: 0.15, line_color: null })
          : new Bokeh.Span({ location: start, dimension: "height", line_color: color, line_width: 1.2, line_dash: [4, 3] }));
      }
      // All at once: added one by one, some are drawn before they are built.
      if (marks.length) one.figure.center = [...one.figure.center, ...marks];
    }
  }
}
// ---- figures of a recording -----------------------------------------------------------------
export async function rawSpectrum(place, spectra) {
  const found = spectra.filter((one) => one.frequency.length && one.of === "gyro");
  if (!found.length) return;
  const unit = found[0].unit || "as written";
  const made = figure({ height: 300, x: { log: true, label: "frequency (Hz)" }, y: { log: true, label: `density (${unit}/√Hz)` }, tools: "pan,wheel_zoom,reset" });
  found.forEach((one, number) => {
    made.varea({ x: one.frequency, y1: one.low, y2: one.high, fill_color: COLORS[number % COLORS.length], fill_alpha: 0.35 });
    made.line(one.frequency, one.high, { line_color: COLORS[number % COLORS.length], line_width: 1, legend_label: one.name });
  });
  await show(legend(made), place);
}
export async function histogram(place, counts) {
  const made = figure({ height: 300, x: { label: "away from the mean, standard deviations" }, y: { label: "share of samples per deviation" }, tools: "pan,wheel_zoom,reset", x_range: new Bokeh.Range1d({ start: -6, end: 6 }) });
  counts.filter((one) => one.count.length).forEach((one, number) => {
    const total = one.count.reduce((a, b) => a + b, 0);
    const middle = one.count.map((_, k) => 0.5 * (one.edge[k] + one.edge[k + 1]));
    const mean = middle.reduce((sum, v, k) => sum + v * one.count[k], 0) / total;
    const sigma = Math.sqrt(middle.reduce((sum, v, k) => sum + (v - mean) ** 2 * one.count[k], 0) / total) || 1;
    const width = (one.edge[1] - one.edge[0]) / sigma;
    made.step({ x: middle.map((v) => (v - mean) / sigma), y: one.count.map((n) => n / total / width), mode: "center", line_color: COLORS[number % COLORS.length], line_width: 1.2, legend_label: one.name });
  });
  const x = Array.from({ length: 121 }, (_, k) => -6 + 0.1 * k);
  made.line(x, x.map((v) => Math.exp(-0.5 * v * v) / Math.sqrt(2 * Math.PI)), { line_color: INK, line_width: 1, line_dash: [5, 3], legend_label: "normal" });
  await show(legend(made), place);
}
function legend(made) {
  made.legend.setv({ border_line_color: null, background_fill_alpha: 0.75, label_text_font_size: "11px", label_text_font: "DejaVu Sans", label_text_color: INK, padding: 2, spacing: 8, margin: 0, glyph_height: 14, label_height: 14, orientation: "horizontal", ncols: Math.max(1, Math.min(3, Math.floor(window.innerWidth / 300))) });
  // Above the figure, so that it hides no curve.
  const one = made.center.find((each) => each instanceof Bokeh.Legend);
  if (one) { made.center = made.center.filter((each) => each !== one); made.add_layout(one, "above"); }
  return made;
}
// ---- figures of an analysis ------------------------------------------------------------------
export async function drawn(place, data, { height = 360, selected = null, over = [] } = {}) {
  if (!data) { place.textContent = "the recording does not show it"; place.className = "small"; return null; }
  place.className = "";
  const range = (one) => new Bokeh.Range1d({ start: one.range[0], end: one.range[1] });
  const made = figure({ height, x: data.x, y: data.y, tools: selected ? "wheel_zoom,pan,reset,xbox_select" : "wheel_zoom,pan,reset", x_range: range(data.x), y_range: range(data.y) });
  for (const one of data.bands) made.patch(one.x, one.y, { fill_color: one.color, fill_alpha: one.alpha, line_color: null, ...(one.label ? { legend_label: one.label } : {}) });
  for (const one of data.lines) line(made, one);
  for (const one of over) line(made, one);
  for (const one of data.texts) if (one.x !== null && one.text) made.text({ x: [one.x], y: [one.y], text: [one.text], text_font_size: "11px", text_color: "#4a4a4a", y_offset: 14, text_align: "center" });
  if (selected) {
    const tool = made.toolbar.tools.find((one) => one instanceof Bokeh.BoxSelectTool);
    made.toolbar.active_drag = tool;
    made.on_event("selectiongeometry", (event) => { if (event.final) selected(event.geometry.x0, event.geometry.x1); });
  }
  await show(legend(made), place);
  place.dataset.lines = data.lines.length;
  return made;
}
function line(made, one) {
  const named = one.label ? { legend_label: one.label } : {};
  const y = one.y.map((v) => v ?? NaN);
  if (one.width > 0) made.line(one.x, y, { line_color: one.color, line_width: 1.1 * one.width, line_alpha: one.alpha, line_dash: one.dash ? [5, 3] : "solid", ...named });
  if (one.marker in MARKERS) made.scatter(one.x, y, { marker: MARKERS[one.marker], size: 1.5 * one.size, angle: one.marker === "|" ? Math.PI / 2 : 0, line_color: one.color, fill_color: one.color, ...named });
}
export function masks(made, bands) {
  made.center = [...made.center, ...bands.map(([low, high]) => new Bokeh.BoxAnnotation({ left: low, right: high, fill_color: "#b3261e", fill_alpha: 0.12, line_color: "#b3261e", line_alpha: 0.5 }))];
}
export async function together(place, runs) {
  // The curves of several runs over one another.
  if (runs.length < 2) { place.replaceChildren(); return; }
  const made = figure({ height: 320, x: { log: true, label: "cluster time τ (s)" }, y: { log: true, label: "Allan deviation (°/h, per gyro)" }, tools: "pan,wheel_zoom,reset" });
  runs.forEach((run, number) => {
    const color = COLORS[number % COLORS.length], { tau, deviation, low, high } = run.curve;
    made.varea({ x: tau, y1: low, y2: high, fill_color: color, fill_alpha: 0.15 });
    made.line(tau, deviation, { line_color: color, line_width: 1.2, line_dash: number < COLORS.length ? "solid" : [6, 4], legend_label: run.label });
    made.scatter(tau, deviation, { size: 4.5, fill_color: color, line_color: color, legend_label: run.label });
  });
  await show(legend(made), place);
}
