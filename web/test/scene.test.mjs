// What is kept and shown, whatever a server asks for.
import assert from 'node:assert/strict';
import test from 'node:test';
import { Motion, clearGround, groundAt, move, turn } from '../generated/modules/motion.js';
import { Scene } from '../generated/modules/scene.js';
import { formatFragment, parseFragment } from '../generated/modules/share.js';
import { makeWasm, randomFrom } from './support.mjs';

const ids = (...list) => BigUint64Array.from(list.map(BigInt));
const camera = () => ({ eye: [0, 0, 0], orientation: [0, 0, 0, 1], lens: [1, 1, 0, 0], near: 0.1,
                        width: 64, height: 48 });

function picture(id, version, color, side = 8, y = 10) {
    const corners = Float64Array.of(-99, y, 99, 99, y, 99, 99, y, -99, -99, y, -99);
    return { kind: 'impostor', id: BigInt(id), version, corners, opaque: [], width: side, height: side,
             pixels: Uint8Array.from({ length: 4 * side * side }, (_, i) => [...color, 255][i % 4]) };
}

async function begin(bytes = 1 << 20) {
    const wasm = await makeWasm();
    const scene = new Scene(wasm, bytes);
    scene.resize(64, 48);
    const looking = camera();
    scene.aim(looking, 0, 0, 0, 60);
    /** The colour in the middle. */
    const see = (from = looking, screens = false) => {
        const f = scene.draw(from, screens, false);
        const at = f.at + 4 * (f.stride * (f.height >> 1) + (f.width >> 1));
        return [...new Uint8Array(wasm.memory.buffer, at, 3)];
    };
    return { wasm, scene, looking, see };
}

const BACKGROUND = [0x28, 0x2c, 0x33];

test('orders, versions, drops and replacements', async () => {
    const { scene, see } = await begin();
    assert.ok(scene.isEmpty);
    assert.equal(scene.apply([picture(1, 1, [10, 20, 30]), picture(2, 1, [40, 50, 60])]).length, 0);
    assert.deepEqual(see(), BACKGROUND); // not shown until ordered
    scene.apply([{ kind: 'order', ids: ids(1, 2, 77) }]);
    assert.deepEqual(see(), [40, 50, 60]);
    assert.equal(scene.shown, 2); // 77 is left out
    scene.apply([picture(2, 2, [70, 80, 90])]);
    assert.deepEqual(see(), [70, 80, 90]);
    scene.apply([picture(3, 1, [1, 2, 3]), { kind: 'replace', out: ids(1), in: ids(3) }]);
    assert.deepEqual(see(), [70, 80, 90]); // it took the place behind
    scene.apply([{ kind: 'drop', ids: ids(2, 9) }]);
    assert.deepEqual(see(), [1, 2, 3]);
    assert.deepEqual(scene.heldIds(), { ids: ids(1, 3), versions: [1, 1] });
    scene.apply([{ kind: 'replace', out: ids(5), in: ids(1) }]);
    assert.deepEqual(see(), [10, 20, 30]); // in front, where nothing makes way
});

/** The models of test/wasm_models.c are native; here their places and fates are tested. */
const model = (id, version, bytes) => (
    { kind: 'model', id: BigInt(id), version, block: new Uint8Array(bytes) });
const instance = (id, of, numbers = {}) => (
    { kind: 'instance', id: BigInt(id), version: 1, model: BigInt(of),
      numbers: Float64Array.from({ length: 17 }, (_, i) => numbers[i] ?? 0) });

