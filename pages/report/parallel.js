"use strict";
// Parallel coordinates: drag along an axis to keep what passes there; the front and the table keep the same rows.
class ParallelView {
    p;
    box = element("div", { class: "parallel" });
    kept;
    logs;
    lines = [];
    constructor(p) {
        this.p = p;
        this.kept = p.axes.map(() => null);
        this.logs = p.axes.map((a) => a.log);
        choice.whenChanged(() => this.show());
    }
    draw(room) {
        const p = this.p;
        const wide = Math.max(room, 108 * p.axes.length);
        const by = Scale.of(p.axes[p.colour], p.values.filter((_, i) => !p.muted[i]).map((v) => v[p.colour] ?? null), true);
        const bar = new Bar(p.axes[p.colour], Shades.along(by));
        // Words of the last axis reach beyond it.
        const [left, right, top, high] = [34, 52 + bar.wide(), 50, 320];
        const gap = (wide - left - right) / Math.max(1, p.axes.length - 1);
        const scales = p.axes.map((a, k) => Scale.of({ ...a, log: this.logs[k], ends: null }, p.values.map((v) => v[k] ?? null)));
        const at = (k, x) => [left + k * gap, top + (1 - scales[k].share(x)) * high];
        const muted = p.values.map((v, i) => p.muted[i] || Number.isNaN(by.share(v[p.colour])));
        const svg = drawn("svg", { width: wide, height: top + high + 34, role: "group", "aria-label": "Parallel coordinates" });
        const inner = drawn("g", {});
        this.lines = p.values.map((values, i) => {
            const d = through(values.map((x, k) => at(k, x)));
            const line = drawn("path", { d, class: muted[i] ? "thread muted" : "thread" });
            if (!muted[i])
                line.style.stroke = shade(by.share(values[p.colour]));
            return line;
        });
        // Grey lines below, and of the others the best, which are dark, on top.
        const rank = (i) => (muted[i] ? Infinity : p.values[i][p.colour] ?? Infinity);
        const order = this.lines.map((_, i) => i).sort((a, b) => rank(b) - rank(a) || a - b);
        inner.append(...order.map((i) => this.lines[i]));
        svg.append(inner);
        p.axes.forEach((a, k) => svg.append(this.axis(svg, a, k, scales[k], [left + k * gap, top, high])));
        bar.draw(svg, wide - bar.wide(), top, high);
        const clear = element("button", { type: "button" }, "keep all rows");
        clear.addEventListener("click", () => {
            this.kept.fill(null);
            this.choose();
            this.draw(this.box.clientWidth);
        });
        const help = element("p", { class: "hint" }, "Drag along an axis to keep the rows that pass there (keys: arrows move the range, with Shift its upper end, Escape ends it; L: log axis).");
        const scroll = element("div", { class: "wide" });
        scroll.append(svg);
        const grey = drawn("svg", { width: 26, height: 14, "aria-hidden": "true" }, drawn("path", { d: "M1 7h24", class: "thread muted" }));
        const key = element("div", { class: "key" }, ...(muted.includes(true) ? [element("span", {}, grey, p.why)] : []));
        this.box.replaceChildren(scroll, key, element("div", { class: "switches" }, clear), help);
        this.show();
    }
    axis(svg, a, k, scale, [x, top, high]) {
        const group = drawn("g", { tabindex: "0", class: "brushed", role: "slider", "aria-label": text(a), "aria-valuetext": this.words(k) });
        group.append(drawn("rect", { x: x - 16, y: top - 8, width: 32, height: high + 16, class: "catch" }), drawn("path", { d: `M${x} ${top}v${high}`, class: "axis" }), drawn("text", { x, y: top - 28, class: "label", "text-anchor": "middle" }, a.label), drawn("text", { x, y: top - 13, class: "tick", "text-anchor": "middle" }, `${a.unit === "" ? "" : `(${a.unit})`}${this.logs[k] ? " log" : ""}`));
        for (const [value, words] of scale.ticks(6)) {
            const y = top + (1 - scale.share(value)) * high;
            group.append(drawn("path", { d: `M${x} ${y}h5`, class: "axis" }), drawn("text", { x: x + 8, y: y + 4, class: "tick halo" }, words));
        }
        const brush = drawn("rect", { x: x - 7, width: 14, y: 0, height: 0, class: "brush" });
        group.append(brush);
        const show = () => {
            const range = this.kept[k] ?? null;
            const [low, upper] = range === null ? [0, 0] : [scale.share(range[0]), scale.share(range[1])];
            brush.setAttribute("y", String(top + (1 - upper) * high));
            brush.setAttribute("height", String(Math.max(0, (upper - low) * high)));
            group.setAttribute("aria-valuetext", this.words(k));
        };
        const share = (e) => Math.min(1, Math.max(0, 1 - (e.clientY - svg.getBoundingClientRect().top - top) / high));
        const keep = (a, b) => {
            const slack = 1e-9;
            this.kept[k] = b - a < 0.004 ? null : [scale.value(Math.min(a, b) - slack), scale.value(Math.max(a, b) + slack)];
            show();
            this.choose();
        };
        group.addEventListener("pointerdown", (e) => {
            e.preventDefault();
            group.focus();
            group.setPointerCapture(e.pointerId);
            const from = share(e);
            const move = (e) => keep(Math.min(from, share(e)), Math.max(from, share(e)));
            move(e);
            group.addEventListener("pointermove", move);
            group.addEventListener("pointerup", () => group.removeEventListener("pointermove", move), { once: true });
        });
        group.addEventListener("keydown", (e) => {
            if (e.key.toLowerCase() === "l" && this.p.values.some((v) => (v[k] ?? 0) > 0)) {
                this.logs[k] = !this.logs[k];
                this.draw(this.box.clientWidth);
                this.box.querySelectorAll(".brushed")[k]?.focus();
                return;
            }
            const step = { ArrowUp: 0.02, ArrowDown: -0.02 }[e.key];
            if (e.key === "Escape")
                keep(0, 0);
            if (step === undefined)
                return;
            e.preventDefault();
            const range = this.kept[k];
            const [low, upper] = range === null || range === undefined ? [0, 1] : [scale.share(range[0]), scale.share(range[1])];
            const inside = (x) => Math.min(1, Math.max(0, x));
            keep(e.shiftKey ? low : inside(low + step), e.shiftKey || upper >= 1 ? inside(upper + (e.shiftKey ? step : 0)) : inside(upper + step));
        });
        show();
        return group;
    }
    words(k) {
        const range = this.kept[k] ?? null;
        return range === null ? "all" : `${spoken(range[0])} to ${spoken(range[1])}`;
    }
    choose() {
        if (this.kept.every((range) => range === null))
            return choice.choose(null);
        const rows = this.p.values.map((_, i) => i).filter((i) => this.kept.every((range, k) => {
            const x = this.p.values[i][k];
            return range === null || (x !== null && x !== undefined && x >= range[0] && x <= range[1]);
        }));
        choice.choose(new Set(rows));
    }
    show() {
        this.lines.forEach((line, i) => {
            line.classList.toggle("out", !choice.has(i));
            line.classList.toggle("here", choice.pointed === i);
        });
    }
}
