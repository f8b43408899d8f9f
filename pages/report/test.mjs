// The page of a report in a real browser: node pages/report/test.mjs [folder for pictures]
// Results are made by target/debug/vibrissa (or $VIBRISSA); Debian's chromium (or $CHROMIUM) opens them from the disk.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const root = resolve(import.meta.dirname ?? new URL(".", import.meta.url).pathname, "../..");
const program = process.env.VIBRISSA ?? join(root, "target/debug/vibrissa");
const work = mkdtempSync(join(tmpdir(), "vibrissa-pages-"));
const pictures = process.argv[2] === undefined ? join(work, "pictures") : resolve(process.argv[2]);
mkdirSync(pictures, { recursive: true });
const vibrissa = (...words) => execFileSync(program, words, { cwd: work, stdio: "pipe" });

// Guards against hanging, ms.
const GUARD = 300_000;
const WHISKER = "[whisker]\nD = 10\nd = 7\nL_a = 50\n[gauge]\nx_ss = 5\nl = 2\nnoise_strain = 2e-5\n";
const TAPS = "[tap]\na = { from = 21, to = 48, step = 3 }\ntheta = { from = 0.5, to = 10, steps = 12 }\n";
const SPACE = WHISKER.replace("d = 7", "d = { from = 3, to = 10, steps = 8 }").replace("x_ss = 5", "x_ss = [3, 5, 7, 9]");

/** Makes the results of several commands and their pages. */
function results() {
    const spec = (name, text) => writeFileSync(join(work, `${name}.toml`), text);
    spec("space", SPACE + TAPS);
    spec("prototypes", WHISKER.replace("d = 7", "d = [4, 7, 10]") + TAPS);
    spec("rig", WHISKER + TAPS);
    spec("search", `${WHISKER}[tap]\na = [21, 33, 48]\ntheta = 4\n[optimise]\nobjective = "pareto"\nvariables = { d = [4, 9], x_ss = [3, 10], theta = [0.5, 8] }\nbudget = { evaluations = 4000 }\n`);
    vibrissa("sweep", "space.toml", "--backend", "cpu", "--out", "space");
    vibrissa("sweep", "prototypes.toml", "--backend", "cpu", "--out", "prototypes");
    vibrissa("optimise", "search.toml", "--backend", "cpu", "--out", "search");
    vibrissa("tap", "rig.toml", "--out", "tap");
    vibrissa("simulate", "rig.toml", "--noise", "2e-5", "--repeats", "2", "--outliers", "0.05", "--out", "data");
    vibrissa("calibrate", "data/measurements.csv", "--whisker", "rig.toml", "--out", "calibrate");
    vibrissa("shape", join(root, "sweeps/tapping.toml"), "--out", "shape");
    // Whiskers that differ in all that can differ have long titles.
    spec("long", WHISKER.replace("D = 10", "D = [9.123, 10.456]").replace("d = 7", "d = [4.567, 7.891]").replace("L_a = 50", "L_a = [50.12, 61.34]")
        .replace("x_ss = 5", "x_ss = [3.456, 5.678]").replace("l = 2", "l = [1.234, 2.345]") + TAPS);
    vibrissa("sweep", "long.toml", "--backend", "cpu", "--out", "long");
    const made = ["space", "prototypes", "search", "tap", "calibrate", "shape", "long"];
    for (const name of made) vibrissa("report", name, "--figures", "svg");
    return made;
}

/** Opens a page and fails if it says anything on the console or asks for anything but itself. */
async function opened(browser, name, width) {
    const page = await browser.newPage();
    page.setDefaultTimeout(GUARD);
    const [said, asked] = [[], []];
    page.on("console", (m) => said.push(m.text()));
    page.on("pageerror", (e) => said.push(String(e)));
    const address = pathToFileURL(join(work, name, "report/report.html")).href;
    page.on("request", (r) => { if (r.url() !== address && !r.url().startsWith("data:")) asked.push(r.url()); });
    await page.setViewport({ width, height: 900 });
    await page.goto(address, { waitUntil: "load" });
    // Every panel that the data ask for.
    await page.waitForFunction(() => {
        const figures = JSON.parse(document.getElementById("data").textContent).figures;
        const panels = figures.reduce((n, f) => n + (f.parallel === null ? f.panels.length : 1), 0);
        return document.querySelectorAll(".panel > svg, .parallel .wide > svg").length === panels;
    });
    return { page, quiet: () => { assert.deepEqual(said, [], `${name}: console`); assert.deepEqual(asked, [], `${name}: requests`); } };
}

