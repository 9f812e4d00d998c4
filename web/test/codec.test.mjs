// Pictures: what C and the page unpack together, and what they refuse.
import assert from 'node:assert/strict';
import test from 'node:test';
import { applyAlpha, fileSize, premultiply, unpackZstd, Unpacker } from
    '../generated/modules/codec.js';
import { WireFault } from '../generated/modules/wire.js';
import { makeWasm, plainZstd, randomFrom } from './support.mjs';

// Two rows of three pixels: one pixel thrice; nothing.
const RUNS = Uint8Array.of(0, 0, 3, 0, 5, 0, 9, 8, 7, 255, 0, 0, 0, 0);
const PIXELS = [9, 8, 7, 255, 9, 8, 7, 255, 9, 8, 7, 255, ...Array(12).fill(0)];

const png = (width, height) => {
    const bytes = Buffer.alloc(40);
    Buffer.from([0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, 0, 0, 0, 13]).copy(bytes);
    bytes.writeUInt32BE(width, 16);
    bytes.writeUInt32BE(height, 20);
    return new Uint8Array(bytes);
};

/** What a browser would make of a file: pixel i is (i, i, i, 255). */
const gray = async (bytes, type, width, height) =>
    Uint8ClampedArray.from({ length: 4 * width * height }, (_, i) => i % 4 === 3 ? 255 : i >> 2);

test('raw, runs and runs-zstd', async () => {
    const unpacker = new Unpacker(await makeWasm(), null);
    assert.equal(unpacker.codecs, 0b1110);
    assert.deepEqual([...unpacker.unpack(1, Uint8Array.from(PIXELS), 3, 2)], PIXELS);
    assert.deepEqual([...unpacker.unpack(2, RUNS, 3, 2)], PIXELS);
    assert.deepEqual([...unpacker.unpack(3, plainZstd(RUNS), 3, 2)], PIXELS);
    for (const [codec, bytes] of [[1, RUNS], [2, RUNS.subarray(1)], [2, new Uint8Array(3)],
                                  [3, RUNS], [3, plainZstd(RUNS.subarray(2))]]) {
        assert.throws(() => unpacker.unpack(codec, bytes, 3, 2), WireFault);
    }
});

test('a frame of zstd tells its size, and keeps to it', () => {
    const bytes = Uint8Array.from({ length: 300 }, (_, i) => i);
    assert.deepEqual(unpackZstd(plainZstd(bytes), 300), bytes);
    assert.throws(() => unpackZstd(plainZstd(bytes), 299), WireFault);
    const small = plainZstd(bytes); // says 8, holds 300
    small.set([8, 0, 0, 0], 5);
    assert.throws(() => unpackZstd(small, 300), WireFault);
    const random = randomFrom(7);
    for (let run = 0; run < 3000; run++) {
        const frame = plainZstd(bytes);
        for (let k = 0; k < 3; k++) {
            frame[4 + Math.floor(random() * (frame.length - 4))] = Math.floor(random() * 256);
        }
        try {
            assert.ok(unpackZstd(frame, 1000).length <= 1000);
        } catch (fault) {
            assert.ok(fault instanceof WireFault, String(fault.stack));
        }
    }
});

test('sizes are read from the heads of files', () => {
    assert.deepEqual(fileSize(png(7, 9), 'image/png'), [7, 9]);
    assert.equal(fileSize(png(7, 9), 'image/jpeg'), null);
    const jpeg = Uint8Array.of(0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xc0, 0, 11, 8, 0, 9, 0, 7, 3,
                               0, 0, 0, 0);
    assert.deepEqual(fileSize(jpeg, 'image/jpeg'), [7, 9]);
    const webp = (kind, rest) => new Uint8Array(Buffer.concat([
        Buffer.from(`RIFF....WEBP${kind}....`), Buffer.from(rest), Buffer.alloc(12)]));
    assert.deepEqual(fileSize(webp('VP8 ', [0, 0, 0, 0x9d, 1, 0x2a, 7, 0, 9, 0]), 'image/webp'), [7, 9]);
    assert.deepEqual(fileSize(webp('VP8L', [0x2f, 6, 0, 2, 0]), 'image/webp'), [7, 9]);
    assert.deepEqual(fileSize(webp('VP8X', [0, 0, 0, 0, 6, 0, 0, 8, 0, 0]), 'image/webp'), [7, 9]);
    assert.equal(fileSize(webp('VP8X', [2, 0, 0, 0, 6, 0, 0, 8, 0, 0]), 'image/webp'), null);
    assert.equal(fileSize(new Uint8Array(0), 'image/webp'), null);
});

test('alpha beside a file', async () => {
    const unpacker = new Unpacker(await makeWasm(), gray);
    const plane = [0, 5, 128]; // three bytes as they are: token (2 << 1)
    const tokens = Uint8Array.of(4, 0, ...plane);
    const packed = (part, zstd) => {
        const head = Buffer.alloc(4);
        head.writeUInt32LE(part.length * 2 + (zstd ? 1 : 0));
        return new Uint8Array(Buffer.concat([head, part, png(3, 1)]));
    };
    const expected = [0, 0, 0, 0, 1, 1, 1, 5, 2, 2, 2, 128];
    assert.deepEqual([...await unpacker.unpack(4, packed(tokens, false), 3, 1)], expected);
    assert.deepEqual([...await unpacker.unpack(4, packed(plainZstd(tokens), true), 3, 1)], expected);
    const opaque = new Uint8Array([0, 0, 0, 0, ...png(3, 1)]);
    assert.deepEqual([...await unpacker.unpack(4, opaque, 3, 1)].filter((_, i) => i % 4 === 3),
                     [255, 255, 255]);
    for (const bytes of [opaque.subarray(0, 3), png(3, 1), packed(tokens.subarray(1), false),
                         new Uint8Array([0, 0, 0, 0, ...png(30000, 30000)])]) {
        await assert.rejects(unpacker.unpack(4, bytes, 3, 1), WireFault);
    }
    const broken = new Unpacker(await makeWasm(), async () => { throw new Error('no'); });
    await assert.rejects(broken.unpack(4, opaque, 3, 1), WireFault);
    await assert.rejects(unpacker.unpack(9, opaque, 3, 1), WireFault);
});

test('colours do not rise above alpha', () => {
    const rgba = Uint8Array.of(200, 10, 50, 255);
    applyAlpha(rgba, Uint8Array.of(60), true);
    assert.deepEqual([...rgba], [60, 10, 50, 60]);
    const straight = Uint8Array.of(255, 128, 0, 51);
    premultiply(straight);
    assert.deepEqual([...straight], [51, 26, 0, 51]);
});
