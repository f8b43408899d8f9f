// The bent whisker to scale: the strains of both sides give stretch and curvature, and these, integrated from the contact, the shape.
import { radius, taperOf } from "./beam";
/** Intervals of the bent part. */
const PARTS = 60;
/** The shape of a tap at a drive, degrees or mm. */
export function shapeOf(contact, drive, { arc, force, ratio }) {
    const { rig, whisker, a, taper } = contact;
    const { model } = rig.baked;
    const near = contact.along(drive, "contact", arc, "rod");
    const far = contact.along(drive, "far", arc, "rod");
    const alpha = model.surface ? Math.atan(taper.tan) : 0;
    // γ = Q/(kGA), 1/(kG) = (7 + 6ν)/(3E) of a rigid clamp.
    const compliance = model.shear ? (7 + 6 * model.nu) / (3 * model.E_MPa * model.clamp.k) : 0;
    const start = model.clamp.c0 * whisker.D;
    const h = (arc - start) / PARTS;
    const fibre = Array.from({ length: 2 * PARTS + 1 }, (_, i) => {
        const s = start + 0.5 * h * i;
        const r = radius(whisker, s);
        const [e, f] = [near(s), far(s)];
        return { curvature: (f - e) / (2 * r), stretch: model.extension ? 0.5 * (e + f) : 0, area: Math.PI * r * r };
    });
    // ψ(c) = 0, backwards by Simpson's rule: whole intervals, and their first half with the slope at three points.
    const angle = new Float64Array(2 * PARTS + 1);
    for (let i = 2 * PARTS - 2; i >= 0; i -= 2) {
        const [k0, k1, k2] = [fibre[i].curvature, fibre[i + 1].curvature, fibre[i + 2].curvature];
        angle[i] = angle[i + 2] - (h / 6) * (k0 + 4 * k1 + k2);
        angle[i + 1] = angle[i + 2] - (h / 24) * (5 * k2 + 8 * k1 - k0);
    }
    const step = fibre.map(({ stretch, area }, i) => {
        const psi = angle[i];
        // F·d2 of F = (−P sin α + T cos α, −P cos α − T sin α).
        const along = ratio * Math.cos(alpha) - Math.sin(alpha);
        const across = force * (-along * Math.sin(psi) - (Math.cos(alpha) + ratio * Math.sin(alpha)) * Math.cos(psi));
        const shear = (compliance * across) / area;
        return [
            (1 + stretch) * Math.cos(psi) - shear * Math.sin(psi),
            (1 + stretch) * Math.sin(psi) + shear * Math.cos(psi),
        ];
    });
    // From the clamp, which is turned by θ about the motor's axis.
    const turn = rig.drive === "angle" ? rig.amount(drive) : 0;
    const shift = rig.drive === "angle" ? 0 : rig.amount(drive);
    const hub = rig.drive === "angle" ? whisker.hub : 0;
    const rotation = turn - angle[0];
    const [cos, sin] = [Math.cos(rotation), Math.sin(rotation)];
    let [x, y] = [hub * (Math.cos(turn) - 1), hub * Math.sin(turn)];
    const sections = [{ s: 0, x, y, angle: turn }];
    // Between the clamp's face and where the rod begins nothing bends.
    [x, y] = [x + start * Math.cos(turn), y + start * Math.sin(turn)];
    for (let i = 0; i < 2 * PARTS; i += 2) {
        const mean = (k) => (h / 6) * (step[i][k] + 4 * step[i + 1][k] + step[i + 2][k]);
        const [dx, dy] = [mean(0), mean(1)];
        x += cos * dx - sin * dy;
        y += sin * dx + cos * dy;
        sections.push({ s: start + 0.5 * h * (i + 2), x, y, angle: rotation + angle[i + 2] });
    }
    const end = sections[sections.length - 1];
    const left = whisker.L_a - arc;
    if (left > 0) {
        sections.push({ s: whisker.L_a, x: x + left * Math.cos(end.angle), y: y + left * Math.sin(end.angle), angle: end.angle });
    }
    // The object's centre: from the surface of the undeflected whisker at a, and from that of the bent one at c.
    const centre = (R, at, px, py) => {
        const along = model.pole_radius * Math.sin(alpha);
        const across = R + model.pole_radius * Math.cos(alpha);
        return [px + along * Math.cos(at) - across * Math.sin(at), py + along * Math.sin(at) + across * Math.cos(at)];
    };
    const surface = (s) => (model.surface ? radius(whisker, s) : 0);
    const [px, py] = centre(surface(a), 0, a, 0);
    const pole = [px, py - shift];
    const poleByShape = centre(surface(arc), end.angle, end.x, end.y);
    const [c, s] = [Math.cos(end.angle - alpha), Math.sin(end.angle - alpha)];
    const [dx, dy] = [pole[0] - poleByShape[0], pole[1] - poleByShape[1]];
    return { sections, contact: end, pole, poleByShape, apart: [dx * c + dy * s, dy * c - dx * s] };
}
/** Points of the surface on one side (+1 towards the object, −1 away), from s = `from` to `to`, mm. */
export function outline(shape, contact, side, from = 0, to = Infinity) {
    const { whisker } = contact;
    const at = (s) => {
        const i = Math.max(1, shape.sections.findIndex((p) => p.s >= s));
        const [p, q] = [shape.sections[i - 1], shape.sections[i]];
        const w = (s - p.s) / (q.s - p.s);
        return { s, x: p.x + w * (q.x - p.x), y: p.y + w * (q.y - p.y), angle: p.angle + w * (q.angle - p.angle) };
    };
    const inside = shape.sections.filter((p) => p.s > from && p.s < to);
    const ends = to === Infinity ? [at(from), ...inside] : [at(from), ...inside, at(to)];
    return ends.map((p) => {
        const r = side * 0.5 * whisker.D * (1 - taperOf(whisker).tau * p.s);
        return [p.x - r * Math.sin(p.angle), p.y + r * Math.cos(p.angle)];
    });
}
