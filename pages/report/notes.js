"use strict";
// Words in a panel: as near to their point as there is room, and on nothing that is drawn. As src/figure/notes.rs.
/** Size of notes, free space around them, and how far from their point they have a line to it, px. */
const NOTE = 11.5;
const APART = 2;
const FAR_OFF = 18;
/** What a mark covers. */
function pieces(m, place) {
    const joined = (points) => points.slice(1).map((p, i) => [points[i], p]).filter((p) => p.flat().every(Number.isFinite));
    const crossed = ([x, y], r) => [[[x - r, y - r], [x + r, y + r]], [[x - r, y + r], [x + r, y - r]]];
    const all = (p) => p.x.map((x, i) => at(place, x, p.y[i]));
    switch (m.kind) {
        case "line":
            return [...joined(all(m)), ...(m.marker === null ? [] : all(m).flatMap((p) => crossed(p, 4)))];
        case "area":
            return joined([...all(m), ...all(m).slice(0, 1)]);
        case "points": {
            const bars = m.x.flatMap((x, i) => {
                const [y, e] = [m.y[i] ?? null, m.error[i] ?? null];
                return y === null || e === null ? [] : joined([at(place, x, y - e), at(place, x, y + e)]);
            });
            return [...all(m).flatMap((p) => crossed(p, m.marker === "ring" ? 7 : 4.5)), ...bars];
        }
        case "rule":
            return joined(m.along === "x" ? [at(place, place.x.from, m.at), at(place, place.x.to, m.at)] : [at(place, m.at, place.y.from), at(place, m.at, place.y.to)]);
        default:
            return [];
    }
}
/** Whether a piece goes through a plate (left, top, right, bottom) or near to it (Liang and Barsky 1984). */
function crosses(plate, [from, to]) {
    let [enters, leaves] = [0, 1];
    for (const k of [0, 1]) {
        const [low, high, by] = [plate[k] - APART, plate[k + 2] + APART, to[k] - from[k]];
        if (by === 0) {
            if (from[k] < low || from[k] > high)
                return false;
            continue;
        }
        const [a, b] = [(low - from[k]) / by, (high - from[k]) / by];
        enters = Math.max(enters, Math.min(a, b));
        leaves = Math.min(leaves, Math.max(a, b));
    }
    return enters <= leaves;
}
/** Writes the notes among the marks; words without room are left out: pointing at the point says them too. */
function notes(into, place, marks) {
    const taken = marks.flatMap((m) => pieces(m, place));
    for (const m of marks) {
        if (m.kind !== "note")
            continue;
        const [x, y] = at(place, m.x, m.y);
        const wide = measured(m.text, NOTE);
        const near = ([x0, y0, x1, y1]) => [Math.min(Math.max(x, x0), x1), Math.min(Math.max(y, y0), y1)];
        const places = [];
        for (let top = place.top + APART; top + NOTE + APART <= place.top + place.high; top += NOTE / 2) {
            for (let left = place.left + APART; left + wide + APART <= place.left + place.wide; left += NOTE / 2) {
                const plate = [left, top, left + wide, top + NOTE];
                const [u, v] = near(plate);
                places.push({ plate, off: Math.hypot(u - x, v - y) });
            }
        }
        const found = places.sort((a, b) => a.off - b.off).find(({ plate }) => !taken.some((piece) => crosses(plate, piece)));
        if (found === undefined)
            continue;
        const { plate, off } = found;
        if (off > FAR_OFF) {
            const [u, v] = near(plate);
            into.append(drawn("path", { d: through([[x + (7 / off) * (u - x), y + (7 / off) * (v - y)], [u, v]]), class: "leader" }));
        }
        into.append(drawn("text", { x: plate[0], y: plate[1] + 0.82 * NOTE, class: "note" }, m.text));
        taken.push([[plate[0], plate[1]], [plate[2], plate[3]]], [[plate[0], plate[3]], [plate[2], plate[1]]]);
    }
}