async function picture(page, name) {
    await page.evaluate(() => scrollTo(0, 0));
    await page.screenshot({ path: join(pictures, `${name}.png`), fullPage: true });
}

/** Words of figures lie within them, and numbers are never cut. */
async function whole(page, where) {
    const outside = await page.$$eval(".panel > svg, .parallel .wide > svg", (all) => all.flatMap((svg) => {
        const box = svg.getBoundingClientRect();
        return [...svg.querySelectorAll("text")].filter((t) => {
            const b = t.getBoundingClientRect();
            return b.width > 0 && (b.left < box.left - 2 || b.right > box.right + 4 || b.top < box.top - 2 || b.bottom > box.bottom + 2);
        }).map((t) => t.textContent);
    }));
    assert.deepEqual(outside, [], `${where}: words outside of their figure`);
    const cut = await page.evaluate(() => {
        const panels = JSON.parse(document.getElementById("data").textContent).figures.filter((f) => f.parallel === null).flatMap((f) => f.panels);
        const drawn = [...document.querySelectorAll(".panel > svg")];
        return panels.flatMap((p, i) => (p.y.words.length > 0 ? [] : [...drawn[i].querySelectorAll(".tick")].map((t) => t.firstChild.data).filter((t) => t.includes("…"))));
    });
    assert.deepEqual(cut, [], `${where}: numbers that are cut`);
}

/** Headings and titles lie within the window, and the answer is the first that is said. */
async function headings(page, where, width) {
    const wide = await page.$$eval("h1, h2, .answer, svg .title, svg .label", (all, width) => all.filter((e) => {
        const box = e.getBoundingClientRect();
        return e.textContent !== "" && e.closest(".wide") === null && (box.left < 0 || box.right > width);
    }).map((e) => e.textContent), width);
    assert.deepEqual(wide, [], `${where}: headings wider than the window`);
    const [answer, after] = await page.$eval("main > header", (e) => [e.nextElementSibling.className, e.nextElementSibling.textContent]);
    assert.equal(answer, "answer");
    const told = await page.$eval("#data", (e) => JSON.parse(e.textContent).answer);
    assert.ok(told.length > 20 && after.replaceAll("\u00a0", " ") === told, told);
}

/** No words of a panel lie on its curves: places along every line against the boxes of the words. */
async function apart(page, where) {
    const [found, covered] = await page.evaluate(() => {
        let found = 0;
        const covered = [];
        for (const svg of document.querySelectorAll(".panel > svg")) {
            for (const note of svg.querySelectorAll("text.note")) {
                found++;
                const box = note.getBBox();
                const inside = (p) => p.x > box.x && p.x < box.x + box.width && p.y > box.y + 2 && p.y < box.y + box.height - 2;
                for (const line of svg.querySelectorAll("path.line, path.rule, path.outlined")) {
                    const long = line.getTotalLength();
                    const places = Array.from({ length: Math.ceil(long) }, (_, i) => line.getPointAtLength(i));
                    if (places.some(inside)) covered.push(`${note.textContent} on ${line.getAttribute("class")}`);
                }
            }
        }
        return [found, covered];
    });
    assert.deepEqual(covered, [], `${where}: words on curves`);
    return found;
}

/** Both widths: nothing wider than the window, every figure drawn, nothing outside the numbers. */
async function everyPage(browser, names) {
    let notes = 0;
    for (const name of names) {
        for (const width of [1280, 390]) {
            const { page, quiet } = await opened(browser, name, width);
            assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), width, `${name} at ${width}: wider than the window`);
            const odd = await page.$$eval("svg *", (all) => all.filter((e) => [...e.attributes].some((a) => /NaN|undefined|Infinity/.test(a.value))).length);
            assert.equal(odd, 0, `${name} at ${width}: attributes that are no numbers`);
            await whole(page, `${name} at ${width}`);
            await headings(page, `${name} at ${width}`, width);
            notes += await apart(page, `${name} at ${width}`);
            await picture(page, `${name}-${width}`);
            quiet();
            await page.close();
        }
    }
    assert.ok(notes >= 8, `only ${notes} words in panels`);
}

