// frames.bench.mjs [SECONDS] [WIDTHxHEIGHT]: what the page shows while its camera turns in a world of 12
// pictures of sky, 36 patches of ground and 1600 trees, in Chromium on one core: frames a second, and what each thread takes.
//
//   script/build-web && node web/test/frames.bench.mjs
import { launch, openPage, pause, stateIs } from './browser_support.mjs';
import { bindBrowser, numbersOf, printThreads, threadTimes } from './page_numbers.mjs';
import { startServer, WORLD } from './server.mjs';
import { randomFrom } from './support.mjs';

const seconds = Number(process.argv[2] ?? 6);
const [width, height] = (process.argv[3] ?? '1280x720').split('x').map(Number);
const random = randomFrom(1);

/** Noise; of a crown: opaque in a circle, soft at its edge. */
function picture(wide, high, crown) {
    const pixels = new Uint8Array(4 * wide * high);
    for (let i = 0; i < wide * high; i++) {
        const x = (2 * (i % wide) + 1) / wide - 1, y = (2 * Math.floor(i / wide) + 1) / high - 1;
        const alpha = crown ? Math.min(Math.max(4 * (1 - x * x - y * y), 0), 1) : 1;
        pixels.set([70 + 99 * random(), 90 + 99 * random(), 60 + 60 * random(), 255].map(
            (v) => v * alpha), 4 * i);
    }
    return pixels;
}

function impostor(id, wide, high, corners, crown) {
    const [x, y, z] = corners[0];
    const edge = crown ? [wide >> 2, high >> 2] : [0, 0];
    return { id, version: 1, origin: { x, y, z }, nearer: 1, width: wide, height: high,
             corners: corners.flatMap((c) => [c[0] - x, c[1] - y, c[2] - z]), codec: 1,
             opaque: [edge[0], edge[1], wide - edge[0], high - edge[1]],
             picture: picture(wide, high, crown) };
}

/** All around a camera at the origin, farthest first; a ring of ground and trees that fill the picture. */
function world() {
    const items = [];
    const at = (angle, distance, z) =>
        [distance * Math.sin(angle), distance * Math.cos(angle), z];
    let id = 1n;
    for (const [far, near] of [[4000, 60], [60, 15], [15, 4]]) {
        for (let i = 0; i < 12; i++) {
            const [a, b] = [i, i + 1].map((k) => k * Math.PI / 6);
            const [p, q, r] = [at(a, far, -6), at(b, far, -6), at(a, near, -6)];
            items.push(impostor(id++, 640, 160, [p, q, q.map((v, k) => v + r[k] - p[k]), r], false));
        }
    }
    for (let i = 0; i < 12; i++) { // the sky
        const [p, q] = [i, i + 1].map((k) => at(k * Math.PI / 6, 5000, 3000));
        const down = (c) => [c[0], c[1], -6];
        items.unshift(impostor(id++, 640, 400, [p, q, down(q), down(p)], false));
    }
    for (let i = 0; i < 1600; i++) {
        const angle = 2 * Math.PI * random(), distance = 400 - i / 1600 * 370;
        const half = 6 / distance, tall = 12;
        const [l, r] = [at(angle - half, distance, -6 + tall), at(angle + half, distance, -6 + tall)];
        const down = (c) => [c[0], c[1], -6];
        const side = Math.min(Math.max(8, Math.round(tall * height * 0.87 / distance)), 128);
        items.push(impostor(id++, side, side, [l, r, down(r), down(l)], true));
    }
    return items;
}

const items = world();
const ids = BigUint64Array.from(items.map((item) => item.id));
const server = await startServer((message, client) => {
    if (message.camera && client.batch === 0) {
        items.forEach((item) => client.send({ impostor: item }));
        client.send({ order: { camera: 0, ids } });
    }
});
server.world = { ...WORLD, objects: items.length };
const browser = await launch();
try {
    const page = await openPage(browser, `${server.url}#token=secret`,
                                { viewport: { width, height } });
    await stateIs(page, 'showing');
    const pids = bindBrowser();
    await page.keyboard.press('n');
    await page.keyboard.down('d');
    await pause(3000);
    const before = threadTimes(pids);
    const start = performance.now();
    await pause(1000 * seconds);
    const numbers = await numbersOf(page, 4);
    const took = (performance.now() - start) / 1000;
    if (process.env.SHOT) { await page.screenshot({ path: process.env.SHOT }); }
    console.log(`${width}x${height}: ${numbers.map((one) => one.join(' ')).join(', ')}`);
    printThreads(pids, before, took, parseFloat(numbers[0][1]));
    await page.keyboard.up('d');
} finally {
    await browser.close();
    await server.stop();
}
