// wire.ts: envelopes of messages as bytes and back, by the table of src/remote/veduta.proto.
//
// Nothing here trusts the bytes: whatever they are, decoding ends with messages or a WireFault, in time
// and memory in proportion to them. Bounds of what they say are checked by checks.ts.

export interface Field {
    name: string;
    number: number;
    type: string;
    repeated: boolean;
}

/** The fields of each message, by its name (proto.mjs). */
export type Schema = Record<string, Field[]>;

/** What the other side sent cannot be right. */
export class WireFault extends Error {}

export interface Vector { x: number; y: number; z: number }
export interface Hello {
    version: number; capabilities: number; token: string; memory_bytes: bigint;
    width: number; height: number; name: string;
    held_ids: BigUint64Array; held_versions: number[]; particles: number;
}
export interface Camera {
    sequence: number; eye: Vector; qx: number; qy: number; qz: number; qw: number;
    fx: number; fy: number; cx: number; cy: number; near: number;
    width: number; height: number; time: number;
}
export interface Impostor {
    id: bigint; version: number; origin?: Vector; corners: number[]; nearer: number;
    width: number; height: number; opaque: number[]; codec: number; picture: Uint8Array;
    fixed: boolean;
}
export interface Geometry {
    id: bigint; version: number; kind: number; origin?: Vector; block: Uint8Array;
}
export interface Instance {
    id: bigint; version: number; model: bigint; origin?: Vector; axes: number[]; sun: number;
    ground: number[];
}
export interface Light { sun_direction?: Vector; colors: number[]; haze_m: number }
export interface Ground {
    x: number; y: number; step: number; columns: number; rows: number; heights: number[];
}
export interface Order { camera: number; ids: BigUint64Array }
export interface Replace { out: BigUint64Array; in: BigUint64Array }
export interface Drop { ids: BigUint64Array }
export interface Screen {
    camera: number; codec: number; exact: boolean; width: number; height: number;
    picture: Uint8Array;
}
export interface Stats {
    frames_per_s: number; frame_p99_s: number; decode_s: number; error_px: number;
    link_bytes_per_s: number; latency_s: number; queued_bytes: bigint; shown: bigint;
    clients: bigint;
}
export interface WireError { code: number; sentence: string }
export interface Bye { reason: number; sentence: string }
export interface Ping { stamp: bigint }
export interface Settings {
    mode: number; tolerance_px: number; quality: number; codecs: number; bytes_per_s: number;
}
export interface Acknowledge { batch: number; held_bytes: bigint }

/** One of them; none: of a newer version, to be skipped. */
export interface Message {
    hello?: Hello; camera?: Camera; impostor?: Impostor; order?: Order; geometry?: Geometry;
    replace?: Replace; drop?: Drop; screen?: Screen; acknowledge?: Acknowledge; stats?: Stats;
    error?: WireError; ping?: Ping; pong?: Ping; bye?: Bye; settings?: Settings;
    instance?: Instance; light?: Light; ground?: Ground;
}
export interface Envelope { batch: number; messages: Message[] }

/** What is sent may leave out what is 0, as proto3 does. */
export type Outgoing = { [K in keyof Message]: Partial<Message[K]> };

export const ENVELOPE_BYTES = 16 << 20;
export const BATCH_BYTES = 100 << 10;
const HEAD_BYTES = 6;
const MAX_MESSAGES = 1024;

type Value = number | bigint | boolean | string | Uint8Array | BigUint64Array | Value[] | Struct;
interface Struct { [name: string]: Value | undefined }

const text = new TextDecoder('utf-8', { fatal: true });
const letters = new TextEncoder();

/** Wire type of a scalar's type: 0 varint, 1 eight bytes, 2 counted, 5 four bytes. */
const WIRE_TYPES: Record<string, number> = {
    double: 1, fixed64: 1, float: 5, uint32: 0, uint64: 0, bool: 0, string: 2, bytes: 2,
};

// ---- reading ------------------------------------------------------------------------------------

class Reader {
    private readonly view: DataView;
    constructor(readonly bytes: Uint8Array, public at = 0, public end = bytes.length) {
        this.view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
    }

    /** Moves on by `count` bytes; returns where they begin. */
    skip(count: number): number {
        if (count > this.end - this.at) {
            throw new WireFault('an envelope is truncated');
        }
        this.at += count;
        return this.at - count;
    }

    varint(): bigint {
        let value = 0n;
        for (let shift = 0n; shift < 70n; shift += 7n) {
            const byte = this.bytes[this.skip(1)]!;
            value |= BigInt(byte & 127) << shift;
            if (byte < 128) {
                return BigInt.asUintN(64, value);
            }
        }
        throw new WireFault('a number of an envelope does not end');
    }

