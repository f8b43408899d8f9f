// The page: sliders → design → figures and numbers, once for each frame.

import type { Baked } from "./baked";
import { Chart } from "./chart";
import { drawFigures, FIGURES, type View } from "./figures";
import { Palette, text } from "./plot";
import { drawScene } from "./scene";
import { shapeOf } from "./shape";
import { bounded, fromHash, type Key, keysOf, NOISE_IN, plain, type Slider, slidersOf, startOf, type State, toHash, toSpec } from "./state";
import { Design, spaced } from "./statistics";
import { Rig } from "./rig";

/** Drives of the curves over the drive, and distances of those over a. */
const DRIVES = 72;
const REACH = 72;

/** Milliseconds after the last change at which the address is written. */
const SETTLED = 250;

function element<T extends HTMLElement>(id: string): T {
  return document.getElementById(id) as T;
}

function evaluate(rig: Rig, state: State, grid: readonly number[]): View {
  const { D, d, L_a, x_ss, l, hub } = state;
  const whisker = { D, d, L_a, x_ss, l, hub: rig.drive === "angle" ? hub : 0 };
  const [from, to] = [Math.min(state.from, state.to), Math.max(state.from, state.to)];
  const distances = from < to ? spaced(from, to, state.distances) : [from];
  const design = new Design(rig, whisker, distances, state.noise);
  const contact = design.contact(state.a);
  const [near, far] = rig.baked.domain.a;
  return {
    state,
    design,
    contact,
    tap: contact.at(state.drive),
    rows: grid.map((drive) => design.at(drive)),
    row: design.at(state.drive),
    optimum: design.optimum(rig.baked.domain.drive, grid),
    reach: spaced(near, far, REACH).map((a) => design.contact(a)),
  };
}

class Page {
  private readonly rig: Rig;
  private readonly keys: readonly Slider[];
  private readonly sliders: readonly Slider[];
  private readonly start: State;
  private state: State;
  private view: View;
  private readonly grid: readonly number[];
  private readonly canvases: ReadonlyMap<string, HTMLCanvasElement>;
  private palette = new Palette();
  private waiting = false;
  private settling: number | undefined;
  /** What was asked for and is not allowed. */
  private refused = "";
  /** Milliseconds that each update took. */
  readonly times: number[] = [];

  constructor(private readonly baked: Baked) {
    this.rig = new Rig(baked, new Chart(baked));
    this.keys = keysOf(baked);
    this.sliders = slidersOf(baked);
    this.start = startOf(baked);
    this.state = fromHash(location.hash, this.start, this.keys);
    const [lo, hi] = baked.domain.drive;
    this.grid = Array.from({ length: DRIVES }, (_, i) => (i === DRIVES - 1 ? hi : lo * (hi / lo) ** (i / (DRIVES - 1))));
    this.view = evaluate(this.rig, this.state, this.grid);
    this.canvases = new Map(FIGURES.map((name) => [name, element<HTMLCanvasElement>(name)]));
    this.describe();
    this.buildSliders();
    this.buildActions();
    this.update();
  }

  private describe(): void {
    const { census, name, version } = this.baked;
    const model = this.baked.kept.model.trim().split("\n").filter((l) => l !== "").join(", ") || "exact rod, frictionless, hooke";
    element("name").textContent = name;
    const drive = this.rig.drive === "angle" ? "θ" : "δ";
    const [symbol, words] = SIGNALS[this.rig.reads];
    element("formula").textContent = `K = ${drive} f(a)/${symbol}`;
    element("inverse").textContent = `f(â) = K̄ ${symbol}/${drive}`;
    document.querySelectorAll("[data-signal]").forEach((e) => (e.textContent = this.rig.reads));
    element("sensor").textContent = words;
    element("model").textContent = model;
    const part = (x: number) => text(Number(x.toPrecision(2)));
    const departure =
      this.baked.power > 0 ? `, and what parts it from the linear theory to ${part(census.deviation)} of itself` : "";
    element("error").textContent =
      `Everything is read from one chart of ${this.rig.chart.terms} numbers (vibrissa ${version}): at ${census.taps} whiskers within the ` +
      `sliders, solved beside it, ${this.rig.reads} and K are right to ${part(census.strain)} of themselves${departure}.`;
  }

