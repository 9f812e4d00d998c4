// support.mjs: what the tests share: the messages, recordings, random bytes, and WebAssembly.
import { readFileSync } from 'node:fs';
import { Wire } from '../generated/modules/wire.js';
import { instantiate } from '../generated/modules/wasm.js';
import { parseProto } from '../proto.mjs';

export const root = new URL('../../', import.meta.url);
export const schema = parseProto(readFileSync(new URL('src/remote/veduta.proto', root), 'utf8'));
export const wire = new Wire(schema);
export const wasmModule = await WebAssembly.compile(
    readFileSync(new URL('../generated/veduta-display.wasm', import.meta.url)));
export const makeWasm = () => instantiate(wasmModule);

/** The envelopes of a recording (docs/wire.md). */
export function readRecording(url) {
    const file = readFileSync(url);
    const envelopes = [];
    for (let at = 8; at < file.length;) {
        const [side, milliseconds, length] = [0, 4, 8].map((i) => file.readUInt32LE(at + i));
        envelopes.push({ side: side === 0 ? 'client' : 'server', milliseconds,
                         bytes: new Uint8Array(file.subarray(at + 12, at + 12 + length)) });
        at += 12 + length;
    }
    return envelopes;
}

export const exchange = () => readRecording(new URL('test/wire/exchange.vdx', root));

/** SplitMix64, as the C tests have it: numbers in [0, 1). */
export function randomFrom(seed) {
    let state = BigInt(seed);
    return () => {
        state = BigInt.asUintN(64, state + 0x9e3779b97f4a7c15n);
        let z = BigInt.asUintN(64, (state ^ (state >> 30n)) * 0xbf58476d1ce4e5b9n);
        z = BigInt.asUintN(64, (z ^ (z >> 27n)) * 0x94d049bb133111ebn);
        return Number((z ^ (z >> 31n)) >> 11n) / 2 ** 53;
    };
}

/** A zstd frame of one segment whose blocks are as they are. */
export function plainZstd(bytes) {
    const size = Buffer.alloc(4), head = Buffer.alloc(3);
    size.writeUInt32LE(bytes.length);
    head.writeUIntLE(bytes.length * 8 + 1, 0, 3);
    return new Uint8Array(Buffer.concat([Buffer.from([0x28, 0xb5, 0x2f, 0xfd, 0xa0]), size, head,
                                         bytes]));
}

/** A flat, raw impostor before a camera at the origin that looks north. */
export function impostor(id, version, side = 4, color = [200, 100, 50, 255]) {
    return { id, version, origin: { x: 0, y: 10, z: 0 }, nearer: 1, width: side, height: side,
             corners: [-9, 0, 9, 9, 0, 9, 9, 0, -9, -9, 0, -9], opaque: [], codec: 1,
             picture: Uint8Array.from({ length: 4 * side * side }, (_, i) => color[i % 4]) };
}