/** An outlier has an arrow at the edge; a button shows all of the axis. */
async function cut(browser) {
    const { page, quiet } = await opened(browser, "calibrate", 1280);
    const panel = JSON.parse(await page.$eval("#data", (e) => e.textContent)).figures.find((f) => f.name === "residuals").panels[0];
    const all = panel.marks.filter((m) => m.kind === "points").flatMap((m) => m.y).filter((y) => y !== null);
    const beyond = all.filter((y) => y < panel.y.ends[0] || y > panel.y.ends[1]).length;
    assert.ok(beyond > 0 && panel.beyond.includes(`${beyond} tap`), panel.beyond);
    assert.ok((await page.$eval("#residuals .key", (e) => e.textContent)).includes(panel.beyond));
    // An arrow has seven corners.
    const arrows = () => page.$$eval("#residuals .panel g path", (paths) => paths.filter((p) => p.getAttribute("d").match(/[ML]/g).length === 7).length);
    assert.equal(await arrows(), beyond);
    await (await page.$("#residuals .panel button::-p-text(all of y)")).click();
    assert.equal(await arrows(), 0, "all of y has room for all");
    quiet();
    await page.close();
}

/** Dragging along an axis keeps rows in lines, front and table; keys do the same. */
async function brush(browser) {
    const { page, quiet } = await opened(browser, "space", 1280);
    const data = JSON.parse(await page.$eval("#data", (e) => e.textContent));
    const lines = data.figures.find((f) => f.name === "parallel").parallel;
    const table = () => page.$$eval("section[id^=table]", (all) => all.find((s) => s.querySelector("h2").textContent === "designs.csv").querySelector(".table .switches").textContent);
    assert.match(await table(), new RegExp(`of ${lines.values.length}$`));
    await page.$eval("#parallel", (e) => e.scrollIntoView());
    const axis = (await page.$$(".brushed"))[0];
    const box = await axis.$eval("path.axis", (e) => { const b = e.getBoundingClientRect(); return { x: b.x, y: b.y, height: b.height }; });
    // The upper half of the first axis, d.
    await page.mouse.move(box.x, box.y + 1);
    await page.mouse.down();
    await page.mouse.move(box.x, box.y + box.height / 2, { steps: 5 });
    await page.mouse.up();
    const d = lines.values.map((v) => v[0]);
    const shown = await page.$$eval(".wide .thread", (all) => all.filter((e) => !e.classList.contains("out")).length);
    const middle = (Math.min(...d) + Math.max(...d)) / 2;
    const kept = d.filter((x) => x >= middle).length;
    assert.equal(shown, kept, "lines that are kept");
    assert.ok(kept > 0 && kept < d.length);
    assert.match(await table(), new RegExp(`of ${kept}$`));
    const points = await page.$$eval("#front [data-row]", (all) => all.filter((e) => !e.classList.contains("out")).length);
    // A row without spread or error has no point.
    const there = lines.values.filter((v) => v[0] >= middle && v[lines.colour] !== null && v[lines.colour + 1] !== null).length;
    assert.equal(points, there, "points of the front");
    await page.screenshot({ path: join(pictures, "brush.png") });
    await axis.evaluate((e) => e.focus());
    await page.keyboard.press("Escape");
    assert.match(await table(), new RegExp(`of ${lines.values.length}$`), "Escape keeps all");
    for (let i = 0; i < 10; i++) await page.keyboard.press("ArrowUp");
    assert.ok(await page.$$eval(".wide .thread.out", (all) => all.length) > 0, "keys keep a range");
    await page.keyboard.press("Escape");
    quiet();
    await page.close();
}

