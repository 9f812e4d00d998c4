// checks.ts: the bounds of what a server may say (src/remote/veduta.proto), for what has come.
import { WireFault, type Ground, type Impostor, type Instance, type Light, type Message, type Screen, type Vector } from './wire.js';

export const VERSION = 1;
export const CODECS = ['auto', 'raw', 'runs', 'runs-zstd', 'png', 'jpeg', 'webp', 'webp-lossless'];
export const MAX_IDS = 65536;

const MAX_REPLACED = 4096;
const MAX_SIDE = 16383;
const IMPOSTOR_PIXELS = 1 << 24;
const SCREEN_PIXELS = 1 << 26;
const PICTURE_BYTES = 8 << 20;
const SCREEN_BYTES = 15 << 20;
const MOST_COORDINATE = 1e9;
const MOST_CORNER = 1e7;
const MOST_NUMBER = 1e15;
const MOST_METRES = 1e6;
const MOST_LIGHT = 1e6;
const MOST_HAZE = 1e12;
const UNIT_TOLERANCE = 1e-6;
const GROUND_SIDE = 129;
const NAME_BYTES = 256;
const SENTENCE_BYTES = 380;
const LOSSLESS = new Set([1, 2, 3, 4, 7]);

function within(field: string, value: number, least: number, most: number): void {
    if (!(value >= least && value <= most)) { // also of NaN
        throw new WireFault(`${field} is ${value}; ${least} to ${most} is possible`);
    }
}

function letters(field: string, value: string, most: number): void {
    // The least that so many UTF-16 units can take; exact to a factor that does no harm.
    within(`${field}'s length`, value.length, 0, most);
}

function vector(field: string, value: Vector | undefined): void {
    if (value === undefined) {
        throw new WireFault(`${field} is missing`);
    }
    for (const part of [value.x, value.y, value.z]) {
        within(field, part, -MOST_COORDINATE, MOST_COORDINATE);
    }
}

function ids(field: string, list: BigUint64Array, least: number, most: number,
             ascending: boolean): void {
    within(`${field}'s count`, list.length, least, most);
    for (let i = 0; i < list.length; i++) {
        if (list[i] === 0n) {
            throw new WireFault(`${field} has the id 0`);
        }
        if (ascending && i > 0 && list[i]! <= list[i - 1]!) {
            throw new WireFault(`${field} does not ascend`);
        }
    }
}

/** Most bytes that a run-length picture takes. */
export function runsBound(width: number, height: number): number {
    return height * (4 + 2 * Math.ceil(width / 32768) + 4 * width);
}

/** Most bytes that run-length alpha takes. */
export function planeBound(count: number): number {
    return 2 * Math.ceil(count / 32768) + count;
}

function picture(name: string, m: Impostor | Screen, leastSide: number, mostPixels: number,
                 mostBytes: number): void {
    within(`${name}.width`, m.width, leastSide, MAX_SIDE);
    within(`${name}.height`, m.height, leastSide, MAX_SIDE);
    within(`${name}'s pixels`, m.width * m.height, 1, mostPixels);
    within(`${name}.codec`, m.codec, 1, CODECS.length - 1);
    const raw = 4 * m.width * m.height;
    // Libraries have heads: of small pictures they are most of the bytes.
    const bound = m.codec === 1 ? raw : m.codec === 2 ? runsBound(m.width, m.height)
        : 2 * raw + 65536;
    within(`${name}.picture's bytes`, m.picture.length, m.codec === 1 ? raw : 1,
           Math.min(bound, mostBytes));
}

function corners(p: number[]): void {
    if (p.length !== 12) {
        throw new WireFault(`impostor.corners has ${p.length} numbers, not 12`);
    }
    let longest = 0, largest = 0, off = 0;
    p.forEach((value) => {
        within('impostor.corners', value, -MOST_CORNER, MOST_CORNER);
        largest = Math.max(largest, Math.abs(value));
    });
    for (let k = 0; k < 3; k++) {
        const [a, b, c, d] = [p[k]!, p[3 + k]!, p[6 + k]!, p[9 + k]!];
        longest = Math.max(longest, Math.abs(b - a), Math.abs(d - a));
        off = Math.max(off, Math.abs(c - b - d + a));
    }
    if (off > 1e-3 * longest + 4e-7 * largest) {
        throw new WireFault('impostor.corners are no parallelogram');
    }
}

function impostor(m: Impostor): void {
    within('impostor.version', m.version, 1, 0xffffffff);
    ids('impostor.id', BigUint64Array.of(m.id), 1, 1, false);
    vector('impostor.origin', m.origin);
    corners(m.corners);
    within('impostor.nearer', m.nearer, 1, 1e6);
    picture('impostor', m, 2, IMPOSTOR_PIXELS, PICTURE_BYTES);
    if (m.opaque.length !== 0 && m.opaque.length !== 4) {
        throw new WireFault(`impostor.opaque has ${m.opaque.length} numbers, neither 0 nor 4`);
    }
    if (m.opaque.length === 4) {
        const [left, top, right, bottom] = m.opaque as [number, number, number, number];
        within('impostor.opaque', right, left, m.width);
        within('impostor.opaque', bottom, top, m.height);
    }
}