  /** How many of the shown units of a key one is. */
  private shown(key: Key): number {
    return key === "noise" ? NOISE_IN[this.rig.reads][1] : 1;
  }

  private buildSliders(): void {
    const list = element("sliders");
    for (const { key, label, unit, meaning, range, step, allowed } of this.sliders) {
      const row = document.createElement("div");
      row.className = "slider";
      row.title = meaning;
      const name = document.createElement("label");
      name.htmlFor = `range-${key}`;
      name.textContent = unit === "" ? label : `${label}, ${unit}`;
      const shown = this.shown(key);
      const bar = document.createElement("input");
      Object.assign(bar, { type: "range", id: `range-${key}`, min: plain(range[0] * shown), max: plain(range[1] * shown), step: plain(step * shown) });
      bar.setAttribute("aria-description", meaning);
      const number = document.createElement("input");
      Object.assign(number, { type: "number", id: `number-${key}`, step: "any", min: plain(allowed[0] * shown), max: plain(allowed[1] * shown) });
      number.setAttribute("aria-label", `${meaning}${unit === "" ? "" : `, ${unit}`}`);
      const changed = (input: HTMLInputElement) => {
        const value = Number(input.value) / shown;
        if (input.value !== "" && Number.isFinite(value)) {
          this.set({ [key]: Number(value.toPrecision(12)) }, input);
        }
      };
      bar.addEventListener("input", () => changed(bar));
      number.addEventListener("input", () => changed(number));
      // What was typed gives way to what is shown.
      number.addEventListener("change", () => this.schedule());
      row.append(name, bar, number);
      list.append(row);
    }
  }

