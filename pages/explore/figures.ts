// The figures of the page, from a design and the tap that is shown.

import { draw, type Figure, type Mark, type Palette } from "./plot";
import type { State } from "./state";
import type { Design, Optimum, Row } from "./statistics";
import type { Contact, Tap } from "./tap";

/** Everything that is shown at one state. */
export interface View {
  readonly state: State;
  readonly design: Design;
  readonly contact: Contact;
  readonly tap: Tap;
  /** Rows over the grid of drives, and at the drive of the state. */
  readonly rows: readonly Row[];
  readonly row: Row;
  readonly optimum: Optimum | undefined;
  /** Contacts over the distances of the domain. */
  readonly reach: readonly Contact[];
}

/** Names of the figures: ids of their canvases. */
export const FIGURES = ["along", "strain-a", "strain-drive", "K-a", "K-drive", "sd", "budget"] as const;

const PERCENT = 100;

/** What is read as an axis says it, and how many of its units one is. */
const READ = {
  strain: ["strain of the gauge, %", PERCENT],
  moment: ["moment on the root, N mm", 1],
  force: ["force on the root, N", 1],
} as const;
const ALONG_POINTS = 90;

export function drawFigures(view: View, canvases: ReadonlyMap<string, HTMLCanvasElement>, palette: Palette): void {
  const figures = [along, strainOverA, strainOverDrive, kOverA, kOverDrive, spread, budget];
  FIGURES.forEach((name, i) => draw(canvases.get(name)!, figures[i]!(view, palette), palette));
}

function driveWord({ design }: View): string {
  return design.rig.drive === "angle" ? "θ, degrees" : "δ, mm";
}

function driveRange({ design }: View): readonly [number, number] {
  return design.rig.baked.domain.drive;
}

function here(view: View, palette: Palette): Mark {
  return { x: view.state.drive, color: palette.get("soft"), dashed: true };
}

function along(view: View, palette: Palette): Figure {
  const { contact, tap, state, design } = view;
  const { L_a } = design.whisker;
  const { x1, x2 } = contact.taper;
  const x = Array.from({ length: ALONG_POINTS + 1 }, (_, i) => (L_a * i) / ALONG_POINTS);
  const known = Number.isFinite(tap.arc);
  const of = (side: "contact" | "far") => (known ? x.map(contact.along(state.drive, side, tap.arc)) : x.map(() => NaN));
  const gauge = design.rig.baked.gauge.side;
  const other = gauge === "contact" ? "far" : "contact";
  const edge = (x: number): Mark => ({ x, color: palette.get("exact"), dashed: true });
  return {
    x: "x along the whisker, mm",
    y: "strain, %",
    unitY: PERCENT,
    zeroY: true,
    rangeX: [0, L_a],
    marks: [edge(x1), edge(x2)],
    lines: [
      { label: `${other} side`, color: palette.get("linear"), x, y: of(other), dashed: true },
      { label: `side of the gauge`, color: palette.get("exact"), x, y: of(gauge) },
      { label: "gauge", color: palette.get("ink"), x: [0.5 * (x1 + x2)], y: [tap.strain], points: true },
    ],
  };
}

function strainOverA(view: View, palette: Palette): Figure {
  const { reach, state, design, row } = view;
  const a = reach.map((c) => c.a);
  const taps = reach.map((c) => c.at(state.drive));
  return {
    x: "a, mm",
    y: READ[design.rig.reads][0],
    unitY: READ[design.rig.reads][1],
    zeroY: true,
    rangeX: design.rig.baked.domain.a,
    marks: [{ x: state.a, color: palette.get("soft"), dashed: true }],
    lines: [
      { label: "linear", color: palette.get("linear"), x: a, y: reach.map((c) => c.linear(state.drive)), dashed: true },
      { label: "exact", color: palette.get("exact"), x: a, y: taps.map((t) => t.signal) },
      { label: "", color: palette.get("exact"), x: design.distances, y: row.taps.map((t) => t.signal), points: true },
    ],
  };
}

