"use strict";
// Marks of a panel, as SVG.
function at(place, x, y) {
    return [place.left + place.x.share(x) * place.wide, place.top + (1 - place.y.share(y)) * place.high];
}
/** A path through points, broken where one has no place. */
function through(points, closed = false) {
    let begun = false;
    let d = "";
    for (const [x, y] of points) {
        const usable = Number.isFinite(x) && Number.isFinite(y);
        if (usable)
            d += `${begun ? "L" : "M"}${x.toFixed(2)} ${y.toFixed(2)}`;
        begun = usable;
    }
    return closed && d !== "" ? `${d}Z` : d;
}
function spot(marker, x, y, r, colour) {
    if (marker === "circle")
        return drawn("circle", { cx: x, cy: y, r, class: `f${colour}` });
    if (marker === "ring")
        return drawn("circle", { cx: x, cy: y, r: 1.8 * r, class: `s${colour} ring` });
    const [corners, strokes] = data.markers[marker] ?? [[], []];
    const place = (all) => all.map(([u, v]) => [x + u * r, y + v * r]);
    if (strokes.length > 0)
        return drawn("path", { d: strokes.map((ends) => through(place(ends))).join(""), class: `s${colour}` });
    return drawn("path", { d: through(place(corners), true), class: `f${colour}` });
}
/** A point; an arrow at the edge where it lies above or below the panel. */
function placed(place, marker, [x, y], r, colour) {
    const [over, under] = [y < place.top - 0.5, y > place.top + place.high + 0.5];
    if (over || under)
        return spot("arrow", x, over ? place.top + 2 * r : place.top + place.high - 2 * r, over ? r : -r, colour);
    return spot(marker, x, y, r, colour);
}
/** Points of a line of which more are not all marked, and how far apart its markers then are, px. */
const CROWD = [60, 26];
/** Which points of a line are marked: all, or of many those with room between them. */
function marked(points) {
    let since = Infinity;
    return points.map(([x, y], i) => {
        const by = i === 0 ? 0 : Math.hypot(x - points[i - 1][0], y - points[i - 1][1]);
        since += Number.isFinite(by) ? by : 0;
        const shown = Number.isFinite(x + y) && (points.length <= CROWD[0] || since >= CROWD[1]);
        if (shown)
            since = 0;
        return shown;
    });
}
/** Classes of an area. */
function looks(area) {
    return `a${area.colour} ${area.outlined ? "outlined" : "plain"}`;
}
const DASHES = ["", "6 4", "2 3"];
/** Draws a mark and says where it can be pointed at. */
function mark(into, place, panel, m) {
    const spots = [];
    const paired = (p) => p.x.map((x, i) => at(place, x, p.y[i]));
    const point = (p, i, [x, y], more = [], row = null) => {
        if (!Number.isFinite(x) || !Number.isFinite(y))
            return;
        const edge = Math.min(Math.max(y, place.top), place.top + place.high);
        spots.push({ x, y: edge, row, words: [p.name, told(panel.x, p.x[i]), told(panel.y, p.y[i]), ...more].filter((w) => w !== "") });
    };
    switch (m.kind) {
        case "line": {
            const points = paired(m);
            into.append(drawn("path", { d: through(points), class: `s${m.colour} line`, "stroke-dasharray": DASHES[m.dash] ?? "" }));
            const shown = marked(points);
            points.forEach((p, i) => {
                if (m.marker !== null && shown[i])
                    into.append(placed(place, m.marker, p, 3, m.colour));
                point(m, i, p);
            });
            break;
        }
        case "points": {
            const size = m.x.length > 300 ? 2.2 : 3.2;
            paired(m).forEach((p, i) => {
                if (!Number.isFinite(p[0] + p[1]))
                    return;
                const group = drawn("g", {});
                const error = m.error[i];
                if (error !== null && error !== undefined) {
                    const ends = [-1, 1].map((s) => at(place, m.x[i], m.y[i] + s * error));
                    group.append(drawn("path", { d: through(ends), class: `s${m.colour} bar` }));
                }
                group.append(placed(place, m.marker, p, size, m.colour));
                const row = m.rows[i] ?? null;
                if (row !== null)
                    group.dataset.row = String(row);
                into.append(group);
                const more = error === null || error === undefined ? [] : [`± ${spoken(error)}`];
                point(m, i, p, [...more, m.notes[i] ?? ""], row);
            });
            break;
        }
        case "bars": {
            const thick = (0.8 * place.high) / (place.y.to - place.y.from) / m.among[1];
            m.x.forEach((x, i) => {
                const [[x0, middle], [x1]] = [at(place, 0, m.y[i]), at(place, x, m.y[i])];
                if (!Number.isFinite(x1))
                    return;
                const top = middle + thick * (m.among[0] - 0.5 * m.among[1]);
                into.append(drawn("rect", { x: Math.min(x0, x1), y: top, width: Math.abs(x1 - x0), height: 0.92 * thick, class: `f${m.colour}` }));
                point(m, i, [x1, top + 0.5 * thick]);
            });
            break;
        }
        case "area":
            into.append(drawn("path", { d: through(paired(m), true), class: looks(m) }));
            break;
        case "cells": {
            const shades = Shades.of(m);
            const columns = m.x.length - 1;
            // Along an axis of few values cells are bands with gaps between them.
            const less = [panel.x, panel.y].map((a) => (a.words.length > 0 ? 0.04 : 0));
            m.z.forEach((z, k) => {
                const [i, j] = [k % columns, Math.floor(k / columns)];
                const [[x0, y0], [x1, y1]] = [at(place, m.x[i], m.y[j]), at(place, m.x[i + 1], m.y[j + 1])];
                if (z === null || !Number.isFinite(x0 + y0 + x1 + y1))
                    return;
                const span = (from, long, off) => (off > 0 ? [from + off * long, (1 - 2 * off) * long] : [from, long + 0.3]);
                const [[x = 0, width = 0], [y = 0, height = 0]] = [span(x0, x1 - x0, less[0]), span(y1, y0 - y1, less[1])];
                into.append(drawn("rect", { x, y, width, height, "shape-rendering": "crispEdges", style: `fill: ${shades.colour(z)}` }));
                const middle = (a, b) => (a + b) / 2;
                spots.push({
                    x: middle(x0, x1), y: middle(y0, y1), row: null,
                    words: [told(m.of, z), told(panel.x, middle(m.x[i], m.x[i + 1])), told(panel.y, middle(m.y[j], m.y[j + 1]))],
                });
            });
            break;
        }
        case "rule": {
            const ends = m.along === "x"
                ? [at(place, place.x.from, m.at), at(place, place.x.to, m.at)]
                : [at(place, m.at, place.y.from), at(place, m.at, place.y.to)];
            into.append(drawn("path", { d: through(ends), class: `s${m.colour} rule`, "stroke-dasharray": DASHES[m.dash] ?? "" }));
            break;
        }
        // Words come last, where they have room.
        case "note":
            break;
    }
    return spots;
}
