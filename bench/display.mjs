// display.mjs SCENES WASM…: how fast builds of src/display in WebAssembly blend the scenes of
// bench/display.c, on one thread, beside the native v2 of the same vectors. Builds take turns, and each
// one's fastest drawing counts, so that a shared machine tells them apart.
import { readFileSync } from 'node:fs';
import { basename } from 'node:path';

const [scenesPath, ...paths] = process.argv.slice(2);
const WORDS = 21, TURNS = 200;
const file = readFileSync(scenesPath);
const view = new DataView(file.buffer, file.byteOffset, file.length);

const builds = await Promise.all(paths.map(async (path) => {
    const { instance } = await WebAssembly.instantiate(readFileSync(path), {});
    return { name: basename(path), wasm: instance.exports };
}));

/** Puts a scene into a build's memory; returns what draws it. */
function lay({ wasm }, { width, height, quads, texels }, at) {
    const frame = wasm.vd_wasm_take(4 * width * height);
    const list = wasm.vd_wasm_take(4 * WORDS * quads);
    const pictures = wasm.vd_wasm_take(4 * texels);
    const bytes = new Uint8Array(wasm.memory.buffer), words = new DataView(wasm.memory.buffer);
    bytes.fill(0, frame, frame + 4 * width * height);
    bytes.set(file.subarray(at, at + 4 * WORDS * quads), list);
    bytes.set(file.subarray(at + 4 * WORDS * quads, at + 4 * (WORDS * quads + texels)), pictures);
    for (let i = 0; i < quads; i++) {
        const address = list + 4 * (WORDS * i + 12);
        words.setUint32(address, pictures + 4 * words.getUint32(address, true), true);
    }
    return () => wasm.vd_wasm_draw(frame, width, height, width, list, quads, 0.01, 0);
}

let at = 4;
for (let scene = view.getUint32(0, true); scene > 0; scene--) {
    const [width, height, quads, texels, blended, native] =
        [0, 1, 2, 3, 4, 5].map((i) => view.getUint32(at + 4 * i, true));
    const name = file.toString('latin1', at + 24, at + 40).replace(/\0.*/, '');
    at += 40;
    const marks = builds.map(({ wasm }) => wasm.vd_wasm_mark());
    const draws = builds.map((build) => lay(build, { width, height, quads, texels }, at));
    at += 4 * (WORDS * quads + texels);
    const best = builds.map(() => Infinity);
    for (let turn = 0; turn < TURNS; turn++) {
        draws.forEach((draw, i) => {
            const start = performance.now();
            draw();
            best[i] = Math.min(best[i], performance.now() - start);
        });
    }
    builds.forEach(({ wasm }, i) => wasm.vd_wasm_return(marks[i]));
    console.log(`${name.padEnd(14)}` + builds.map((build, i) =>
        ` ${build.name}: ${best[i].toFixed(2)} ms, ${(blended / best[i] / 1000).toFixed(0)} M/s, ` +
        `${(blended / best[i] * 100 / native).toFixed(0)} % of native v2`).join(';'));
}
