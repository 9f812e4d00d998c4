// The page's side of the wire: what was recorded is understood and said the same way; no bytes do harm.
import assert from 'node:assert/strict';
import test from 'node:test';
import { checkMessage } from '../generated/modules/checks.js';
import { WireFault } from '../generated/modules/wire.js';
import { exchange, impostor, randomFrom, schema, wire } from './support.mjs';

test('the table has every message of the file', () => {
    assert.equal(Object.keys(schema).length, 20);
    assert.deepEqual(schema.Hello.map(({ number }) => number), [1, 2, 3, 4, 5, 6, 7, 8, 9, 10]);
    assert.equal(schema.Message.length, 18);
});

test('a recorded exchange is understood and said again, to the byte', () => {
    const kinds = [];
    for (const { side, bytes } of exchange()) {
        const envelope = wire.decode(bytes);
        kinds.push(...envelope.messages.flatMap((m) => Object.keys(m)));
        if (side === 'server') {
            envelope.messages.forEach(checkMessage);
        }
        assert.deepEqual(wire.encode(envelope.batch, envelope.messages), bytes);
    }
    assert.deepEqual(new Set(kinds), new Set(schema.Message.map(({ name }) => name)));
});

test('what was said comes back as it was', () => {
    const { messages: [, { settings }] } = wire.decode(exchange()[0].bytes);
    assert.ok(settings.mode >= 1);
    const first = wire.decode(exchange()[3].bytes);
    assert.equal(first.batch, 1);
    const { impostor: got } = first.messages[0];
    assert.equal(got.id, 0xffffffffffffffffn);
    assert.deepEqual(got.origin, { x: 400000.125, y: 5e6, z: -3 });
    assert.deepEqual(got.corners, [0, 0, 8, 4, 1, 8, 4, 1, 0, 0, 0, 0]);
    assert.equal(got.picture.length, 96);
    assert.deepEqual([...first.messages[2].order.ids], [1n, 7n, 9n, 1n << 40n, (1n << 64n) - 1n]);
});

test('unknown fields and messages are skipped', () => {
    const bytes = wire.encode(0, [{ ping: { stamp: 7n } }]);
    const unknown = Uint8Array.of(...bytes, 0x7a, 2, 1, 2, 0x79, 1, 2, 3, 4, 5, 6, 7, 8);
    assert.deepEqual(wire.decode(unknown).messages, [{ ping: { stamp: 7n } }]);
    const strange = Uint8Array.of(0x12, 5, 0xa2, 6, 2, 1, 1);
    assert.deepEqual(wire.decode(strange).messages, [{}]);
});

test('numbers that are not packed count as well', () => {
    // order { ids: 5 } with its list as single fields
    const order = [0x11, 5, 0, 0, 0, 0, 0, 0, 0, 0x11, 6, 0, 0, 0, 0, 0, 0, 0];
    const bytes = Uint8Array.of(0x12, order.length + 2, 0x22, order.length, ...order);
    assert.deepEqual([...wire.decode(bytes).messages[0].order.ids], [5n, 6n]);
});

const recorded = exchange();

test('cut and changed envelopes end with a fault or with messages', () => {
    const random = randomFrom(1);
    let faults = 0;
    for (let run = 0; run < 20000; run++) {
        const all = recorded;
        const bytes = all[Math.floor(random() * all.length)].bytes.slice();
        for (let k = 0; k < 1 + random() * 4; k++) {
            bytes[Math.floor(random() * bytes.length)] = Math.floor(random() * 256);
        }
        try {
            wire.decode(bytes.subarray(0, random() < 0.5 ? bytes.length
                : Math.floor(random() * bytes.length))).messages.forEach(checkMessage);
        } catch (fault) {
            assert.ok(fault instanceof WireFault, String(fault.stack));
            faults++;
        }
    }
    assert.ok(faults > 5000 && faults < 20000, String(faults));
});

test('envelopes have bounds', () => {
    const ping = { ping: { stamp: 1n } };
    assert.throws(() => wire.decode(new Uint8Array(0)), WireFault);
    assert.throws(() => wire.decode(new Uint8Array((16 << 20) + 1)), WireFault);
    assert.throws(() => wire.decode(wire.encode(0, Array(1025).fill(ping))), WireFault);
    assert.equal(wire.decode(wire.encode(0, Array(1024).fill(ping))).messages.length, 1024);
});

const bad = {
    'an id of 0': { impostor: { ...impostor(0n, 1) } },
    'a version of 0': { impostor: impostor(1n, 0) },
    'a side of 1': { impostor: { ...impostor(1n, 1), width: 1 } },
    'too many pixels': { impostor: { ...impostor(1n, 1), codec: 2, width: 16383, height: 16383 } },
    'no such codec': { impostor: { ...impostor(1n, 1), codec: 8 } },
    'a short raw picture': { impostor: { ...impostor(1n, 1), picture: new Uint8Array(63) } },
    'corners that are none': { impostor: { ...impostor(1n, 1), corners: [1, 2, 3] } },
    'a corner that is no number': { impostor: { ...impostor(1n, 1),
        corners: [NaN, 0, 9, 9, 0, 9, 9, 0, -9, -9, 0, -9] } },
    'no parallelogram': { impostor: { ...impostor(1n, 1),
        corners: [-9, 0, 9, 9, 0, 9, 90, 0, -9, -9, 0, -9] } },
    'an opaque rectangle outside': { impostor: { ...impostor(1n, 1), opaque: [1, 1, 5, 3] } },
    'no origin': { impostor: { ...impostor(1n, 1), origin: undefined } },
    'a far origin': { impostor: { ...impostor(1n, 1), origin: { x: 2e9, y: 0, z: 0 } } },
    'the id 0 in an order': { order: { camera: 0, ids: BigUint64Array.of(0n) } },
    'a long order': { order: { camera: 0, ids: new BigUint64Array(65537).fill(1n) } },
    'a drop that does not ascend': { drop: { ids: BigUint64Array.of(2n, 2n) } },
    'an empty drop': { drop: { ids: new BigUint64Array(0) } },
    'an empty replace': { replace: { out: new BigUint64Array(0), in: new BigUint64Array(0) } },
    'a lossy exact screen': { screen: { camera: 1, codec: 5, exact: true, width: 8, height: 8,
        picture: new Uint8Array(9) } },
    'endless stats': { stats: { error_px: Infinity } },
    'a camera': { camera: { sequence: 1 } },
    'settings': { settings: { mode: 1 } },
    'an acknowledgement': { acknowledge: { batch: 1, held_bytes: 0n } },
    'a long sentence': { error: { code: 1, sentence: 'x'.repeat(381) } },
};

for (const [name, message] of Object.entries(bad)) {
    test(`refused: ${name}`, () => assert.throws(() => checkMessage(message), WireFault));
}

test('lists of any length are said as they are', () => {
    for (let length = 0; length < 3000; length += 37) {
        const ids = BigUint64Array.from({ length }, (_, i) => BigInt(i + 1) << 33n);
        const versions = Array.from({ length }, (_, i) => i + 1);
        const bytes = wire.encode(0, [{ hello: { version: 1, token: 't'.repeat(length % 250),
                                                 held_ids: ids, held_versions: versions } }]);
        const { hello } = wire.decode(bytes).messages[0];
        assert.deepEqual([...hello.held_ids], [...ids]);
        assert.deepEqual(hello.held_versions, versions);
    }
});