test('models and instances: damaged, too large, too many, without each other', async () => {
    const { scene, see } = await begin();
    assert.throws(() => scene.apply([model(70, 1, 512)]), /damaged/);
    assert.throws(() => scene.apply([model(70, 1, 1)]), /damaged/);
    assert.deepEqual([...scene.apply([model(70, 1, 300000)])], [70n]); // more than its share
    assert.equal(scene.heldBytes, 0);
    scene.apply([picture(1, 1, [10, 20, 30]), instance(2, 70), instance(3, 71),
                 { kind: 'light', numbers: new Float64Array(16) },
                 { kind: 'order', ids: ids(2, 1, 3, 70) }]);
    assert.deepEqual(see(), [10, 20, 30]);
    assert.equal(scene.shown, 1); // their models have not come
    assert.equal(scene.heldIds().ids.length, 3);
    const before = scene.heldBytes;
    scene.apply([{ kind: 'drop', ids: ids(2, 3) }]);
    assert.equal(scene.heldBytes, before - 512);
    const many = Array.from({ length: 17000 }, (_, i) => instance(100 + i, 70));
    assert.equal(scene.apply(many).length, 17000 - 16384);
    assert.equal(scene.apply([{ kind: 'drop', ids: scene.heldIds().ids }]).length, 0);
    assert.equal(scene.heldBytes, 0);
    const named = Array.from({ length: 5000 }, (_, i) => instance(1 + i, 1e6 + i));
    assert.ok(scene.apply(named).length >= 5000 - 4096);
    scene.apply([picture(1, 1, [7, 8, 9]), { kind: 'order', ids: ids(1) }]); // now it is a picture
    assert.deepEqual(see(), [7, 8, 9]);
});

const brick = (id, version, bytes) => (
    { kind: 'brick', id: BigInt(id), version, origin: Float64Array.of(1, 2, 3),
      block: new Uint8Array(bytes) });

test('bricks: damaged, too large, in the place of something else', async () => {
    const { scene, see } = await begin();
    assert.throws(() => scene.apply([brick(70, 1, 512)]), /damaged/);
    assert.throws(() => scene.apply([brick(70, 1, 1)]), /damaged/);
    assert.deepEqual([...scene.apply([brick(70, 1, 300000)])], [70n]); // more than its share
    assert.equal(scene.heldBytes, 0);
    scene.apply([picture(1, 1, [10, 20, 30]), { kind: 'order', ids: ids(70, 1) }]);
    assert.deepEqual(see(), [10, 20, 30]);
    assert.equal(scene.shown, 1);
    assert.throws(() => scene.apply([brick(1, 2, 512)]), /damaged/); // the picture is given up
    assert.deepEqual(see(), BACKGROUND);
});

test('what does not fit is given up, what is shown last', async () => {
    const { scene, see } = await begin(1 << 20);
    scene.apply([picture(1, 1, [9, 9, 9], 256), { kind: 'order', ids: ids(1) }]);
    let dropped = [];
    for (let id = 2; id < 40; id++) {
        dropped.push(...scene.apply([picture(id, 1, [id, id, id], 256)]));
    }
    assert.ok(scene.heldBytes <= 1.25 * (1 << 20));
    assert.ok(dropped.length > 30 && !dropped.includes(1n));
    assert.deepEqual(see(), [9, 9, 9]);
    const huge = picture(50, 1, [5, 5, 5], 2);
    huge.width = huge.height = 2000;
    huge.pixels = new Uint8Array(4 * 2000 * 2000);
    dropped = [...scene.apply([huge])];
    assert.ok(dropped.includes(50n) && !dropped.includes(1n));
    assert.equal(scene.apply([{ ...picture(1, 2, [8, 8, 8], 256), width: 4000, height: 4000,
                                pixels: new Uint8Array(0) }]).includes(1n), true);
    assert.deepEqual(see(), BACKGROUND);
});

test('an order that names a picture too often does not hold up frames', async () => {
    const { scene, see } = await begin();
    const glass = picture(1, 1, [10, 20, 30]);
    glass.pixels.forEach((_, i, all) => { all[i] = 20; });
    scene.apply([glass, { kind: 'order', ids: new BigUint64Array(900).fill(1n) }]);
    see();
    assert.equal(scene.shown, 64);
    assert.ok(!scene.absurd && !scene.isEmpty);
    scene.apply([{ kind: 'order', ids: new BigUint64Array(65536).fill(1n) }]);
    see();
    assert.equal(scene.shown, 64);
    assert.ok(scene.absurd && scene.isEmpty); // it is not tried again
    scene.apply([{ kind: 'order', ids: ids(1, 1) }]);
    see();
    assert.equal(scene.shown, 2);
});