function strainOverDrive(view: View, palette: Palette): Figure {
  const { rows, contact, design } = view;
  const x = rows.map((r) => r.drive);
  const [words, unit] = READ[design.rig.reads];
  return {
    x: driveWord(view),
    y: words.replace(/( of the gauge| on the root)/, ` at a = ${shortly(contact.a)} mm`),
    unitY: unit,
    zeroY: true,
    rangeX: driveRange(view),
    marks: [here(view, palette)],
    lines: [
      { label: "linear", color: palette.get("linear"), x, y: x.map((d) => contact.linear(d)), dashed: true },
      { label: "exact", color: palette.get("exact"), x, y: x.map((d) => contact.at(d).signal) },
    ],
  };
}

function kOverA(view: View, palette: Palette): Figure {
  const { reach, state, design, row } = view;
  const K = (t: Tap) => (1 + t.deviation) * design.unit;
  return {
    x: "a, mm",
    y: design.unit === 1 ? "K" : "K, mm",
    rangeX: design.rig.baked.domain.a,
    marks: [{ x: state.a, color: palette.get("soft"), dashed: true }],
    lines: [
      { label: "", color: palette.get("exact"), x: reach.map((c) => c.a), y: reach.map((c) => K(c.at(state.drive))) },
      { label: "distances", color: palette.get("exact"), x: design.distances, y: row.taps.map(K), points: true },
    ],
  };
}

function kOverDrive(view: View, palette: Palette): Figure {
  const { rows, contact, design } = view;
  const x = rows.map((r) => r.drive);
  return {
    x: driveWord(view),
    y: design.unit === 1 ? "K" : "K, mm",
    rangeX: driveRange(view),
    marks: [here(view, palette)],
    lines: [
      { label: "mean over a", color: palette.get("total"), x, y: rows.map((r) => (1 + r.deviation) * design.unit), dashed: true },
      {
        label: `a = ${shortly(contact.a)} mm`,
        color: palette.get("exact"),
        x,
        y: x.map((d) => (1 + contact.at(d).deviation) * design.unit),
      },
    ],
  };
}

function spread(view: View, palette: Palette): Figure {
  const { rows, row, design } = view;
  const color = palette.get("exact");
  return {
    x: driveWord(view),
    y: design.unit === 1 ? "SD(K) over the distances" : "SD(K), mm",
    logX: true,
    logY: true,
    rangeX: driveRange(view),
    marks: [here(view, palette)],
    lines: [
      { label: "", color, x: rows.map((r) => r.drive), y: rows.map((r) => r.K_sd * design.unit) },
      { label: "", color, x: [row.drive], y: [row.K_sd * design.unit], points: true },
    ],
  };
}

function budget(view: View, palette: Palette): Figure {
  const { rows, optimum } = view;
  const x = rows.map((r) => r.drive);
  const limit = rows.find((r) => r.words.has("strain_limit"));
  const color = (name: string) => palette.get(name);
  const marks: Mark[] = [here(view, palette)];
  if (limit) {
    marks.push({ x: limit.drive, color: color("linear"), label: "strain limit" });
  }
  if (optimum) {
    marks.push({ x: optimum.row.drive, color: color("ink"), label: optimum.limitedBy === "chart_end" ? "the chart ends here" : "optimum" });
  }
  return {
    x: driveWord(view),
    y: "error of a, mm rms",
    logX: true,
    logY: true,
    rangeX: driveRange(view),
    marks,
    lines: [
      { label: "bias", color: color("exact"), x, y: rows.map((r) => r.error_rms) },
      { label: "noise", color: color("noise"), x, y: rows.map((r) => r.noise_rms) },
      { label: "total", color: color("total"), x, y: rows.map((r) => r.total_rms) },
    ],
  };
}

function shortly(x: number): string {
  return String(Number(x.toPrecision(4)));
}
