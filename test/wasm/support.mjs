// support.mjs: what the tests of WebAssembly share: the module, the numbers of a file of scenes, hashes.
import { readFileSync } from 'node:fs';

export async function load(path) {
    const { instance } = await WebAssembly.instantiate(readFileSync(path), {});
    return instance.exports;
}

/** Reads a file of little-endian numbers from its beginning on. */
export function reader(path) {
    const file = readFileSync(path);
    const view = new DataView(file.buffer, file.byteOffset, file.length);
    let at = 0;
    const word = () => view.getUint32((at += 4) - 4, true);
    const double = () => view.getFloat64((at += 8) - 8, true);
    const doubles = (count) => Array.from({ length: count }, double);
    const bytes = (count) => file.subarray(at, at += count);
    return { word, doubles, bytes };
}

/** FNV-1a 64 of the rows of a frame in memory, without padding. */
export function hashFrame(memory, rgba, width, height, stride) {
    let h = 0xcbf29ce484222325n;
    for (let row = 0; row < height; row++) {
        const from = rgba + 4 * stride * row;
        for (const byte of new Uint8Array(memory.buffer, from, 4 * width)) {
            h = BigInt.asUintN(64, (h ^ BigInt(byte)) * 0x100000001b3n);
        }
    }
    return h;
}

export function fail(text) {
    console.error(text);
    process.exit(1);
}
