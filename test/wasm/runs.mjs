// runs.mjs WASM RUNS: unpacks the run-length pictures of test/wasm_runs.c in WebAssembly and compares them
// with what the native decoder made of the same bytes.
import { readFileSync } from 'node:fs';

const [wasmPath, runsPath] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(wasmPath), {});
const wasm = instance.exports;
const file = readFileSync(runsPath);
const view = new DataView(file.buffer, file.byteOffset, file.length);
let at = 0;
let pictures = 0;
let sound = 0;
while (at < file.length) {
    const [width, height, bytes, good] = [0, 1, 2, 3].map((i) => view.getUint32(at + 4 * i, true));
    const size = 4 * width * height;
    at += 16;
    const mark = wasm.vd_wasm_mark();
    const data = wasm.vd_wasm_take(bytes + 1);
    const rgba = wasm.vd_wasm_take(size);
    const memory = new Uint8Array(wasm.memory.buffer);
    memory.set(file.subarray(at, at + bytes), data);
    at += Math.ceil(bytes / 4) * 4;
    const wrong = wasm.vd_wasm_unpack_runs(data, bytes, width, height, rgba, width);
    if ((wrong === 0) !== (good === 1)) {
        throw new Error(`picture ${pictures}: ${good ? 'refused' : 'taken'}`);
    }
    if (good) {
        const unpacked = memory.subarray(rgba, rgba + size);
        if (Buffer.compare(file.subarray(at, at + size), unpacked) !== 0) {
            throw new Error(`picture ${pictures} differs`);
        }
        at += size;
        sound++;
    }
    wasm.vd_wasm_return(mark);
    pictures++;
}
console.log(`${pictures} run-length pictures alike, ${sound} of them sound`);
if (sound < 100 || sound === pictures) {
    throw new Error('too few of one kind');
}