  private buildActions(): void {
    element("reset").addEventListener("click", () => this.set(this.start));
    element("best").addEventListener("click", () => this.view.optimum && this.set({ drive: this.view.optimum.row.drive }));
    element("copy").addEventListener("click", () => void this.copy());
    window.addEventListener("hashchange", () => this.set(fromHash(location.hash, this.start, this.keys)));
    // Also when the page is first laid out.
    new ResizeObserver(() => this.schedule()).observe(document.body);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
      this.palette = new Palette();
      this.schedule();
    });
  }

  private async copy(): Promise<void> {
    const spec = element<HTMLTextAreaElement>("spec");
    let done = true;
    try {
      await navigator.clipboard.writeText(this.spec());
    } catch {
      spec.closest("details")!.open = true;
      spec.focus();
      spec.select();
      done = document.execCommand("copy");
    }
    element("copied").textContent = done ? "copied: save it as spec.toml, then vibrissa sweep spec.toml" : "select and copy it below";
  }

  /**
   * Moves sliders, each no farther than is allowed; the page follows with the next frame, the numbers at once. `by` is the input that was moved,
   * which keeps what was typed.
   */
  set(values: Partial<Record<Key, number>>, by?: HTMLInputElement): void {
    const state: Record<Key, number> = { ...this.state };
    const refused: string[] = [];
    for (const slider of this.keys) {
      const { key, label, allowed } = slider;
      const asked = values[key];
      if (asked === undefined) {
        continue;
      }
      state[key] = bounded(slider, asked) ?? state[key];
      if (!(asked >= allowed[0] && asked <= allowed[1])) {
        const shown = this.shown(key);
        refused.push(`${label} = ${asked * shown} is not within ${plain(allowed[0] * shown)} and ${plain(allowed[1] * shown)}`);
      }
    }
    this.refused = refused.join("; ");
    this.state = state;
    this.schedule(by);
  }

  /** What is shown, of the state as it is now. */
  private current(): View {
    if (this.view.state !== this.state) {
      this.view = evaluate(this.rig, this.state, this.grid);
    }
    return this.view;
  }

  private schedule(by?: HTMLInputElement): void {
    if (this.waiting) {
      return;
    }
    this.waiting = true;
    requestAnimationFrame(() => {
      this.waiting = false;
      this.update(by);
    });
  }

  /** Evaluates and draws the state. */
  update(by?: HTMLInputElement): void {
    const start = performance.now();
    this.current();
    this.draw();
    this.tell();
    this.showSliders(by);
    this.times.push(performance.now() - start);
    clearTimeout(this.settling);
    this.settling = window.setTimeout(() => this.settle(), SETTLED);
  }

  private draw(): void {
    const { contact, tap, state } = this.view;
    const known = Number.isFinite(tap.arc);
    const shape = known ? shapeOf(contact, state.drive, tap) : undefined;
    const slipped = tap.words.includes("slipped_off");
    const sticks = this.rig.sticks(tap);
    const note = !known
      ? `no tap at a = ${plain(state.a)} mm`
      : `a = ${text(Number(state.a.toPrecision(4)))} mm, touched at ${tap.arc.toFixed(2)} mm${slipped ? ", beyond its tip" : ""}${sticks ? ", sticking" : ""}, P = ${text(Number(tap.force.toPrecision(3)))} N`;
    drawScene(element<HTMLCanvasElement>("scene"), contact, shape, this.palette, note);
    drawFigures(this.view, this.canvases, this.palette);
  }

  private tell(): void {
    const { row, rows, optimum, design, tap, state, contact } = this.view;
    const angle = this.rig.drive === "angle";
    const unit = angle ? "°" : " mm";
    const outside = design.outside(state.drive);
    // Where the chart ends is no optimum; where it ends beyond one, nothing is known of what follows.
    const found = optimum !== undefined && optimum.limitedBy !== "chart_end";
    const unknown = found ? rows.find((r) => r.drive > optimum.row.drive && r.words.has("outside_chart")) : undefined;
    const end = unknown ? `; the chart ends before ${unknown.drive.toFixed(2)}${unit}` : "";
    element<HTMLButtonElement>("best").disabled = !found;
    const digits = (x: number, n = 4) => (Number.isFinite(x) ? text(Number(x.toPrecision(n))) : "–");
    const fields: Readonly<Record<string, string>> = {
      strain: this.rig.reads === "strain" ? `${digits(100 * tap.strain, 5)} %` : `${digits(tap.signal, 5)} ${NOISE_IN[this.rig.reads][0]}`,
      K: digits((1 + tap.deviation) * design.unit, 7),
      force: `${digits(tap.force)} N`,
      K_mean: digits((1 + row.deviation) * design.unit, 7),
      K_sd: digits(row.K_sd * design.unit),
      bias: `${digits(row.error_rms)} mm`,
      noise: `${digits(row.noise_rms)} mm`,
      total: `${digits(row.total_rms)} mm`,
      strain_max: this.rig.reads === "strain" ? `${digits(100 * row.strain_max)} %` : `${digits(row.signal_max)} ${NOISE_IN[this.rig.reads][0]}`,
      optimum: !optimum ? "none" : `${found ? "" : "none up to "}${optimum.row.drive.toFixed(2)}${unit}`,
      optimum_total: found ? `${digits(optimum.row.total_rms)} mm` : "–",
      limited: optimum ? LIMITS[optimum.limitedBy] + end : outside.length > 0 ? "outside the chart" : NO_OPTIMUM,
    };
    for (const [id, value] of Object.entries(fields)) {
      element(`is-${id}`).textContent = value;
    }
    element("at-drive").textContent = `${digits(state.drive)}${unit}`;
    const shown = contact.outsideAt(state.drive);
    const all = shown === undefined || outside.length > 0 ? outside : [`${shown} at a = ${plain(state.a)} mm`];
    const words = [...row.words].filter((w) => w !== "outside_chart");
    const status = element("status");
    status.textContent =
      all.length > 0
        ? `Outside the chart, no value: ${all.slice(0, 2).join("; ")}${all.length > 2 ? `; ${all.length - 2} more` : ""}`
        : words.map((w) => WORDS[w]).join("; ");
    if (this.refused !== "") {
      status.textContent = `${this.refused}. ${status.textContent}`;
    }
    status.dataset["kind"] = this.refused !== "" || all.length > 0 ? "outside" : words.length > 0 ? "words" : "ok";
  }

  private showSliders(by?: HTMLInputElement): void {
    for (const { key } of this.sliders) {
      const value = this.state[key] * this.shown(key);
      const [bar, number] = [element<HTMLInputElement>(`range-${key}`), element<HTMLInputElement>(`number-${key}`)];
      if (bar !== by) {
        bar.value = plain(value);
      }
      if (number !== by) {
        // As many digits as there is room for; the address has them all.
        number.value = plain(Number(value.toPrecision(6)));
      }
    }
    element("copied").textContent = "";
  }

  private settle(): void {
    const hash = toHash(this.state, this.start);
    if (hash !== location.hash.replace(/^#/, "")) {
      history.replaceState(null, "", hash === "" ? location.pathname + location.search : `#${hash}`);
    }
    element<HTMLTextAreaElement>("spec").value = this.spec();
  }

  /** The spec of what is shown. */
  spec(): string {
    return toSpec(this.baked, this.state, toHash(this.state, this.start));
  }

  /** What the page shows, as numbers: for tests and for other programs. */
  numbers() {
    const { row, optimum, design, contact, tap, state } = this.current();
    const shape = Number.isFinite(tap.arc) ? shapeOf(contact, state.drive, tap) : undefined;
    const { taps, estimates, words, ...values } = row;
    return {
      state,
      row: { ...values, K_sd: row.K_sd * design.unit, words: [...words] },
      taps: taps.map((t, i) => ({ a: design.distances[i]!, ...t, distance: estimates[i]?.distance ?? NaN, sigma: estimates[i]?.sigma ?? NaN })),
      optimum: optimum && { drive: optimum.row.drive, total_rms: optimum.row.total_rms, K_sd: optimum.row.K_sd * design.unit, limited_by: optimum.limitedBy },
      outside: design.outside(state.drive),
      // Between the object and where the drawn shape would have it, along the surface and across it, mm.
      apart: shape?.apart,
    };
  }
}

