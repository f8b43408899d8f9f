// The page: what it was made from, figures, tables, the spec.

/** Place of the ink among the colours. */
const INK = 4;

/** Names of a figure with their looks; a click hides what has the name. */
function key(figure: Figure, hidden: Set<string>, redraw: () => void): HTMLElement {
    const entries = new Map<string, { line?: [number, number]; spot?: [number, Marker]; area?: string }>();
    for (const m of figure.panels.flatMap((p) => p.marks)) {
        if (!("name" in m) || m.name === "") continue;
        const entry = entries.get(m.name) ?? {};
        entries.set(m.name, entry);
        if (m.kind === "line" || m.kind === "rule") entry.line ??= [m.colour, m.dash];
        if (m.kind === "points") entry.spot ??= [m.colour, m.marker];
        if (m.kind === "line" && m.marker !== null) entry.spot ??= [m.colour, m.marker];
        if (m.kind === "bars") entry.area ??= `f${m.colour}`;
        if (m.kind === "area") entry.area ??= looks(m);
    }
    const list = element("div", { class: "key" });
    const sign = (...parts: SVGElement[]) => drawn("svg", { width: 26, height: 14, "aria-hidden": "true" }, ...parts);
    for (const [name, look] of entries) {
        const svg = sign();
        if (look.area !== undefined) svg.append(drawn("rect", { x: 4, y: 2, width: 18, height: 10, class: look.area }));
        if (look.line !== undefined) svg.append(drawn("path", { d: "M1 7h24", class: `s${look.line[0]} line`, "stroke-dasharray": DASHES[look.line[1]] ?? "" }));
        if (look.spot !== undefined) svg.append(spot(look.spot[1], 13, 7, 3.2, look.spot[0]));
        const button = element("button", { type: "button", "aria-pressed": "true", title: "show or hide" }, svg, name);
        button.addEventListener("click", () => {
            if (!hidden.delete(name)) hidden.add(name);
            button.setAttribute("aria-pressed", String(!hidden.has(name)));
            redraw();
        });
        list.append(button);
    }
    for (const { beyond } of figure.panels) {
        if (beyond !== "") list.append(element("span", {}, sign(spot("arrow", 13, 7, 3.2, INK)), beyond));
    }
    if (figure.panels.some((p) => p.marks.some((m) => m.kind === "cells" && m.z.includes(null)))) {
        list.append(element("span", {}, sign(drawn("rect", { x: 4, y: 2, width: 18, height: 10, class: "edge" })), data.no_value));
    }
    return list;
}

function section(figure: Figure, number: number): HTMLElement {
    const made = element("section", { id: figure.name }, element("h2", {}, `${number}. ${figure.title}`));
    const views: { box: HTMLElement; draw(wide: number): void }[] = [];
    if (figure.parallel !== null) {
        views.push(new ParallelView(figure.parallel));
        made.append(views[0]!.box);
    } else {
        const hidden = new Set<string>();
        const views_ = figure.panels.map((p) => new PanelView(p, hidden));
        views.push(...views_);
        const grid = element("div", { class: "panels", style: `--columns: ${Math.min(figure.columns, figure.panels.length)}` }, ...views_.map((v) => v.box));
        made.append(grid, key(figure, hidden, () => draw()));
    }
    made.append(element("p", { class: "caption" }, figure.caption));
    const draw = () => views.forEach((v) => v.draw(v.box.clientWidth));
    // Drawn when it comes into sight, and again when its width changes.
    let wide = 0;
    new ResizeObserver(() => {
        if (made.clientWidth !== wide && made.clientWidth > 0) {
            wide = made.clientWidth;
            draw();
        }
    }).observe(made);
    return made;
}

function colours(): string {
    const of = (theme: "light" | "dark") => [
        ...data.colours[theme].map((c, i) => `--c${i}: ${c};`),
        ...data.map[theme].map((c, i) => `--m${i}: rgb(${c.join(" ")});`),
    ].join(" ");
    const [light, dark] = [of("light"), of("dark")];
    const each = data.colours.light.map((_, i) => `.f${i} { fill: var(--c${i}); } .s${i} { stroke: var(--c${i}); fill: none; } .a${i} { fill: var(--c${i}); stroke: var(--c${i}); }`);
    return `:root { ${light} } @media (prefers-color-scheme: dark) { :root:not([data-theme=light]) { ${dark} } } :root[data-theme=dark] { ${dark} } ${each.join(" ")}`;
}

function themes(): HTMLElement {
    const button = element("button", { type: "button", id: "theme" }, "dark / light");
    button.addEventListener("click", () => {
        const dark = document.documentElement.dataset.theme ?? (matchMedia("(prefers-color-scheme: dark)").matches ? "dark" : "light");
        document.documentElement.dataset.theme = dark === "dark" ? "light" : "dark";
    });
    return button;
}

/** A sentence whose numbers stay with their symbols and units. */
function unbroken(words: string): string {
    return words.replace(/ = | (?=(mm|ns|N|%)(?![a-z]))/g, (gap) => gap.replaceAll(" ", "\u00a0"));
}

function pairs(rows: [string, string][]): HTMLElement {
    return element("dl", {}, ...rows.flatMap(([name, value]) => [element("dt", {}, name), element("dd", {}, value)]));
}

function page(): void {
    document.head.append(element("style", {}, colours()));
    const contents = data.figures.map((f, i) => element("a", { href: `#${f.name}` }, `${i + 1}. ${f.title}`));
    const tables = data.tables.map((t, i) =>
        element("section", { id: `table${i}` }, element("h2", {}, t.file),
            ...(t.linked && data.figures.some((f) => f.name === "parallel") ? [element("p", { class: "hint" }, "Linked to the parallel coordinates and the trade-off: what is kept there is shown here.")] : []),
            new TableView(t).box));
    const main = element("main", {},
        element("header", {}, element("h1", {}, document.title), themes()),
        ...(data.answer === "" ? [] : [element("p", { class: "answer" }, unbroken(data.answer))]),
        ...(data.facts.length > 0 ? [pairs(data.facts)] : []),
        ...(data.notes.length > 0 ? [element("ul", { class: "notes" }, ...data.notes.map((n) => element("li", {}, n)))] : []),
        element("nav", { "aria-label": "Figures and tables" }, ...contents, ...data.tables.map((t, i) => element("a", { href: `#table${i}` }, t.file))),
        ...data.figures.map((f, i) => section(f, i + 1)),
        ...tables,
        element("section", { id: "made" }, element("h2", {}, "Made from"), pairs(data.made),
            ...(data.spec === null || data.spec === "" ? [] : [element("details", {}, element("summary", {}, "the spec"), element("pre", {}, data.spec))])),
    );
    tip.hidden = true;
    document.body.append(main, tip);
}

page();
