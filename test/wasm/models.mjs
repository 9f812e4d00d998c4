// models.mjs WASM MODELS: draws the models and bricks of test/wasm_models.c in WebAssembly, over and under a picture,
// and compares the hashes of frames with the native ones; then gives it blocks that are damaged.
import { fail, hashFrame, load, reader } from './support.mjs';

const [wasmPath, modelsPath] = process.argv.slice(2);
const wasm = await load(wasmPath);
const { word, doubles, bytes: bytesOf } = reader(modelsPath);
const BACKGROUND = 0xff306090, INSTANCES = 0x80000000, BRICKS = 0xc0000000, ARENA = 64 << 20;

function write(address, values) {
    const memory = new DataView(wasm.memory.buffer);
    values.forEach((v, i) => memory.setFloat64(address + 8 * i, v, true));
}

/** Hands a block over; what vd_wasm_model_add returns. */
function add(slot, block) {
    const room = wasm.vd_wasm_model_room(block.length);
    if (room === 0) {
        fail(`no room for a block of ${block.length} bytes`);
    }
    new Uint8Array(wasm.memory.buffer).set(block, room);
    return wasm.vd_wasm_model_add(slot, room, block.length);
}

const MOST = 8192;
const order = wasm.vd_wasm_scene_create(MOST, 65536);
if (wasm.vd_wasm_placed_create(ARENA) === 0) {
    fail('no memory for models');
}
const camera = wasm.vd_wasm_take(12 * 8), place = wasm.vd_wasm_take(20 * 8);
const blocks = Array.from({ length: word() }, () => bytesOf(word()));
blocks.forEach((block, slot) => {
    if (add(slot, block) !== 0) {
        fail(`model ${slot} was refused`);
    }
});
const brickBlocks = Array.from({ length: word() }, () => bytesOf(word()));

/** The same of a brick, whose origin stands at `place`. */
function addBrick(slot, block) {
    const room = wasm.vd_wasm_model_room(block.length);
    if (room === 0) {
        fail(`no room for a brick of ${block.length} bytes`);
    }
    new Uint8Array(wasm.memory.buffer).set(block, room);
    return wasm.vd_wasm_brick_add(slot, room, block.length, place);
}
write(place, doubles(16));
wasm.vd_wasm_light_set(place);
const frames = word();
let shown = 0, milliseconds = 0;
for (let frame = 0; frame < frames; frame++) {
    const width = word(), height = word(), stride = (width + 15) & ~15;
    const numbers = doubles(12);
    write(place, doubles(12));
    const opaque = new DataView(wasm.memory.buffer);
    [0, 1, 2, 3].forEach((i) => opaque.setInt32(place + 96 + 4 * i, 0, true));
    const pixels = wasm.vd_wasm_scene_add(0, 8, 8);
    wasm.vd_wasm_scene_place(0, place, place + 96, 0);
    new Uint8Array(wasm.memory.buffer).set(bytesOf(256), pixels);
    const behind = word(), count = word();
    const ordered = [];
    for (let i = 0; i < count; i++) {
        const model = word();
        write(place, doubles(17));
        if (wasm.vd_wasm_instance_add(i, model, place) === 0) {
            fail('an instance found no slot');
        }
        ordered.push(INSTANCES + i);
    }
    ordered.splice(behind, 0, 0);
    const bricks = word();
    for (let i = 0; i < bricks; i++) {
        const brick = word();
        write(place, doubles(3));
        if (addBrick(i, brickBlocks[brick]) !== 0) {
            fail(`brick ${brick} was refused`);
        }
        ordered.push(BRICKS + i);
    }
    const mark = wasm.vd_wasm_mark();
    const rgba = wasm.vd_wasm_take(4 * stride * height);
    const memory = new DataView(wasm.memory.buffer);
    write(camera, numbers);
    wasm.vd_wasm_fill(rgba, height, stride, BACKGROUND);
    const start = performance.now();
    ordered.forEach((n, i) => memory.setUint32(order + 4 * i, n, true));
    const drawn = wasm.vd_wasm_scene_draw(camera, rgba, width, height, stride, ordered.length, 0);
    milliseconds += performance.now() - start;
    const got = hashFrame(wasm.memory, rgba, width, height, stride);
    const placed = word(), low = word(), high = word();
    if (drawn !== placed + 1 || got !== ((BigInt(high) << 32n) | BigInt(low))) {
        fail(`frame ${frame} (${width}x${height}, ${count} instances, ${bricks} bricks): ${drawn} drawn of ` +
             `${placed} and a picture, hash ${got.toString(16)}`);
    }
    shown += drawn;
    wasm.vd_wasm_return(mark);
}
if (frames === 0 || shown < 2 * frames) {
    fail('too little happened');
}

