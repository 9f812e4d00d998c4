// codec.ts: pictures of the wire unpacked: docs/wire.md, "Pictures".
//
// Raw, runs and runs-zstd give the bytes that were packed. PNG, JPEG and WebP are the browser's: what it
// decodes is an opaque picture (WebP aside), whose size is read from its head before, since the browser
// would take the memory that the head asks for.
import { decompress } from 'fzstd';
import { planeBound, runsBound } from './checks.js';
import { sentenceAt, take, type Exports } from './wasm.js';
import { WireFault } from './wire.js';

/** Straight colours of a picture file, as a canvas gives them back. */
export type DecodeFile = (bytes: Uint8Array, type: string, width: number,
                          height: number) => Promise<Uint8ClampedArray>;

const FILE_TYPES: Record<number, string> = {
    4: 'image/png', 5: 'image/jpeg', 6: 'image/webp', 7: 'image/webp',
};

const ZSTD_MAGIC = 0xfd2fb528;

function viewOf(bytes: Uint8Array): DataView {
    return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** Unpacks one zstd frame that tells its size, which is at most `most`. */
export function unpackZstd(bytes: Uint8Array, most: number): Uint8Array {
    const view = viewOf(bytes);
    if (bytes.length < 6 || view.getUint32(0, true) !== ZSTD_MAGIC) {
        throw new WireFault('a picture is no zstd frame');
    }
    const flags = bytes[4]!, single = (flags >> 5) & 1, kind = flags >> 6;
    const sizeBytes = kind === 0 ? single : 1 << kind;
    const at = 6 - single;
    if ((flags & 3) !== 0 || sizeBytes === 0 || at + sizeBytes > bytes.length) {
        throw new WireFault('a zstd frame does not tell its size');
    }
    const size = sizeBytes === 1 ? bytes[at]! : sizeBytes === 2 ? view.getUint16(at, true) + 256
        : sizeBytes === 4 ? view.getUint32(at, true) : Number(view.getBigUint64(at, true));
    if (size > most) {
        throw new WireFault(`a zstd frame of ${size} bytes is larger than its picture can take`);
    }
    const out = new Uint8Array(size); // given, nothing else is asked for, whatever the blocks say
    try {
        decompress(bytes, out);
    } catch {
        throw new WireFault('a zstd frame is damaged');
    }
    return out;
}

// ---- sizes in heads of files --------------------------------------------------------------------

type Size = [width: number, height: number];

function pngSize(view: DataView): Size | null {
    return view.byteLength >= 24 && view.getUint32(0) === 0x89504e47
        ? [view.getUint32(16), view.getUint32(20)] : null;
}

function jpegSize(view: DataView): Size | null {
    for (let at = 2; at + 9 < view.byteLength && view.getUint16(0) === 0xffd8;) {
        if (view.getUint8(at) !== 0xff) {
            return null;
        }
        const marker = view.getUint8(at + 1);
        if (marker === 0xff) { // filling
            at += 1;
        } else if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker)) {
            return [view.getUint16(at + 7), view.getUint16(at + 5)];
        } else {
            at += 2 + view.getUint16(at + 2);
        }
    }
    return null;
}

function webpSize(view: DataView): Size | null {
    if (view.byteLength < 30 || view.getUint32(0) !== 0x52494646 ||
        view.getUint32(8) !== 0x57454250) {
        return null;
    }
    const low = (at: number) => view.getUint16(at, true);
    switch (view.getUint32(12)) {
    case 0x56503820: // "VP8 "
        return [low(26) & 0x3fff, low(28) & 0x3fff];
    case 0x5650384c: { // "VP8L"
        const bits = view.getUint32(21, true);
        return [(bits & 0x3fff) + 1, ((bits >>> 14) & 0x3fff) + 1];
    }
    case 0x56503858: // "VP8X": 24 bits each; animated ones are refused
        return (view.getUint8(20) & 2) !== 0 ? null
            : [(view.getUint32(24, true) & 0xffffff) + 1, (view.getUint32(26, true) >>> 8) + 1];
    default:
        return null;
    }
}

/** Width and height as a file's head says them; null when it is no file of that type. */
export function fileSize(bytes: Uint8Array, type: string): Size | null {
    const view = viewOf(bytes);
    return type === 'image/png' ? pngSize(view) : type === 'image/jpeg' ? jpegSize(view)
        : webpSize(view);
}

// ---- pictures -----------------------------------------------------------------------------------