/** Headers sort, up, down and back. */
async function sort(browser) {
    const { page, quiet } = await opened(browser, "space", 1280);
    const section = await page.evaluateHandle(() => [...document.querySelectorAll("section[id^=table]")].find((s) => s.querySelector("h2").textContent === "designs.csv"));
    const names = await section.$$eval("th", (all) => all.map((e) => e.textContent.replace(/ [↑↓]$/, "")));
    const column = names.indexOf("K_sd");
    const values = () => section.$$eval("tbody tr", (all, k) => all.map((tr) => Number(tr.children[k].title)), column);
    const first = await values();
    const data = JSON.parse(await page.$eval("#data", (e) => e.textContent));
    const all = data.tables.find((t) => t.file === "designs.csv").rows.map((r) => r[column]).sort((a, b) => a - b);
    const press = async () => (await section.$$("th button"))[column].click();
    await press();
    assert.deepEqual(await values(), all.slice(0, first.length), "ascending");
    await press();
    assert.deepEqual(await values(), [...all].reverse().slice(0, first.length), "descending");
    await press();
    assert.deepEqual(await values(), first, "as in the file");
    quiet();
    await page.close();
}

/** Hover, arrow keys, log axes, the key, dark and light. */
async function point(browser) {
    const { page, quiet } = await opened(browser, "prototypes", 1280);
    const data = JSON.parse(await page.$eval("#data", (e) => e.textContent));
    const line = data.figures.find((f) => f.name === "sd").panels[0].marks[0];
    await page.$eval("#sd", (e) => e.scrollIntoView());
    await page.$eval("#sd svg[tabindex]", (e) => e.focus());
    await page.keyboard.press("ArrowRight");
    const told = await page.$eval("#tip", (e) => [e.hidden, e.textContent]);
    assert.equal(told[0], false);
    assert.ok(told[1].includes(line.name) && told[1].includes("θ = 0.5°"), told[1]);
    const circle = await page.$("#sd svg .f0");
    await circle.hover();
    assert.ok((await page.$eval("#tip", (e) => e.textContent)).includes(line.name));
    await page.screenshot({ path: join(pictures, "hover.png") });
    const heights = () => page.$$eval("#sd .panel path.line", (all) => all[0].getAttribute("d"));
    const before = await heights();
    const button = (await page.$$("#sd .panel button")).at(-1);
    assert.equal(await button.evaluate((b) => [b.textContent, b.getAttribute("aria-pressed")].join()), "log y,true");
    await button.click();
    assert.notEqual(await heights(), before, "a linear axis is another");
    await (await page.$$("#sd .panel button")).at(-1).click();
    assert.equal(await heights(), before);
    await (await page.$("#sd .key button")).click();
    assert.equal((await page.$$("#sd .panel path.line")).length, 2, "one of three lines is hidden");
    const named = await page.$$eval("#K .panel .label", (all) => all.map((t) => t.textContent));
    assert.equal(named.filter((t) => t === "K").length, 3, "each map says what its colours are");
    const ground = () => page.evaluate(() => getComputedStyle(document.body).backgroundColor);
    const light = await ground();
    const series = () => page.$$eval("#sd .panel path.line", (all) => all.map((e) => getComputedStyle(e).stroke));
    const light_ = await series();
    await page.click("#theme");
    assert.notEqual(await ground(), light);
    (await series()).forEach((c, i) => assert.notEqual(c, light_[i], "colours of the dark page are its own"));
    await picture(page, "prototypes-dark");
    quiet();
    await page.close();
}

/** A spec cannot bring markup into the page. */
async function hostile(browser) {
    const spec = `# </script><img src=x onerror="document.title='gone'"> <!-- &lt;\n${WHISKER}${TAPS}`;
    writeFileSync(join(work, "hostile.toml"), spec);
    vibrissa("sweep", "hostile.toml", "--backend", "cpu", "--out", "hostile");
    vibrissa("report", "hostile", "--figures", "svg");
    const { page, quiet } = await opened(browser, "hostile", 800);
    assert.equal(await page.$eval("#made pre", (e) => e.textContent), spec);
    assert.equal(await page.$("img"), null);
    quiet();
    await page.close();
}

const names = results();
const browser = await puppeteer.launch({ executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium", headless: true, timeout: GUARD, protocolTimeout: GUARD, args: ["--no-sandbox", "--hide-scrollbars", "--force-color-profile=srgb"] });
try {
    await everyPage(browser, names);
    await brush(browser);
    await sort(browser);
    await point(browser);
    await hostile(browser);
    await cut(browser);
} finally {
    await browser.close();
    if (process.argv[2] === undefined) rmSync(work, { recursive: true });
}
console.log(`report: ${names.length} pages at 1280 and 390 px, headings, words off curves, brush, sort, hover, log axes, themes, cut axes`);
