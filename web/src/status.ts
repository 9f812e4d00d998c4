// status.ts: what the page says about the connection, and what it asks of it.

export type State = 'connecting' | 'loading' | 'showing' | 'lost' | 'refused' | 'version' | 'ended';

/** Refusals differ in what helps. */
export type Remedy = 'token' | 'again' | 'reload' | 'wait' | 'none';

export interface Status {
    state: State;
    sentence: string;    // by us or the server: text, never markup
    remedy: Remedy;
    retryInS: number;    // lost: until the next try
    pictures: number;    // that came since connecting
    bytes: number;
}

export interface LinkStats {
    bytesPerSecond: number;
    roundTripS: number;  // of a ping
    latencyS: number;    // from a camera to the first batch after it
    decodeS: number;     // of the last batch
    errorPx: number;     // as the server says; 0: it does not
    serverBytesPerSecond: number;
    queuedBytes: number;
    clients: number;
    received: number;    // bytes in all
}

export interface Wishes {
    mode: 'impostors' | 'screens';
    tolerancePx: number;
    quality: number;     // 0: as the server likes; 100: without loss
    bytesPerSecond: number;
}

export interface LinkSetup {
    origin: string;      // of the server: "https://host:port/"
    token: string;
    memoryBytes: number;
    width: number;
    height: number;
    wishes: Wishes;
}

export interface WorldInfo {
    name: string;
    version: string;
    wire: number;
    socketPath: string;
    protocol: string;
    camera: {
        eye: [number, number, number]; orientation: [number, number, number, number];
        heading: number; pitch: number; roll: number; fov: number; near: number;
        lens: [number, number, number, number]; size: [number, number];
    };
    min: number[] | null;
    max: number[] | null;
    objects: number;
}

type Json = Record<string, unknown>;

function numbers(value: unknown, count: number, most = 1e9): number[] | null {
    return Array.isArray(value) && value.length === count &&
        value.every((v) => typeof v === 'number' && Math.abs(v) <= most) ? value as number[] : null;
}

/** Reads a server's /world.json; null where it is not as docs/serve.md says. */
export function readWorld(text: string): WorldInfo | null {
    let root: Json;
    try {
        root = JSON.parse(text) as Json;
    } catch {
        return null;
    }
    const socket = root?.socket as Json | undefined, camera = root?.camera as Json | undefined;
    const bounds = root?.bounds as Json | null | undefined;
    if (typeof socket !== 'object' || typeof camera !== 'object' || socket === null ||
        camera === null || typeof socket.path !== 'string' || !/^\/[\w-][\w./-]*$/.test(socket.path) ||
        typeof socket.protocol !== 'string' || !/^[\w.-]+$/.test(socket.protocol)) {
        return null;
    }
    const eye = numbers(camera.eye, 3), orientation = numbers(camera.orientation, 4, 1.001);
    const lens = numbers(camera.lens, 4, 1e6), size = numbers(camera.size, 2, 16383);
    const single = numbers([camera.heading, camera.pitch, camera.roll, camera.fov, camera.near], 5);
    if (!eye || !orientation || !lens || !size || !single || typeof root.wire !== 'number') {
        return null;
    }
    const [heading, pitch, roll, fov, near] = single as [number, number, number, number, number];
    const length = orientation.reduce((sum, v) => sum + v * v, 0);
    if (!(Math.abs(length - 1) < 1e-6 && fov > 0 && fov < 180 && near >= 1e-6 && near <= 1e6 &&
          lens[0]! >= 1e-3 && lens[1]! >= 1e-3 && size.every((v) => v >= 1))) {
        return null;
    }
    return {
        name: String(root.name ?? '').slice(0, 256), version: String(root.version ?? '').slice(0, 64),
        wire: root.wire, socketPath: socket.path, protocol: socket.protocol,
        camera: { eye, orientation, lens, size, heading, pitch, roll, fov, near } as
            WorldInfo['camera'],
        min: numbers(bounds?.min, 3), max: numbers(bounds?.max, 3),
        objects: Number(root.objects) || 0,
    };
}