test('a batch of a thousand replacements of a long order is refused', async () => {
    const { scene } = await begin();
    const long = new BigUint64Array(65536).map((_, i) => 100n + BigInt(i));
    const one = { kind: 'replace', out: ids(1), in: ids(2) };
    scene.apply([{ kind: 'order', ids: long }, ...Array(60).fill(one)]);
    assert.throws(() => scene.apply(Array(1000).fill(one)), /too many replacements/);
});

test('what is behind the eye, or beside the picture, does not use up what a frame may have', async () => {
    const { scene, see } = await begin();
    const behind = picture(1, 1, [10, 20, 30], 8, -10);
    const beside = { ...picture(2, 1, [10, 20, 30]), // through the near plane
                     corners: Float64Array.of(-99, -9, 9, -99, 9, 9, -99, 9, -9, -99, -9, -9) };
    const order = new BigUint64Array(60001).map((_, i) => i < 60000 ? 1n + BigInt(i & 1) : 3n);
    scene.apply([behind, beside, picture(3, 1, [40, 50, 60]), { kind: 'order', ids: order }]);
    assert.deepEqual(see(), [40, 50, 60]);
    assert.ok(!scene.absurd);
});

test('what is fixed to the screen stays there, wherever the camera looks', async () => {
    const { scene, looking, see } = await begin();
    const corners = (s) => Float64Array.of(-s, -s, 1, s, -s, 1, s, s, 1, -s, s, 1);
    const sign = { ...picture(2, 1, [90, 80, 70], 2), corners: corners(0.1), fixed: true };
    scene.apply([picture(1, 1, [10, 20, 30]), sign, { kind: 'order', ids: ids(1, 2) }]);
    const other = { ...camera(), eye: [500, -90, 40], near: 400 };
    scene.aim(other, 123, -40, 0, 12);
    const wide = (from) => { // pixels of the middle row that show it: a fifth of the height
        const f = scene.draw(from, false, false);
        const row = new Uint8Array(scene.wasm.memory.buffer, f.at + 4 * f.stride * 24, 4 * 64);
        return Array.from({ length: 64 }, (_, x) => row[4 * x]).filter((red) => red === 90).length;
    };
    assert.deepEqual(see(looking), [90, 80, 70]);
    assert.deepEqual(see(other), [90, 80, 70]);
    for (const from of [looking, other]) {
        assert.ok(Math.abs(wide(from) - 9.6) <= 1, String(wide(from)));
    }
});

test('screens: as they are, turned with the camera, until the next order', async () => {
    const { scene, looking, see } = await begin();
    const screen = (exact, color, from = looking) => ({
        kind: 'screen', camera: from, exact, width: from.width, height: from.height,
        pixels: Uint8Array.from({ length: 4 * from.width * from.height },
                                (_, i) => [...color, 255][i % 4]) });
    const turned = camera();
    scene.aim(turned, 20, 0, 0, 60);
    scene.apply([picture(1, 1, [10, 20, 30]), { kind: 'order', ids: ids(1) },
                 screen(true, [200, 0, 0])]);
    assert.ok(scene.isExact(looking) && !scene.isExact(turned));
    assert.deepEqual(see(), [200, 0, 0]);
    assert.deepEqual(see(turned), [10, 20, 30]); // still pictures do not end the order
    scene.apply([screen(false, [0, 200, 0])]);
    assert.ok(!scene.isExact(looking));
    assert.deepEqual(see(turned), [0, 200, 0]);
    scene.apply([{ kind: 'order', ids: ids(1) }]);
    assert.deepEqual(see(turned), [10, 20, 30]);
    assert.deepEqual(see(turned, true), [0, 200, 0]);
    scene.resize(32, 20); // the screen is kept
    assert.deepEqual(see({ ...turned, width: 32, height: 20 }, true), [0, 200, 0]);
    const far = { ...turned, eye: [1e9, -1e9, 1e9] };
    assert.deepEqual(see(far, true).length, 3);
});

