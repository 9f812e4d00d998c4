// display.mjs WASM SCENES [--bench]: draws the scenes of test/wasm_scenes.c in WebAssembly and compares
// the hashes with the native ones. --bench also measures blended pixels per second.
import { readFileSync } from 'node:fs';

const [wasmPath, scenesPath, option] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(wasmPath), {});
const wasm = instance.exports;
const WORDS = 21;

function take(bytes) {
    const at = wasm.vd_wasm_take(bytes);
    if (at === 0) {
        throw new Error(`no memory for ${bytes} bytes`);
    }
    return at;
}

const stride = (width) => (width + 15) & ~15;

// FNV-1a, 64 bits, of the rows without padding, in four words of 16 bits.
function hash(bytes, at, width, height) {
    let [a, b, c, d] = [0x2325, 0x8422, 0x9ce4, 0xcbf2];
    for (let y = 0; y < height; y++) {
        const row = at + 4 * stride(width) * y;
        for (let i = row; i < row + 4 * width; i++) {
            a ^= bytes[i];
            // times 0x100000001b3: 0x1b3, and 256 two words up
            const p = a * 0x1b3, q = b * 0x1b3, r = c * 0x1b3 + a * 256, s = d * 0x1b3 + b * 256;
            const q2 = q + Math.floor(p / 65536), r2 = r + Math.floor(q2 / 65536);
            const s2 = s + Math.floor(r2 / 65536);
            [a, b, c, d] = [p & 0xffff, q2 & 0xffff, r2 & 0xffff, s2 & 0xffff];
        }
    }
    return [(a | (b << 16)) >>> 0, (c | (d << 16)) >>> 0];
}

const file = readFileSync(scenesPath);
const view = new DataView(file.buffer, file.byteOffset, file.length);
let at = 4;
let wrong = 0;
const count = view.getUint32(0, true);
const mark = wasm.vd_wasm_mark();
for (let scene = 0; scene < count; scene++) {
    const word = (i) => view.getUint32(at + 4 * i, true);
    const [width, height, background, quads, texels] = [0, 1, 2, 3, 4].map(word);
    const expected = [word(5), word(6)];
    at += 28;
    const frame = take(4 * stride(width) * height);
    const list = take(4 * WORDS * quads);
    const pictures = take(4 * texels);
    const bytes = new Uint8Array(wasm.memory.buffer);
    const words = new DataView(wasm.memory.buffer);
    bytes.set(file.subarray(at, at + 4 * WORDS * quads), list);
    at += 4 * WORDS * quads;
    bytes.set(file.subarray(at, at + 4 * texels), pictures);
    at += 4 * texels;
    for (let i = 0; i < quads; i++) {
        const address = list + 4 * (WORDS * i + 12);
        words.setUint32(address, pictures + 4 * words.getUint32(address, true), true);
    }
    for (const hidden of [0, 1]) {
        const now = new DataView(wasm.memory.buffer);
        for (let i = 0; i < stride(width) * height; i++) {
            now.setUint32(frame + 4 * i, background, true);
        }
        const unsound = wasm.vd_wasm_draw(frame, width, height, stride(width), list, quads,
                                          0.01, hidden);
        const got = hash(new Uint8Array(wasm.memory.buffer), frame, width, height);
        if (unsound !== 0 || got[0] !== expected[0] || got[1] !== expected[1]) {
            console.error(`scene ${scene} (${width}x${height}, ${quads} quads, hidden ${hidden}): ` +
                          `hash ${got} instead of ${expected}, ${unsound} unsound`);
            wrong++;
        }
    }
    wasm.vd_wasm_return(mark);
}
if (count === 0 || wrong > 0) {
    console.error(`${wrong} of ${2 * count} frames differ`);
    process.exit(1);
}
console.log(`${count} scenes: the same bytes`);

// A quad that reads what is not there is left out.
{
    const frame = take(4 * 16 * 4);
    const list = take(4 * WORDS);
    const words = new DataView(wasm.memory.buffer);
    words.setFloat32(list, NaN, true);
    if (wasm.vd_wasm_draw(frame, 16, 4, 16, list, 1, 0.01, 0) !== 1) {
        console.error('a quad with a NaN corner was drawn');
        process.exit(1);
    }
    wasm.vd_wasm_return(mark);
}

// A turned half-transparent picture of 512x512 over 1280x720.
if (option === '--bench') {
    const [width, height, side, layers] = [1280, 720, 512, 1];
    const frame = take(4 * width * height);
    const list = take(4 * WORDS * layers);
    const picture = take(4 * side * side);
    new Uint8Array(wasm.memory.buffer).fill(100, picture, picture + 4 * side * side);
    const words = new DataView(wasm.memory.buffer);
    for (let i = 0; i < layers; i++) {
        const corners = [[40 + i, 20, 1], [1240, 60, 1.2], [1200, 700, 1.1], [0, 0, 0]];
        const p = corners.map(([x, y, w]) => [x * w, y * w, w]);
        p[3] = [0, 1, 2].map((k) => p[0][k] + p[2][k] - p[1][k]);
        p.flat().forEach((v, k) => words.setFloat32(list + 4 * (WORDS * i + k), v, true));
        [picture, side, side, side, 0, 0, 0, 0, 255].forEach(
            (v, k) => words.setUint32(list + 4 * (WORDS * i + 12 + k), v, true));
    }
    new Uint8Array(wasm.memory.buffer).fill(0, frame, frame + 4 * width * height);
    wasm.vd_wasm_draw(frame, width, height, width, list, 1, 0.01, 0);
    const bytes = new Uint8Array(wasm.memory.buffer); // anew: drawing may take memory
    let pixels = 0;
    for (let i = 0; i < width * height; i++) {
        pixels += bytes[frame + 4 * i + 3] > 0 ? 1 : 0;
    }
    const times = [];
    for (let run = 0; run < 300; run++) {
        const start = performance.now();
        wasm.vd_wasm_draw(frame, width, height, width, list, 1, 0.01, 0);
        times.push(performance.now() - start);
    }
    times.sort((x, y) => x - y);
    const rate = (ms) => (pixels / ms / 1000).toFixed(0);
    console.log(`${rate(times[150])} M blended pixels/s at the median, ${rate(times[0])} at best, ` +
                'one thread');
}
