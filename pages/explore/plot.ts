// Lines on a canvas: axes with round ticks, linear or logarithmic, in the colours of the page.

/** Colours by their names in style.css. */
export class Palette {
  private readonly style = getComputedStyle(document.documentElement);

  get(name: string): string {
    return this.style.getPropertyValue(`--${name}`).trim();
  }
}

export interface Line {
  readonly label: string;
  readonly color: string;
  readonly x: readonly number[];
  readonly y: readonly number[];
  readonly dashed?: boolean;
  /** Points in place of a line. */
  readonly points?: boolean;
}

export interface Mark {
  readonly x: number;
  readonly color: string;
  readonly label?: string;
  readonly dashed?: boolean;
}

export interface Figure {
  readonly x: string;
  readonly y: string;
  readonly lines: readonly Line[];
  readonly marks?: readonly Mark[];
  readonly logX?: boolean;
  readonly logY?: boolean;
  readonly rangeX: readonly [number, number];
  /** Where it says 0 the axis holds it. */
  readonly zeroY?: boolean;
  /** Factor from values to the numbers of the axis. */
  readonly unitY?: number;
}

/** Smallest side of a canvas on which something is drawn, pixels. */
export const LEAST = 60;

const FONT = "12px system-ui, sans-serif";

/** A canvas of its size on the page, in its pixels; cleared. */
export function prepared(canvas: HTMLCanvasElement): { g: CanvasRenderingContext2D; w: number; h: number } {
  const ratio = window.devicePixelRatio || 1;
  const [w, h] = [canvas.clientWidth, canvas.clientHeight];
  const [pw, ph] = [Math.round(w * ratio), Math.round(h * ratio)];
  if (canvas.width !== pw || canvas.height !== ph) {
    [canvas.width, canvas.height] = [pw, ph];
  }
  const g = canvas.getContext("2d")!;
  g.setTransform(ratio, 0, 0, ratio, 0, 0);
  g.clearRect(0, 0, w, h);
  g.font = FONT;
  g.lineJoin = "round";
  return { g, w, h };
}

/** Round numbers in [lo, hi], some `n` of them. */
export function ticks(lo: number, hi: number, n: number): number[] {
  if (!(hi > lo)) {
    return [lo];
  }
  const least = (hi - lo) / n;
  const power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((m) => m * power).find((s) => s >= least * (1 - 1e-9))!;
  const first = Math.ceil(lo / step - 1e-9);
  const last = Math.floor(hi / step + 1e-9);
  return Array.from({ length: Math.max(last - first + 1, 0) }, (_, i) => (first + i) * step);
}

/** Powers of ten in [lo, hi], with 2 and 5 between where there are few, or round numbers. */
export function logTicks(lo: number, hi: number): number[] {
  const from = Math.floor(Math.log10(lo));
  const to = Math.ceil(Math.log10(hi));
  const within = (between: readonly number[]) => {
    const all: number[] = [];
    for (let p = from; p <= to; p += 1) {
      all.push(...between.map((m) => m * 10 ** p));
    }
    return all.filter((x) => x >= lo * (1 - 1e-9) && x <= hi * (1 + 1e-9));
  };
  const powers = within([1]);
  const more = powers.length >= 3 ? powers : within([1, 2, 5]);
  return more.length >= 2 ? more : ticks(lo, hi, 4);
}

/** A short decimal number. */
export function text(x: number): string {
  if (x === 0) {
    return "0";
  }
  const size = Math.abs(x);
  const short = Number(x.toPrecision(6));
  return size >= 1e5 || size < 1e-3 ? short.toExponential().replace("e+", "e") : String(short);
}

/** Numbers of the ticks of one axis, all written in the same way. */
export function labels(values: readonly number[]): string[] {
  const round = values.map((x) => Number(x.toPrecision(5)));
  const powers = round.some((x) => x !== 0 && (Math.abs(x) >= 1e5 || Math.abs(x) < 1e-3));
  return round.map((x) => (x === 0 ? "0" : powers ? x.toExponential().replace("e+", "e") : text(x)));
}

