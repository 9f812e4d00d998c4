// scene.mjs WASM WORLDS: keeps the pictures of test/wasm_worlds.c in a scene in WebAssembly, whose heap is
// too small to be careless with, and compares cameras and the hashes of frames with the native ones.
import { fail, hashFrame, load, reader } from './support.mjs';

const [wasmPath, worldsPath] = process.argv.slice(2);
const wasm = await load(wasmPath);
const { word, doubles, bytes: bytesOf } = reader(worldsPath);
const BACKGROUND = 0xff306090;

const frames = word(), slots = word(), heap = word();
const order = wasm.vd_wasm_scene_create(slots, heap);
const camera = wasm.vd_wasm_take(12 * 8), place = wasm.vd_wasm_take(16 * 8);
let moved = 0, shown = 0;
const addresses = new Map();
for (let frame = 0; frame < frames; frame++) {
    for (let changes = word(); changes > 0; changes--) {
        const slot = word(), width = word();
        if (width === 0) {
            wasm.vd_wasm_scene_remove(slot);
            continue;
        }
        const height = word();
        const memory = new DataView(wasm.memory.buffer);
        for (let i = 0; i < 4; i++) {
            memory.setInt32(place + 96 + 4 * i, word(), true);
        }
        doubles(12).forEach((v, i) => memory.setFloat64(place + 8 * i, v, true));
        const pixels = wasm.vd_wasm_scene_add(slot, width, height);
        if (pixels === 0) {
            fail(`frame ${frame}: no room in slot ${slot} for ${width}x${height}, ` +
                 `${wasm.vd_wasm_scene_bytes()} of ${heap} bytes are used`);
        }
        wasm.vd_wasm_scene_place(slot, place, place + 96, 0);
        new Uint8Array(wasm.memory.buffer).set(bytesOf(4 * width * height), pixels);
        moved += addresses.get(slot) === pixels ? 0 : 1;
        addresses.set(slot, pixels);
    }
    const count = word();
    const numbers = Array.from({ length: count }, word);
    const width = word(), height = word();
    const [x, y, z, heading, pitch, roll, fov, near] = doubles(8);
    const aimed = doubles(8);
    const stride = (width + 15) & ~15;
    const mark = wasm.vd_wasm_mark();
    const rgba = wasm.vd_wasm_take(4 * stride * height);
    const memory = new DataView(wasm.memory.buffer);
    numbers.forEach((n, i) => memory.setUint32(order + 4 * i, n, true));
    [x, y, z].forEach((v, i) => memory.setFloat64(camera + 8 * i, v, true));
    memory.setFloat64(camera + 88, near, true);
    wasm.vd_wasm_camera_aim(camera, heading, pitch, roll, fov, width, height);
    aimed.forEach((v, i) => {
        if (memory.getFloat64(camera + 24 + 8 * i, true) !== v) {
            fail(`frame ${frame}: number ${i} of the camera is another one`);
        }
    });
    wasm.vd_wasm_fill(rgba, height, stride, BACKGROUND);
    const drawn = wasm.vd_wasm_scene_draw(camera, rgba, width, height, stride, count, 0);
    const got = hashFrame(wasm.memory, rgba, width, height, stride);
    const placed = word(), low = word(), high = word();
    if (drawn !== placed || got !== ((BigInt(high) << 32n) | BigInt(low))) {
        fail(`frame ${frame} (${width}x${height}, ${count} shown): ${drawn} drawn of ${placed}, ` +
             `hash ${got.toString(16)}`);
    }
    shown += drawn;
    wasm.vd_wasm_return(mark);
}
if (frames === 0 || shown < frames || moved < frames) {
    fail('too little happened');
}

// What a page would never ask for.
const none = [wasm.vd_wasm_scene_add(slots, 4, 4), wasm.vd_wasm_scene_add(0, 1, 4),
              wasm.vd_wasm_scene_add(0, 60000, 60000), wasm.vd_wasm_scene_create(0, 4096)];
if (none.some((address) => address !== 0)) {
    fail('an impossible picture found room');
}
wasm.vd_wasm_scene_remove(4e9);
console.log(`${frames} frames of a scene of ${slots} slots: the same cameras and bytes`);
