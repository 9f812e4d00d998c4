// browser_support.mjs: a browser, and pictures that it kept.
import { existsSync, readFileSync } from 'node:fs';
import { inflateSync } from 'node:zlib';
import { chromium } from 'playwright-core';

const PROGRAMS = ['/usr/bin/chromium', '/usr/bin/chromium-browser', '/usr/bin/google-chrome'];

export function findBrowser() {
    return process.env.CHROMIUM ?? PROGRAMS.find(existsSync) ?? null;
}

export function launch() {
    return chromium.launch({ executablePath: findBrowser(),
                             args: ['--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage'] });
}

/** A page that fails the test for what it should not do: errors, requests elsewhere. `before` runs in it before its own. */
export async function openPage(browser, url, options = {}, before = null) {
    const context = await browser.newContext({ viewport: { width: 640, height: 360 },
                                               ignoreHTTPSErrors: true, acceptDownloads: true,
                                               ...options });
    const page = await context.newPage();
    if (before !== null) {
        await page.addInitScript(before);
    }
    const { host } = new URL(url);
    page.wrong = [];
    page.on('pageerror', (error) => page.wrong.push(String(error)));
    page.on('console', (message) => {
        if (/Content Security Policy|Uncaught/.test(message.text())) {
            page.wrong.push(message.text());
        }
    });
    page.on('request', (request) => {
        const other = new URL(request.url());
        if (/^(http|ws)/.test(other.protocol) && other.host !== host) {
            page.wrong.push(`asked for ${request.url()}`);
        }
    });
    await page.goto(url);
    return page;
}

export const stateIs = (page, state, timeout = 10000) => page.waitForFunction(
    (wanted) => document.documentElement.dataset.state === wanted, state, { timeout });

export const isExact = (page, timeout = 60000) => page.waitForFunction(
    () => document.documentElement.dataset.exact === 'true', null, { timeout });

/** Red, green and blue of a PNG of 8 bits, not interlaced. */
export function readPng(file) {
    const bytes = typeof file === 'string' ? readFileSync(file) : file;
    const width = bytes.readUInt32BE(16), height = bytes.readUInt32BE(20);
    const channels = { 2: 3, 6: 4 }[bytes[25]];
    const parts = [];
    for (let at = 8; at < bytes.length;) {
        const length = bytes.readUInt32BE(at);
        if (bytes.toString('latin1', at + 4, at + 8) === 'IDAT') {
            parts.push(bytes.subarray(at + 8, at + 8 + length));
        }
        at += 12 + length;
    }
    const data = inflateSync(Buffer.concat(parts));
    const row = width * channels;
    const pixels = Buffer.alloc(row * height);
    for (let y = 0; y < height; y++) {
        const filter = data[y * (row + 1)];
        for (let i = 0; i < row; i++) {
            const at = y * row + i;
            const left = i >= channels ? pixels[at - channels] : 0, up = y > 0 ? pixels[at - row] : 0;
            const corner = i >= channels && y > 0 ? pixels[at - row - channels] : 0;
            const p = left + up - corner;
            const [a, b, c] = [left, up, corner].map((v) => Math.abs(p - v));
            const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
            const guess = [0, left, up, (left + up) >> 1, paeth][filter];
            pixels[at] = data[y * (row + 1) + 1 + i] + guess;
        }
    }
    const rgb = Buffer.alloc(3 * width * height);
    for (let i = 0; i < width * height; i++) {
        pixels.copy(rgb, 3 * i, channels * i, channels * i + 3);
    }
    return { width, height, rgb, at: (x, y) => [...rgb.subarray(3 * (y * width + x),
                                                                3 * (y * width + x) + 3)] };
}

/** What the page shows, by its own button. */
export async function keepPicture(page) {
    const [download] = await Promise.all([page.waitForEvent('download'),
                                          page.locator('#tool-shot').click()]);
    const bytes = readFileSync(await download.path());
    return readPng(bytes);
}

export const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

/** Asks again and again until it is so. */
export async function until(call, what, seconds = 20) {
    for (const end = Date.now() + 1000 * seconds; Date.now() < end; await pause(50)) {
        if (await call()) {
            return;
        }
    }
    throw new Error(`it did not come about: ${what}`);
}