test('ten thousand random messages', async () => {
    const { scene, see } = await begin(1 << 20);
    const random = randomFrom(3), below = (n) => Math.floor(random() * n);
    for (let i = 0; i < 10000; i++) {
        const some = () => ids(...new Set(Array.from({ length: below(9) }, () => 1 + below(40))))
            .sort();
        const kind = below(8);
        const item = kind < 5 ? { ...picture(1 + below(40), i + 1, [below(256), 0, 0], 2 + below(90)),
                                  opaque: kind < 1 ? [0, 0, 2, 2] : [] }
            : kind === 5 ? { kind: 'order', ids: some() }
                : kind === 6 ? { kind: 'replace', out: some(), in: some() }
                    : { kind: 'drop', ids: some() };
        scene.apply([item]);
        if (i % 100 === 0) {
            assert.equal(see().length, 3);
        }
    }
    assert.ok(scene.heldBytes <= 1.25 * (1 << 20));
    const { ids: held } = scene.heldIds();
    scene.apply([{ kind: 'drop', ids: held }]);
    assert.equal(scene.heldBytes, 0);
});

test('a way is the same in two steps or in two hundred', () => {
    const ends = [2, 200].map((steps) => {
        const motion = new Motion(), pose = { eye: [0, 0, 0], heading: 90, pitch: 0, roll: 0, fov: 60 };
        motion.want('forward', 1);
        for (let i = 0; i < steps; i++) {
            motion.advance(pose, 100, 2 / steps, () => -Infinity);
        }
        assert.ok(motion.active);
        motion.stop();
        motion.advance(pose, 100, 1, () => -Infinity);
        assert.ok(!motion.active);
        return pose.eye[0];
    });
    assert.ok(Math.abs(ends[0] - ends[1]) < 1e-6 && ends[0] > 190, String(ends));
    const pose = { eye: [0, 0, 0], heading: 350, pitch: 80, roll: 0, fov: 60 };
    turn(pose, 20, 20);
    assert.deepEqual([pose.heading, pose.pitch], [10, 89]);
    move({ ...pose, heading: 90 }, 1, 0, 0);
});

test('the eye keeps above the ground that is known, and rises before a slope', () => {
    const side = 9, step = 100; // a ridge across the way, and a hole in the north-east
    const heights = Float32Array.from({ length: side * side }, (_, i) => {
        const [column, row] = [i % side, Math.floor(i / side)];
        return column === 8 && row === 8 ? -1e9 : 400 - 100 * Math.abs(column - 4);
    });
    const item = { kind: 'ground', x: -400, y: -400, step, columns: side, rows: side, heights };
    const ground = (x, y) => groundAt(item, x, y);
    assert.equal(ground(0, 0), 400);
    assert.equal(ground(-50, 37), 350);
    assert.equal(ground(399, 399), 100); // the highest that is known
    for (const [x, y] of [[-400.1, 0], [400, 0], [0, 401], [0, -1e9], [NaN, 0]]) {
        assert.equal(ground(x, y), -Infinity);
    }
    const motion = new Motion(), pose = { eye: [-390, 5, 60], heading: 90, pitch: 0, roll: 0, fov: 60 };
    motion.want('forward', 1);
    let rose = 0;
    for (let i = 0; i < 240 && pose.eye[0] < 390; i++) {
        const [x, , z] = pose.eye;
        motion.advance(pose, 200, 1 / 60, ground);
        assert.ok(pose.eye[2] >= ground(pose.eye[0], 5) + 10 - 1e-9, `${pose.eye}`);
        if (x > -300 && x < -100) {
            rose = Math.max(rose, pose.eye[2] - z);
        }
    }
    assert.ok(rose > 0 && pose.eye[2] > 380, String(pose.eye)); // it does not sink again
    const low = { ...pose, eye: [0, 0, -70] };
    clearGround(low, ground);
    assert.equal(low.eye[2], 410);
    clearGround(low, () => -Infinity);
    assert.equal(low.eye[2], 410);
});

test('links hold a camera, and nothing but a sound one', () => {
    const pose = { eye: [1234567.125, -5.5, 100.1], heading: 12.5, pitch: -30, roll: 0, fov: 55 };
    const fragment = { token: 'a-b_c.d~e', pose };
    assert.deepEqual(parseFragment(formatFragment(fragment)), fragment);
    for (const camera of ['1,2,3', '1,2,3,4,5,x', '1,2,3,4,5,500', '1e300,2,3,4,5,60', 'NaN,0,0,0,0,60',
                          '']) {
        assert.equal(parseFragment(`#camera=${camera}`).pose, null);
    }
    assert.equal(parseFragment('').token, '');
});