/** Draws a figure; what has no value is left out of its lines. */
export function draw(canvas: HTMLCanvasElement, figure: Figure, palette: Palette): void {
  const { g, w, h } = prepared(canvas);
  if (w < LEAST || h < LEAST) {
    return;
  }
  const unit = figure.unitY ?? 1;
  const values = figure.lines.flatMap((l) => l.y.filter((y, i) => shown(figure, l.x[i]!, y)).map((y) => y * unit));
  const [ink, soft] = [palette.get("ink"), palette.get("soft")];
  g.fillStyle = soft;
  g.textBaseline = "alphabetic";
  g.fillText(figure.y, 8, 14);
  let key = w - 8;
  g.textAlign = "right";
  for (const line of [...figure.lines].reverse().filter((l) => l.label !== "")) {
    g.fillStyle = line.color;
    g.fillText(line.label, key, 14);
    key -= g.measureText(line.label).width + 12;
  }
  g.textAlign = "left";
  if (values.length === 0) {
    g.fillStyle = soft;
    g.textAlign = "center";
    g.fillText("no value here", 0.5 * w, 0.5 * h);
    g.textAlign = "left";
    return;
  }
  let [lo, hi] = [Math.min(...values), Math.max(...values)];
  if (figure.logY) {
    [lo, hi] = [lo / 1.2, hi * 1.2];
  } else {
    if (figure.zeroY) {
      [lo, hi] = [Math.min(lo, 0), Math.max(hi, 0)];
    }
    const room = 0.06 * (hi - lo) || 1e-9 * Math.abs(hi) || 1;
    [lo, hi] = [figure.zeroY && lo === 0 ? 0 : lo - room, hi + room];
  }
  const tickY = figure.logY ? logTicks(lo, hi) : ticks(lo, hi, Math.max(3, h / 45));
  const labelY = labels(tickY);
  const left = 14 + Math.max(...labelY.map((words) => g.measureText(words).width));
  const box = { left, right: w - 10, top: 24, bottom: h - 34 };
  const along = (log: boolean | undefined, [a, b]: readonly [number, number], x: number) =>
    log ? Math.log(x / a) / Math.log(b / a) : (x - a) / (b - a);
  const px = (x: number) => box.left + (box.right - box.left) * along(figure.logX, figure.rangeX, x);
  const py = (y: number) => box.bottom - (box.bottom - box.top) * along(figure.logY, [lo, hi], y);
  g.lineWidth = 1;
  g.strokeStyle = palette.get("grid");
  g.fillStyle = soft;
  g.textAlign = "right";
  g.textBaseline = "middle";
  tickY.forEach((y, i) => {
    line(g, [box.left, box.right], [py(y), py(y)]);
    g.fillText(labelY[i]!, box.left - 5, py(y));
  });
  g.textAlign = "center";
  g.textBaseline = "top";
  const [from, to] = figure.rangeX;
  const tickX = figure.logX ? logTicks(from, to) : ticks(from, to, Math.max(3, w / 80));
  const labelX = labels(tickX);
  tickX.forEach((x, i) => {
    line(g, [px(x), px(x)], [box.bottom, box.bottom + 4]);
    g.fillText(labelX[i]!, px(x), box.bottom + 5);
  });
  g.fillText(figure.x, 0.5 * (box.left + box.right), h - 15);
  g.save();
  g.beginPath();
  g.rect(box.left - 4, box.top - 4, box.right - box.left + 8, box.bottom - box.top + 8);
  g.clip();
  const marks = figure.marks ?? [];
  for (const mark of marks) {
    g.strokeStyle = mark.color;
    g.setLineDash(mark.dashed ? [4, 4] : []);
    line(g, [px(mark.x), px(mark.x)], [box.top, box.bottom]);
  }
  g.setLineDash([]);
  g.lineWidth = 1.8;
  for (const l of figure.lines) {
    g.strokeStyle = g.fillStyle = l.color;
    if (l.points) {
      l.x.forEach((x, i) => shown(figure, x, l.y[i]!) && dot(g, px(x), py(l.y[i]! * unit), 3));
      continue;
    }
    g.setLineDash(l.dashed ? [6, 4] : []);
    g.beginPath();
    let open = false;
    l.x.forEach((x, i) => {
      const y = l.y[i]!;
      if (!shown(figure, x, y)) {
        open = false;
      } else if (open) {
        g.lineTo(px(x), py(y * unit));
      } else {
        g.moveTo(px(x), py(y * unit));
        open = true;
      }
    });
    g.stroke();
  }
  g.setLineDash([]);
  marks.filter((m) => m.label).forEach((mark, row) => {
    // On the side where no other mark stands, on a plate: lines do not cross it.
    const [x, wide, y] = [px(mark.x), g.measureText(mark.label!).width, box.top + 15 * row];
    const free = (from: number) => from >= box.left && from + wide <= box.right && !marks.some((m) => m !== mark && px(m.x) > from - 3 && px(m.x) < from + wide + 3);
    const sides = [x + 4, x - 4 - wide];
    const from = sides.find(free) ?? (x < 0.6 * w ? sides[0]! : sides[1]!);
    g.fillStyle = palette.get("paper");
    g.fillRect(from - 2, y - 1, wide + 4, 14);
    g.fillStyle = mark.color;
    g.textAlign = "left";
    g.fillText(mark.label!, from, y);
  });
  g.restore();
  g.strokeStyle = ink;
  g.lineWidth = 1;
  line(g, [box.left, box.left, box.right], [box.top, box.bottom, box.bottom]);
  g.textAlign = "left";
  g.textBaseline = "alphabetic";
}

function shown(figure: Figure, x: number, y: number): boolean {
  return Number.isFinite(x) && Number.isFinite(y) && (!figure.logY || y > 0);
}

export function line(g: CanvasRenderingContext2D, x: readonly number[], y: readonly number[]): void {
  g.beginPath();
  x.forEach((x, i) => (i === 0 ? g.moveTo(x, y[i]!) : g.lineTo(x, y[i]!)));
  g.stroke();
}

export function dot(g: CanvasRenderingContext2D, x: number, y: number, r: number): void {
  g.beginPath();
  g.arc(x, y, r, 0, 2 * Math.PI);
  g.fill();
}
