// The page before `veduta serve`: VEDUTA names the program. Its still pictures are those of `veduta render`.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { fileURLToPath } from 'node:url';
import { isExact, keepPicture, launch, openPage, pause, readPng, stateIs, until } from
    './browser_support.mjs';
import { root } from './support.mjs';

const program = process.env.VEDUTA;
const heights = fileURLToPath(new URL('data/mont-blanc.png', root));
const dist = fileURLToPath(new URL('web/dist', root));
const VIEW = [heights, '--cell-size', '75', '--size', '480x270', '--haze', '60km', '--threads', '1'];
const folder = mkdtempSync(join(tmpdir(), 'veduta-web-'));
const context = { viewport: { width: 480, height: 270 } };
const servers = new Set();
let browser;

before(async () => { browser = await launch(); });
after(async () => {
    await browser.close();
    servers.forEach((server) => server.kill('SIGKILL'));
    rmSync(folder, { recursive: true });
});

/** Starts a server; returns its address and what ends it. */
async function serve(...options) {
    const child = spawn(program, ['serve', '-q', ...VIEW, '--root', dist, ...options],
                        { stdio: ['ignore', 'pipe', 'inherit'] });
    servers.add(child);
    const url = await new Promise((resolve, reject) => {
        child.stdout.once('data', (line) => resolve(String(line).trim()));
        child.once('exit', () => reject(new Error('the server ended')));
    });
    return { url, port: new URL(url).port, end: (signal) => new Promise((resolve) => {
        servers.delete(child);
        child.once('exit', resolve);
        child.kill(signal);
    }) };
}

function render(...options) {
    const file = join(folder, 'render.png');
    execFileSync(program, ['render', '-q', ...VIEW, ...options, '-o', file]);
    return readPng(file);
}

async function withServer(run, ...options) {
    const server = await serve('--port', '0', ...options);
    try {
        await run(server);
    } finally {
        await server.end('SIGKILL');
    }
}

test('still pictures are those of veduta render', () => withServer(async ({ url }) => {
    const page = await openPage(browser, url, { ...context, permissions: ['clipboard-read',
                                                                          'clipboard-write'] });
    await isExact(page);
    const first = await keepPicture(page);
    assert.ok(first.rgb.equals(render().rgb));
    await page.keyboard.down('w');
    await page.keyboard.down('d');
    await pause(600);
    await page.keyboard.up('d');
    await page.keyboard.up('w');
    await pause(1000);
    await isExact(page);
    const moved = await keepPicture(page);
    assert.ok(!moved.rgb.equals(first.rgb));
    await page.keyboard.press('Shift+C');
    const flags = await page.evaluate(() => navigator.clipboard.readText());
    assert.match(flags, /^--eye [-\d.,e]+ --heading [\d.e-]+ --pitch [-\d.e]+ --fov [\d.]+$/);
    const numbers = flags.split(' ').filter((_, i) => i % 2 === 1);
    assert.ok(moved.rgb.equals(render('--eye', numbers[0], `--heading=${numbers[1]}`,
                                      `--pitch=${numbers[2]}`, `--fov=${numbers[3]}`).rgb), flags);
    await page.keyboard.press('c'); // the link leads to the same view
    const link = await page.evaluate(() => navigator.clipboard.readText());
    const other = await openPage(browser, link, context);
    await isExact(other);
    assert.ok((await keepPicture(other)).rgb.equals(moved.rgb));
    await page.keyboard.press('0');
    await pause(500);
    await isExact(page);
    assert.ok((await keepPicture(page)).rgb.equals(first.rgb));
    assert.deepEqual([...page.wrong, ...other.wrong], []);
    await page.context().close();
    await other.context().close();
}));

test('every frame has pictures, whole screens too', () => withServer(async ({ url }) => {
    const page = await openPage(browser, url, context);
    await isExact(page);
    await page.keyboard.press('n');
    await page.keyboard.down('a');
    await pause(1500);
    await page.keyboard.up('a');
    const [frames] = await page.locator('#numbers-list dd').allTextContents();
    assert.ok(Number(frames) > 15, frames);
    await pause(500);
    await isExact(page);
    await page.keyboard.press('p');
    await page.selectOption('#mode', 'screens');
    await page.keyboard.press('Escape');
    await page.keyboard.down('d');
    await pause(500);
    await page.keyboard.up('d');
    await pause(500);
    await isExact(page);
    assert.equal(await page.evaluate(() => document.documentElement.dataset.state), 'showing');
    assert.deepEqual(page.wrong, []);
    await page.context().close();
}));

/** The share of pixels of a rectangle that differ by more than a little. */
function differing(a, b, [x0, y0, x1, y1]) {
    let count = 0;
    for (let y = y0; y < y1; y++) {
        for (let x = x0; x < x1; x++) {
            const p = a.at(x, y), q = b.at(x, y);
            count += p.some((v, i) => Math.abs(v - q[i]) > 8) ? 1 : 0;
        }
    }
    return count / ((x1 - x0) * (y1 - y0));
}

