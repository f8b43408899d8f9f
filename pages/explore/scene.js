// The whisker to scale: at rest and tapped, with motor, clamp, gauge, contact and object.
import { radius } from "./beam";
import { dot, LEAST, line, prepared } from "./plot";
import { outline } from "./shape";
/** Radius at which an object without one is drawn, mm. */
const POINT = 0.8;
export function drawScene(canvas, contact, shape, palette, note) {
    const { g, w, h } = prepared(canvas);
    if (w < LEAST || h < LEAST) {
        return;
    }
    const { whisker, a, taper, rig } = contact;
    const { model, gauge } = rig.baked;
    const angle = rig.drive === "angle";
    const hub = angle ? whisker.hub : 0;
    const tip = shape?.sections[shape.sections.length - 1];
    const high = Math.max(0.75 * whisker.D, (tip?.y ?? 0) + 0.5 * whisker.d, ...(shape?.sections.map((s) => s.y + 0.3 * whisker.D) ?? []));
    const low = -Math.max(0.75 * whisker.D, -(tip?.y ?? 0) + 0.5 * whisker.d);
    const [left, right] = [-hub - 0.5 * whisker.D, Math.max(whisker.L_a, a + 3) + 3];
    const scale = Math.min((w - 16) / (right - left), (h - 52) / (high - low));
    const px = (x) => 0.5 * w + scale * (x - 0.5 * (left + right));
    const py = (y) => 26 + 0.5 * (h - 52) - scale * (y - 0.5 * (high + low));
    const path = (points, close = true) => {
        g.beginPath();
        points.forEach(([x, y], i) => (i === 0 ? g.moveTo(px(x), py(y)) : g.lineTo(px(x), py(y))));
        if (close) {
            g.closePath();
        }
    };
    const [ink, soft, rubber] = [palette.get("ink"), palette.get("soft"), palette.get("rubber")];
    // At rest.
    g.setLineDash([5, 4]);
    g.strokeStyle = soft;
    g.lineWidth = 1;
    path([
        [0, radius(whisker, 0)],
        [whisker.L_a, radius(whisker, whisker.L_a)],
        [whisker.L_a, -radius(whisker, whisker.L_a)],
        [0, -radius(whisker, 0)],
    ]);
    g.stroke();
    g.setLineDash([]);
    const turn = shape?.sections[0]?.angle ?? 0;
    const [bx, by] = [shape?.sections[0]?.x ?? 0, shape?.sections[0]?.y ?? 0];
    if (shape) {
        g.fillStyle = rubber;
        g.strokeStyle = ink;
        path([...outline(shape, contact, 1), ...outline(shape, contact, -1).reverse()]);
        g.fill();
        g.stroke();
        const side = gauge.side === "contact" ? 1 : -1;
        g.strokeStyle = palette.get("exact");
        g.lineWidth = 4;
        path(outline(shape, contact, side, taper.x1, Math.min(taper.x2, shape.contact.s)), false);
        g.stroke();
    }
    // Clamp and motor.
    g.lineWidth = 4;
    g.strokeStyle = ink;
    const half = 0.75 * whisker.D;
    path([
        [bx + half * Math.sin(turn), by - half * Math.cos(turn)],
        [bx - half * Math.sin(turn), by + half * Math.cos(turn)],
    ], false);
    g.stroke();
    g.fillStyle = ink;
    if (angle) {
        g.lineWidth = 2;
        path([[-hub, 0], [bx, by]], false);
        g.stroke();
        dot(g, px(-hub), py(0), 4);
    }
    // The object, and where it touches.
    const [ox, oy] = shape?.pole ?? [a, model.surface ? radius(whisker, a) : 0];
    const rho = model.pole_radius > 0 ? model.pole_radius : POINT;
    const lift = model.pole_radius > 0 ? 0 : POINT;
    g.fillStyle = palette.get("object");
    dot(g, px(ox), py(oy + lift), scale * rho);
    if (shape) {
        // The force acts on the surface, or on the centreline where the model has it there.
        const { x, y, angle, s } = shape.contact;
        const lever = model.surface ? radius(whisker, s) : 0;
        g.fillStyle = palette.get("noise");
        dot(g, px(x - lever * Math.sin(angle)), py(y + lever * Math.cos(angle)), 3);
    }
    // A scale, and what it shows.
    g.strokeStyle = g.fillStyle = soft;
    g.lineWidth = 1;
    const [sx, sy] = [10, h - 10];
    line(g, [sx, sx, sx + 10 * scale, sx + 10 * scale], [sy - 4, sy, sy, sy - 4]);
    g.fillText("10 mm", sx + 10 * scale + 6, sy);
    g.fillText(note, 8, 14);
}