/** Symbol of what is read, and what reads it. */
const SIGNALS = {
  strain: ["ε", "one strain gauge"],
  moment: ["M₀", "a sensor of the moment on its root"],
  force: ["F", "a sensor of the force on its root"],
} as const;

const LIMITS = {
  bias: "inside: more drive, more bias",
  noise: "inside: less drive, more noise",
  strain_limit: "at the strain limit of the gauge",
  bound: "at a bound of the slider",
  complete_rows: "at the last complete row",
  friction: "where a contact turns from sticking to sliding",
  chart_end: "the chart ends here, and the total still falls: the best drive may lie beyond",
} as const;

const NO_OPTIMUM = "no drive keeps the strain limit with an estimate at every distance";

const WORDS = {
  invalid_geometry: "some distances lie beyond the whisker, or the gauge does",
  no_strain: "some contacts lie before the gauge",
  slipped_off: "some contacts slip off the tip",
  strain_limit: "some strains exceed the limit of the gauge",
  no_root: "some strains have no distance by the theory",
  ambiguous: "some strains have two distances in the range",
  outside_calibration: "some strains have a distance beyond the whisker only",
  outside_chart: "outside the chart",
} as const;

// Open to tests and other programs: explorer.set({ drive: 3 }), explorer.numbers(), explorer.spec(), explorer.times.
const page = new Page(JSON.parse(element("chart").textContent ?? "") as Baked);
Object.assign(window, { explorer: page });