    /** The same, 32 bits of it, without the cost of big numbers. */
    word(): number {
        let value = 0;
        for (let i = 0; i < 10; i++) {
            const byte = this.bytes[this.skip(1)]!;
            if (i < 5) {
                value = (value | ((byte & 127) << (7 * i))) >>> 0;
            }
            if (byte < 128) {
                return value;
            }
        }
        throw new WireFault('a number of an envelope does not end');
    }

    /** Length of what follows; what does not fit is truncated. */
    length(): number {
        const value = this.varint();
        if (value > BigInt(this.end - this.at)) {
            throw new WireFault('an envelope is truncated');
        }
        return Number(value);
    }

    scalar(type: string): Value {
        switch (type) {
        case 'double':
            return this.view.getFloat64(this.skip(8), true);
        case 'float':
            return this.view.getFloat32(this.skip(4), true);
        case 'fixed64':
            return this.view.getBigUint64(this.skip(8), true);
        case 'uint32':
            return this.word();
        case 'uint64':
            return this.varint();
        case 'bool':
            return this.varint() !== 0n;
        default: {
            const length = this.length();
            const from = this.skip(length);
            const bytes = this.bytes.subarray(from, from + length);
            return type === 'bytes' ? bytes : this.string(bytes);
        }
        }
    }

    private string(bytes: Uint8Array): string {
        try {
            return text.decode(bytes);
        } catch {
            throw new WireFault('a text of an envelope is not UTF-8');
        }
    }

    pass(wireType: number): void {
        if (wireType === 0) {
            this.word();
        } else if (wireType === 2) {
            this.skip(this.length());
        } else if (wireType === 1 || wireType === 5) {
            this.skip(wireType === 1 ? 8 : 4);
        } else {
            throw new WireFault('an envelope has a field of no known kind');
        }
    }
}

function emptyOf(type: string): Value | undefined {
    switch (type) {
    case 'fixed64':
    case 'uint64':
        return 0n;
    case 'bool':
        return false;
    case 'string':
        return '';
    case 'bytes':
        return new Uint8Array(0);
    case 'double':
    case 'float':
    case 'uint32':
        return 0;
    default:
        return undefined;
    }
}

/** Ids come by the ten thousand: they are kept as numbers of 64 bits, not as objects. */
function readIds(reader: Reader, before: BigUint64Array, count: number): BigUint64Array {
    const all = new BigUint64Array(before.length + count);
    all.set(before);
    const from = reader.skip(8 * count);
    new Uint8Array(all.buffer, 8 * before.length).set(reader.bytes.subarray(from, from + 8 * count));
    return all;
}

/** Takes one or, packed, several values of a repeated scalar. */
function readRepeated(reader: Reader, field: Field, wireType: number, to: Struct): void {
    const packed = wireType === 2 && WIRE_TYPES[field.type] !== 2;
    const length = packed ? reader.length() : 0;
    if (field.type === 'fixed64') {
        if (length % 8 !== 0) {
            throw new WireFault(`${field.name} ends within a number`);
        }
        to[field.name] = readIds(reader, to[field.name] as BigUint64Array, packed ? length / 8 : 1);
        return;
    }
    const list = to[field.name] as Value[];
    const end = packed ? reader.at + length : 0;
    const outer = reader.end;
    reader.end = packed ? end : outer;
    do {
        if (packed && reader.at === end) {
            break;
        }
        list.push(reader.scalar(field.type));
    } while (packed);
    reader.end = outer;
}

// ---- writing ------------------------------------------------------------------------------------

class Writer {
    private bytes = new Uint8Array(512);
    private view = new DataView(this.bytes.buffer);
    private used = 0;

    private room(count: number): number {
        const at = this.used;
        this.used += count;
        if (this.used > this.bytes.length) {
            const grown = new Uint8Array(Math.max(2 * this.bytes.length, this.used));
            grown.set(this.bytes);
            this.bytes = grown;
            this.view = new DataView(grown.buffer);
        }
        return at;
    }

    private byte(value: number): void {
        const at = this.room(1); // before `bytes` is read: it may be another one then
        this.bytes[at] = value;
    }

    varint(value: bigint): void {
        for (; value > 127n; value >>= 7n) {
            this.byte(Number(value & 127n) | 128);
        }
        this.byte(Number(value));
    }

    counted(bytes: Uint8Array): void {
        this.varint(BigInt(bytes.length));
        const at = this.room(bytes.length);
        this.bytes.set(bytes, at);
    }

    scalar(type: string, value: Value): void {
        if (type === 'double') {
            const at = this.room(8);
            this.view.setFloat64(at, value as number, true);
        } else if (type === 'float') {
            const at = this.room(4);
            this.view.setFloat32(at, value as number, true);
        } else if (type === 'fixed64') {
            const at = this.room(8);
            this.view.setBigUint64(at, value as bigint, true);
        } else if (type === 'string') {
            this.counted(letters.encode(value as string));
        } else if (type === 'bytes') {
            this.counted(value as Uint8Array);
        } else {
            this.varint(BigInt(value as number | bigint | boolean));
        }
    }