test('furniture stands still while the world moves', () => withServer(async ({ url }) => {
    const page = await openPage(browser, url, context);
    await isExact(page);
    const before = await keepPicture(page);
    await page.keyboard.down('w');
    await pause(700);
    const moving = await keepPicture(page);
    await page.keyboard.up('w');
    const bar = [462, 190, 468, 258], beside = [120, 100, 360, 200];
    assert.ok(differing(before, moving, beside) > 0.2, String(differing(before, moving, beside)));
    assert.ok(differing(before, moving, bar) < 0.02, String(differing(before, moving, bar)));
    assert.deepEqual(page.wrong, []);
    await page.context().close();
}, '--legend', '--title', 'Mont Blanc', '--north-arrow', '--scale-bar'));

test('the eye keeps above the ground', () => withServer(async ({ url }) => {
    const [bare, token] = url.split('#token=');
    const answer = await fetch(`${bare}world.json`, { headers: { Authorization: `Bearer ${token}` } });
    const { bounds: { min, max } } = await answer.json();
    const over = [(min[0] + max[0]) / 2, (min[1] + max[1]) / 2, max[2] + 500, 30, -20, 60];
    const page = await openPage(browser, `${url}&camera=${over}`, { ...context, permissions: ['clipboard-read',
                                                                          'clipboard-write'] });
    await isExact(page);
    const eye = async () => {
        await page.keyboard.press('Shift+C');
        const flags = await page.evaluate(() => navigator.clipboard.readText());
        return flags.split(' ')[1].split(',').map(Number);
    };
    await page.keyboard.down('f'); // down
    let z = (await eye())[2];
    await until(async () => {
        const before = z;
        await pause(500); // the page says where it is every fifth of a second
        z = (await eye())[2];
        return z === before;
    }, 'an end of the fall', 60);
    await page.keyboard.up('f');
    assert.ok(z > min[2] && z < max[2], `${z} m`);
    let low = z, rose = 0;
    for (let leg = 0; leg < 8 && rose < 50; leg++) { // somewhere there is a slope
        await page.keyboard.down('w');
        await pause(800);
        await page.keyboard.up('w');
        await page.keyboard.down('f'); // held down to the ground all the while
        await pause(1200);
        await page.keyboard.up('f');
        await page.keyboard.down('d');
        await pause(700);
        await page.keyboard.up('d');
        const [, , height] = await eye();
        rose = Math.max(rose, height - low);
        low = Math.min(low, height);
    }
    assert.ok(rose >= 50, `it rose by ${rose} m`);
    assert.deepEqual(page.wrong, []);
    await page.context().close();
}));

test('a server that is killed and started again', async () => {
    const first = await serve('--port', '0', '--token', 'one-and-the-same');
    const page = await openPage(browser, first.url, context);
    await isExact(page);
    const before = await keepPicture(page);
    await first.end('SIGKILL');
    await stateIs(page, 'lost');
    assert.ok((await keepPicture(page)).rgb.equals(before.rgb)); // it stays
    const second = await serve('--port', first.port, '--token', 'one-and-the-same');
    await stateIs(page, 'showing', 30000);
    await page.keyboard.down('d');
    await pause(300);
    await page.keyboard.up('d');
    await pause(500);
    await page.keyboard.press('0');
    await pause(500);
    await isExact(page);
    assert.ok((await keepPicture(page)).rgb.equals(before.rgb));
    await second.end('SIGTERM'); // it says that it stops
    await stateIs(page, 'lost');
    assert.deepEqual(page.wrong, []);
    await page.context().close();
});

test('tokens, tabs, and one client too many', () => withServer(async ({ url }) => {
    const bare = url.split('#')[0];
    for (const address of [bare, `${bare}#token=wrong`]) {
        const page = await openPage(browser, address, context);
        await stateIs(page, 'refused');
        assert.ok(await page.locator('#token').isVisible());
        await page.context().close();
    }
    const one = await openPage(browser, url, context);
    await isExact(one);
    const two = await openPage(browser, url, { viewport: { width: 200, height: 300 } });
    await isExact(two);
    const three = await openPage(browser, url, context);
    await until(async () => (await three.textContent('#notice-text')).includes('Next try'), 'a wait');
    await one.keyboard.down('d');
    await pause(300);
    await one.keyboard.up('d');
    await pause(500);
    await isExact(one);
    const [first, second] = [await keepPicture(one), await keepPicture(two)];
    assert.deepEqual([first.width, second.width], [480, 200]);
    for (const page of [one, two, three]) {
        assert.deepEqual(page.wrong, []);
        await page.context().close();
    }
}, '--max-clients', '2'));

test('encrypted', async () => {
    const [key, certificate] = ['key.pem', 'certificate.pem'].map((name) => join(folder, name));
    execFileSync('openssl', ['req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '2', '-subj',
                             '/CN=localhost', '-keyout', key, '-out', certificate],
                 { stdio: 'ignore' });
    await withServer(async ({ url }) => {
        assert.ok(url.startsWith('https://'));
        const page = await openPage(browser, url, context);
        await isExact(page);
        assert.deepEqual(page.wrong, []);
        await page.context().close();
    }, '--tls', certificate, '--tls-key', key);
});