function instance(m: Instance): void {
    ids('instance.id', BigUint64Array.of(m.id, m.model), 2, 2, false);
    within('instance.version', m.version, 1, 0xffffffff);
    vector('instance.origin', m.origin);
    within('instance.sun', m.sun, 0, 1);
    within("instance.axes's count", m.axes.length, 9, 9);
    if (m.ground.length !== 0 && m.ground.length !== 3) {
        throw new WireFault(`instance.ground has ${m.ground.length} numbers, neither 0 nor 3`);
    }
    m.axes.forEach((value) => within('instance.axes', value, -MOST_METRES, MOST_METRES));
    m.ground.forEach((value) => within('instance.ground', value, -MOST_METRES, MOST_METRES));
}

function light(m: Light): void {
    vector('light.sun_direction', m.sun_direction);
    const { x, y, z } = m.sun_direction!;
    within("light.sun_direction's squared length", x * x + y * y + z * z, 1 - UNIT_TOLERANCE,
           1 + UNIT_TOLERANCE);
    within("light.colors's count", m.colors.length, 12, 12);
    m.colors.forEach((value) => within('light.colors', value, 0, MOST_LIGHT));
    within('light.haze_m', m.haze_m, 0, MOST_HAZE);
}

function ground(m: Ground): void {
    within('ground.x', m.x, -MOST_COORDINATE, MOST_COORDINATE);
    within('ground.y', m.y, -MOST_COORDINATE, MOST_COORDINATE);
    within('ground.step', m.step, 1e-3, MOST_METRES);
    within('ground.columns', m.columns, 2, GROUND_SIDE);
    within('ground.rows', m.rows, 2, GROUND_SIDE);
    within("ground.heights's count", m.heights.length, m.columns * m.rows, m.columns * m.rows);
    m.heights.forEach((value) => within('ground.heights', value, -MOST_COORDINATE, MOST_COORDINATE));
}

/** Throws WireFault where a server's message is out of bounds. */
export function checkMessage(m: Message): void {
    const client = (['camera', 'acknowledge', 'settings'] as const).find((k) => m[k] !== undefined);
    if (client !== undefined) {
        throw new WireFault(`the message ${client} is not for a server to send`);
    }
    if (m.hello) {
        within('hello.version', m.hello.version, 1, 65535);
        letters('hello.name', m.hello.name, NAME_BYTES);
        within('hello.particles', m.hello.particles, 0, 0); // the client's to say
    } else if (m.impostor) {
        impostor(m.impostor);
    } else if (m.order) {
        ids('order.ids', m.order.ids, 0, MAX_IDS, false);
    } else if (m.geometry) {
        ids('geometry.id', BigUint64Array.of(m.geometry.id), 1, 1, false);
        within('geometry.version', m.geometry.version, 1, 0xffffffff);
        vector('geometry.origin', m.geometry.origin);
        within('geometry.kind', m.geometry.kind, 1, 2);
        within("geometry.block's bytes", m.geometry.block.length, 1, PICTURE_BYTES);
    } else if (m.instance) {
        instance(m.instance);
    } else if (m.light) {
        light(m.light);
    } else if (m.ground) {
        ground(m.ground);
    } else if (m.replace) {
        ids('replace.out', m.replace.out, 0, MAX_REPLACED, true);
        ids('replace.in', m.replace.in, 0, MAX_REPLACED, true);
        within("replace's count", m.replace.out.length + m.replace.in.length, 1, 2 * MAX_REPLACED);
    } else if (m.drop) {
        ids('drop.ids', m.drop.ids, 1, MAX_IDS, true);
    } else if (m.screen) {
        within('screen.camera', m.screen.camera, 1, 0xffffffff);
        picture('screen', m.screen, 1, SCREEN_PIXELS, SCREEN_BYTES);
        if (m.screen.exact && !LOSSLESS.has(m.screen.codec)) {
            throw new WireFault(`screen.exact is said of a ${CODECS[m.screen.codec]} picture`);
        }
    } else if (m.stats) {
        for (const [key, value] of Object.entries(m.stats)) {
            within(`stats.${key}`, Number(value), 0, MOST_NUMBER);
        }
    } else if (m.error) {
        letters('error.sentence', m.error.sentence, SENTENCE_BYTES);
    } else if (m.bye) {
        letters('bye.sentence', m.bye.sentence, SENTENCE_BYTES);
    }
}