    finish(): Uint8Array {
        return this.bytes.slice(0, this.used);
    }
}

function isEmpty(value: Value): boolean {
    return value === 0 ? !Object.is(value, -0) : value === 0n || value === false || value === '' ||
        (value instanceof Uint8Array && value.length === 0);
}

// ---- both ---------------------------------------------------------------------------------------

export class Wire {
    private readonly byNumber = new Map<string, Map<number, Field>>();

    constructor(private readonly schema: Schema) {
        for (const [name, fields] of Object.entries(schema)) {
            this.byNumber.set(name, new Map(fields.map((field) => [field.number, field])));
        }
    }

    private read(reader: Reader, name: string, length: number): Struct {
        const struct: Struct = {};
        for (const field of this.schema[name]!) {
            if (name !== 'Message') {
                struct[field.name] = !field.repeated ? emptyOf(field.type)
                    : field.type === 'fixed64' ? new BigUint64Array(0) : [];
            }
        }
        const outer = reader.end, end = reader.at + length;
        reader.end = end;
        while (reader.at < end) {
            const key = reader.word();
            const field = this.byNumber.get(name)!.get(key >>> 3);
            const wireType = key & 7;
            if (field === undefined) {
                reader.pass(wireType);
            } else {
                this.readField(reader, name, field, wireType, struct);
            }
        }
        reader.end = outer;
        return struct;
    }

    private readField(reader: Reader, name: string, field: Field, wireType: number,
                      struct: Struct): void {
        const expected = WIRE_TYPES[field.type] ?? 2;
        if (wireType !== expected && !(field.repeated && wireType === 2)) {
            throw new WireFault(`${name}.${field.name} is of another type`);
        }
        if (WIRE_TYPES[field.type] !== undefined) {
            if (field.repeated) {
                readRepeated(reader, field, wireType, struct);
            } else {
                struct[field.name] = reader.scalar(field.type);
            }
            return;
        }
        const inner = this.read(reader, field.type, reader.length());
        if (!field.repeated) {
            if (name === 'Message') { // the last of a oneof counts
                Object.keys(struct).forEach((key) => delete struct[key]);
            }
            struct[field.name] = inner;
            return;
        }
        const list = struct[field.name] as Value[];
        list.push(inner);
        if (list.length > MAX_MESSAGES) {
            throw new WireFault(`an envelope has more than ${MAX_MESSAGES} messages`);
        }
    }

    /** Takes an envelope apart. Pictures are views of `bytes`. Throws WireFault. */
    decode(bytes: Uint8Array): Envelope {
        if (bytes.length === 0 || bytes.length > ENVELOPE_BYTES) {
            throw new WireFault(`an envelope has ${bytes.length} bytes`);
        }
        const envelope = this.read(new Reader(bytes), 'Envelope', bytes.length);
        const messages = envelope.messages as unknown as Message[];
        if (messages.length === 0 || (messages.length > 1 && bytes.length > BATCH_BYTES)) {
            throw new WireFault(`an envelope of ${messages.length} messages has ${bytes.length} ` +
                                'bytes');
        }
        return { batch: envelope.batch as number, messages };
    }

    private write(name: string, struct: Struct): Uint8Array {
        const writer = new Writer();
        for (const field of this.schema[name]!) {
            const value = struct[field.name];
            if (value === undefined) {
                continue;
            }
            const wireType = WIRE_TYPES[field.type];
            const key = BigInt(field.number * 8 + (field.repeated ? 2 : wireType ?? 2));
            if (wireType === undefined) {
                for (const inner of field.repeated ? value as Value[] : [value]) {
                    writer.varint(key);
                    writer.counted(this.write(field.type, inner as Struct));
                }
            } else if (field.repeated) {
                const list = value as Value[] | BigUint64Array;
                if (list.length > 0) {
                    const packed = new Writer();
                    list.forEach((one: Value) => packed.scalar(field.type, one));
                    writer.varint(key);
                    writer.counted(packed.finish());
                }
            } else if (!isEmpty(value)) {
                writer.varint(key);
                writer.scalar(field.type, value);
            }
        }
        return writer.finish();
    }

    encode(batch: number, messages: Outgoing[]): Uint8Array {
        const struct = { batch, messages } as unknown as Struct;
        const bytes = this.write('Envelope', struct);
        if (messages.length > 1 && bytes.length > BATCH_BYTES + HEAD_BYTES) {
            throw new WireFault('too much for one envelope');
        }
        return bytes;
    }
}
