// path.bench.mjs WORLD X,Y,Z [SECONDS] [WIDTHxHEIGHT] [BYTES_PER_S] [ROUND_TRIP_MS]: what the page shows of a world that
// `veduta serve` has, over a slower link, while its camera goes round a place as in data/paths/orbit.json: in Chromium
// on one core, the server on the other. Frames a second, and what each thread of the browser takes.
//
//   script/build-web && node web/test/path.bench.mjs cloud.json -430,12640,1100 15 1280x720 10e6 50
import { spawn } from 'node:child_process';
import { connect, createServer } from 'node:net';
import { launch, openPage, pause, stateIs } from './browser_support.mjs';
import { bindBrowser, numbersOf, printThreads, threadTimes } from './page_numbers.mjs';

const PROGRAM = process.env.VEDUTA ?? 'build/release/veduta';
const [world, place, secondsText, sizeText, bytesText, tripText] = process.argv.slice(2);
if (place === undefined) {
    console.error('usage: path.bench.mjs WORLD X,Y,Z [SECONDS] [WIDTHxHEIGHT] [BYTES_PER_S] [ROUND_TRIP_MS]');
    process.exit(1);
}
const centre = place.split(',').map(Number);
const seconds = Number(secondsText ?? 15);
const [width, height] = (sizeText ?? '1280x720').split('x').map(Number);
const rate = Number(bytesText ?? 10e6), trip = Number(tripText ?? 50);
const RADIUS = 1200, HEIGHT = 450, TURN_S = 30, FOV = 50;
const ROOM = 65536; // of a router

/** One way of a link: bytes leave one after the other and arrive half a round trip later. */
function carry(from, to) {
    let free = 0, under = 0;
    from.on('data', (chunk) => {
        const now = performance.now();
        free = Math.max(free, now) + 1000 * chunk.length / rate;
        under += chunk.length;
        if (under > ROOM) { from.pause(); }
        setTimeout(() => {
            under -= chunk.length;
            if (under <= ROOM) { from.resume(); }
        }, free - now);
        setTimeout(() => to.write(chunk), free - now + trip / 2);
    });
    from.on('close', () => to.destroy());
    from.on('error', () => to.destroy());
}

function relay(port) {
    return new Promise((resolve) => {
        const server = createServer({ highWaterMark: 16384, noDelay: true }, (near) => {
            const far = connect({ port, host: '127.0.0.1', noDelay: true });
            carry(near, far);
            carry(far, near);
        });
        server.listen(0, '127.0.0.1', () => resolve(server));
    });
}

/** Starts the server on core 0; resolves to its address. */
function serve() {
    const child = spawn('taskset', ['-c', '0', PROGRAM, 'serve', world, '--port', '0', '-q'],
                        { stdio: ['ignore', 'pipe', 'inherit'] });
    return new Promise((resolve, reject) => {
        child.stdout.on('data', (text) => {
            const found = /http:\/\/127\.0\.0\.1:(\d+)\/#token=(\S+)/.exec(String(text));
            if (found) { resolve({ child, port: Number(found[1]), token: found[2] }); }
        });
        child.on('exit', (status) => reject(new Error(`veduta serve ended with ${status}`)));
    });
}

const { child, port, token } = await serve();
let link, browser;
try {
    link = await relay(port);
    browser = await launch();
    const page = await openPage(browser, `http://127.0.0.1:${link.address().port}/` +
                                `#token=${token}`, { viewport: { width, height } },
                                () => { // what draws is told the camera itself: an address costs 2 ms
        const Own = window.Worker;
        window.workers = [];
        window.Worker = class extends Own {
            constructor(...all) {
                super(...all);
                window.workers.push([String(all[0]), this]);
            }
        };
    });
    await stateIs(page, 'showing', 120000);
    const pids = bindBrowser(child.pid);
    await page.keyboard.press('n');
    await page.keyboard.down('d'); // it moves, to the page: by a degree, until the next of the path
    await page.evaluate(([centre, radius, high, turn, fov]) => {
        const [, display] = window.workers.find(([address]) => address.includes('display'));
        const start = performance.now();
        const step = () => {
            const angle = 2 * Math.PI * (performance.now() - start) / 1000 / turn;
            const eye = [centre[0] + radius * Math.sin(angle), centre[1] + radius * Math.cos(angle),
                         centre[2] + high];
            display.postMessage({ to: 'pose', pose: {
                eye, heading: (angle * 180 / Math.PI + 180) % 360,
                pitch: -Math.atan2(high, radius) * 180 / Math.PI, roll: 0, fov } });
            requestAnimationFrame(step);
        };
        step();
    }, [centre, RADIUS, HEIGHT, TURN_S, FOV]);
    await pause(3000);
    const before = threadTimes(pids), start = performance.now();
    let frames = 0;
    for (let i = 0; i < seconds; i++) {
        await pause(1000);
        const numbers = await numbersOf(page, 7);
        frames += parseFloat(numbers[0][1]) / seconds;
        console.log(`${width}x${height}: ${numbers.map((one) => one.join(' ')).join(', ')}`);
    }
    const took = (performance.now() - start) / 1000;
    if (process.env.SHOT) { await page.screenshot({ path: process.env.SHOT }); }
    console.log(`${frames.toFixed(1)} frames a second on average`);
    printThreads(pids, before, took, frames);
} finally {
    await browser?.close();
    link?.close();
    child.removeAllListeners('exit');
    child.kill('SIGINT');
}
