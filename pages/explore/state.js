// What the sliders say: their ranges, the address of the page, and the spec that a sweep runs.
/** Noise where the spec says none, of strains, moments (N mm) and forces (N): a good foil gauge, a good load cell; without noise the smallest drive is best. */
const NOISE = { strain: 20e-6, moment: 0.02, force: 0.001 };
/** Slider of the noise: its unit, how many of them one is, and what a reading is. */
export const NOISE_IN = { strain: ["µε", 1e6, "strain"], moment: ["N mm", 1, "moment"], force: ["N", 1, "force"] };
/** A step of 1, 2 or 5 times a power of ten, some five hundred to the range. */
function stepOf([lo, hi]) {
    const least = (hi - lo) / 500;
    const power = 10 ** Math.floor(Math.log10(least));
    return [1, 2, 5, 10].map((m) => m * power).find((s) => s >= least * (1 - 1e-9)) ?? least;
}
/** What may be typed where nothing else is said, as multiples of the ends of the range. */
const BEYOND = [0.1, 10];
/** Every key of a state with its range; those of one value have no slider. */
export function keysOf(baked) {
    const { domain, sensor: { signal } } = baked;
    const noise = NOISE[signal];
    const angle = baked.drive === "angle";
    const slider = (key, label, unit, range, meaning, allowed, step) => ({
        key,
        label,
        unit,
        meaning,
        range,
        step: step ?? stepOf(range),
        allowed: allowed ?? [BEYOND[0] * range[0], BEYOND[1] * range[1]],
    });
    return [
        slider("D", "D", "mm", domain.D, "diameter at the base"),
        slider("d", "d", "mm", domain.d, "diameter at the tip"),
        slider("L_a", "L_a", "mm", domain.L_a, "length from clamp to tip"),
        slider("x_ss", "x_ss", "mm", domain.x_ss, "start of the gauge, from the clamp"),
        slider("l", "l", "mm", domain.l, "length of the gauge"),
        slider("hub", "hub", "mm", domain.hub, "distance of the motor's axis behind the clamp"),
        angle
            ? slider("drive", "θ", "°", domain.drive, "tap angle", [BEYOND[0] * domain.drive[0], 90])
            : slider("drive", "δ", "mm", domain.drive, "displacement of the object"),
        slider("noise", "noise", NOISE_IN[signal][0], [0, 10 * noise], `standard deviation of one ${NOISE_IN[signal][2]} reading`, [0, 500 * noise], 0.05 * noise),
        slider("from", "a from", "mm", domain.a, "nearest distance that is told"),
        slider("to", "a to", "mm", domain.a, "farthest distance that is told"),
        slider("distances", "number", "", [2, 40], "distances, evenly spaced", [2, 200], 1),
        slider("a", "a", "mm", domain.a, "distance at which the whisker is drawn"),
    ];
}
/** The keys that a slider moves. */
export function slidersOf(baked) {
    return keysOf(baked).filter(({ range }) => range[1] > range[0]);
}
/** `value` of a key within what is allowed; nothing where it is no number. */
export function bounded({ key, allowed: [lo, hi] }, value) {
    const near = Math.min(Math.max(key === "distances" ? Math.round(value) : value, lo), hi);
    return Number.isFinite(value) ? near : undefined;
}
export function startOf(baked) {
    const { D, d, L_a, x_ss, l, hub, drive, from, to, noise } = baked.start;
    const distances = Math.min(Math.max(baked.start.distances, 2), 40);
    const [near, far] = from < to ? [from, to] : baked.domain.a;
    const a = near + Math.round((distances - 1) * 0.4) * ((far - near) / (distances - 1));
    return { D, d, L_a, x_ss, l, hub, drive, noise: noise ?? NOISE[baked.sensor.signal], from: near, to: far, distances, a };
}
/** Shortest text of a number that a slider can give; sums of decimal steps lose their tail. */
export function plain(x) {
    return String(Number(x.toPrecision(12)));
}
export function toHash(state, start) {
    const changed = Object.keys(start).filter((key) => state[key] !== start[key]);
    return changed.map((key) => `${key}=${plain(state[key])}`).join("&");
}
/** The state of an address; what it does not say, or says wrongly, is that of the start. Numbers out of range are kept: the chart says so. */
export function fromHash(hash, start, keys) {
    const said = new URLSearchParams(hash.replace(/^#/, ""));
    const state = { ...start };
    for (const slider of keys) {
        const words = said.get(slider.key)?.trim() ?? "";
        const value = words === "" ? NaN : Number(words);
        state[slider.key] = (value >= 0 ? bounded(slider, value) : undefined) ?? start[slider.key];
    }
    return state;
}
/** The spec of what is shown, as TOML that `vibrissa sweep` runs. */
export function toSpec(baked, state, address) {
    const angle = baked.drive === "angle";
    const strain = baked.sensor.signal === "strain";
    const [from, to] = [Math.min(state.from, state.to), Math.max(state.from, state.to)];
    const number = (key, value) => `${key} = ${plain(value)}\n`;
    const section = (name, lines) => (lines === "" ? "" : `[${name}]\n${lines}\n`);
    const a = from < to ? `{ from = ${plain(from)}, to = ${plain(to)}, steps = ${state.distances} }` : plain(from);
    return [
        `# From a page of vibrissa explore ${baked.version}, made of ${baked.name}.toml${address ? `: #${address}` : ""}\nformat = 1\n\n`,
        section("whisker", number("D", state.D) + number("d", state.d) + number("L_a", state.L_a) + number("hub", state.hub)),
        section("gauge", number("x_ss", state.x_ss) + number("l", state.l) + (strain ? number("noise_strain", state.noise) : "") + baked.kept.gauge),
        section("sensor", strain ? "" : number("noise", state.noise) + baked.kept.sensor),
        section("tap", `a = ${a}\n` + number(angle ? "theta" : "delta", state.drive) + baked.kept.tap),
        section("model", baked.kept.model),
        section("estimate", baked.kept.estimate),
    ].join("").trimEnd() + "\n";
}