// Thousands of balls around the eye, whose triangles all fill the screen: most of them are left out.
{
    const [width, height] = [320, 192];
    write(camera, [0, 0, 0, -Math.SQRT1_2, 0, 0, Math.SQRT1_2, 200, 200, 160, 96, 0.1]);
    write(place, [0, 0, 0, 500, 0, 0, 0, 500, 0, 0, 0, 500, 1, 0, 0, 0, 0]);
    wasm.vd_wasm_instance_add(0, 0, place);
    const mark = wasm.vd_wasm_mark(), rgba = wasm.vd_wasm_take(4 * width * height);
    for (const count of [MOST, 1]) {
        const memory = new DataView(wasm.memory.buffer);
        for (let i = 0; i < count; i++) {
            memory.setUint32(order + 4 * i, INSTANCES, true);
        }
        const start = performance.now();
        wasm.vd_wasm_scene_draw(camera, rgba, width, height, width, count, 0);
        console.log(`${count} models that fill the screen: ${(performance.now() - start).toFixed(0)} ms`);
        if (wasm.vd_wasm_scene_is_absurd() !== (count === 1 ? 0 : 1)) {
            fail(`${count} models that fill the screen are taken for sound, or not`);
        }
    }
    wasm.vd_wasm_return(mark);
}

// Damaged blocks are refused, and the room that they took is there again.
const text = (address) => {
    const bytes = new Uint8Array(wasm.memory.buffer, address, 300);
    return Buffer.from(bytes.slice(0, bytes.indexOf(0))).toString();
};
let seed = 1;
const random = (below) => (seed = Number((BigInt(seed) * 48271n) % 2147483647n)) % below;
for (let i = 0; i < 4000; i++) {
    const block = Uint8Array.from(blocks[i % blocks.length]);
    block[random(i % 2 === 0 ? 200 : block.length)] ^= 1 << random(8);
    const fault = add(i % 8, i % 3 === 0 ? block.subarray(0, random(block.length) + 1) : block);
    if (fault === 0 || (fault !== 1 && !text(fault).includes('damaged'))) {
        fail(`a damaged block was taken, or not told of: ${fault > 1 ? text(fault) : fault}`);
    }
}
for (let i = 0; i < 2000; i++) {
    const block = Uint8Array.from(brickBlocks[i % brickBlocks.length]);
    block[random(i % 2 === 0 ? 128 : block.length)] ^= 1 << random(8);
    const fault = addBrick(i % 8, i % 3 === 0 ? block.subarray(0, random(block.length) + 1) : block);
    if (fault === 0 || (fault !== 1 && !text(fault).includes('damaged'))) {
        fail(`a damaged brick was taken, or not told of: ${fault > 1 ? text(fault) : fault}`);
    }
}
wasm.vd_wasm_brick_remove(4e9);
const none = [wasm.vd_wasm_instance_add(1e9, 0, place), wasm.vd_wasm_instance_add(0, 1e9, place),
              wasm.vd_wasm_model_room(ARENA)];
if (none.some((result) => result !== 0)) {
    fail('an impossible instance or block found room');
}
wasm.vd_wasm_model_remove(4e9);
wasm.vd_wasm_instance_remove(4e9);
console.log(`${frames} frames of models and bricks: the same bytes, ${(milliseconds / frames).toFixed(2)} ms each`);