/** Colours as they are, alpha beside; `clamp`: colours that losses lifted above alpha come down. */
export function applyAlpha(rgba: Uint8Array, alpha: Uint8Array, clamp: boolean): void {
    for (let i = 0, at = 0; i < alpha.length; i++, at += 4) {
        const a = alpha[i]!;
        if (clamp && a !== 255) {
            for (let c = 0; c < 3; c++) {
                rgba[at + c] = Math.min(rgba[at + c]!, a);
            }
        }
        rgba[at + 3] = a;
    }
}

/** Straight colours to premultiplied ones, rounded. */
export function premultiply(rgba: Uint8Array): void {
    for (let at = 0; at < rgba.length; at += 4) {
        const a = rgba[at + 3]!;
        for (let c = 0; c < 3 && a !== 255; c++) {
            rgba[at + c] = Math.round(rgba[at + c]! * a / 255);
        }
    }
}

export class Unpacker {
    constructor(private readonly wasm: Exports, private readonly decodeFile: DecodeFile | null) {}

    /** Bits of the codecs that it takes. */
    get codecs(): number {
        return this.decodeFile !== null ? 0b11111110 : 0b1110;
    }

    /** Calls C with a copy of the bytes and room for the result, which is copied out. */
    private call(bytes: Uint8Array, size: number,
                 unpack: (data: number, out: number) => number): Uint8Array {
        const mark = this.wasm.vd_wasm_mark();
        try {
            const data = take(this.wasm, bytes.length + 1), out = take(this.wasm, size);
            new Uint8Array(this.wasm.memory.buffer).set(bytes, data);
            const wrong = unpack(data, out);
            if (wrong !== 0) {
                throw new WireFault(`a run-length picture: ${sentenceAt(this.wasm, wrong)}`);
            }
            return new Uint8Array(this.wasm.memory.buffer).slice(out, out + size);
        } finally {
            this.wasm.vd_wasm_return(mark);
        }
    }

    runs(bytes: Uint8Array, width: number, height: number): Uint8Array {
        return this.call(bytes, 4 * width * height, (data, out) => this.wasm.vd_wasm_unpack_runs(
            data, bytes.length, width, height, out, width));
    }

    private alpha(bytes: Uint8Array, head: number, pixels: number): Uint8Array {
        const length = head >>> 1;
        if (length > bytes.length - 4) {
            throw new WireFault("a picture's alpha is truncated");
        }
        const part = bytes.subarray(4, 4 + length);
        const tokens = (head & 1) !== 0 ? unpackZstd(part, planeBound(pixels)) : part;
        return this.call(tokens, pixels, (data, out) => this.wasm.vd_wasm_unpack_plane(
            data, tokens.length, pixels, out));
    }

    private async file(bytes: Uint8Array, type: string, width: number,
                       height: number): Promise<Uint8Array> {
        const size = fileSize(bytes, type);
        if (size === null || size[0] !== width || size[1] !== height || this.decodeFile === null) {
            throw new WireFault(`a picture is no ${type} of ${width} x ${height} pixels`);
        }
        let pixels: Uint8ClampedArray;
        try {
            pixels = await this.decodeFile(bytes, type, width, height);
        } catch {
            throw new WireFault(`a picture is a damaged ${type}`);
        }
        return new Uint8Array(pixels.buffer, pixels.byteOffset, pixels.byteLength);
    }

    /** RGBA, alpha premultiplied, in memory of its own; at once where no browser is asked. */
    unpack(codec: number, bytes: Uint8Array, width: number,
           height: number): Uint8Array | Promise<Uint8Array> {
        if (codec === 1) {
            if (bytes.length !== 4 * width * height) {
                throw new WireFault('a raw picture is of another size');
            }
            return bytes.slice();
        }
        if (codec === 2) {
            return this.runs(bytes, width, height);
        }
        if (codec === 3) {
            return this.runs(unpackZstd(bytes, runsBound(width, height)), width, height);
        }
        return this.unpackFile(codec, bytes, width, height);
    }

    private async unpackFile(codec: number, bytes: Uint8Array, width: number,
                             height: number): Promise<Uint8Array> {
        const type = FILE_TYPES[codec];
        if (type === undefined) {
            throw new WireFault(`there is no codec ${codec}`);
        }
        if (codec === 6) {
            const rgba = await this.file(bytes, type, width, height);
            premultiply(rgba);
            return rgba;
        }
        if (bytes.length < 4) {
            throw new WireFault('a picture is truncated');
        }
        const head = viewOf(bytes).getUint32(0, true);
        const alpha = head !== 0 ? this.alpha(bytes, head, width * height) : null;
        const rgba = await this.file(bytes.subarray(4 + (head >>> 1)), type, width, height);
        if (alpha !== null) {
            applyAlpha(rgba, alpha, codec === 5);
        }
        return rgba;
    }
}
