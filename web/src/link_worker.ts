// link_worker.ts: the worker that talks to the server: the display never waits for it.
import schema from '../../src/remote/veduta.proto';
import { Unpacker, type DecodeFile } from './codec.js';
import type { ToLink } from './items.js';
import { Session, WORLD_BYTES } from './session.js';
import type { LinkSetup, LinkStats, Status, Wishes, WorldInfo } from './status.js';
import { instantiate } from './wasm.js';
import { Wire } from './wire.js';

export type FromPage =
    | { to: 'start'; module: WebAssembly.Module; port: MessagePort; setup: LinkSetup }
    | { to: 'wish'; wishes: Wishes }
    | { to: 'again'; token: string }
    | { to: 'close' };
export type ToPage =
    | { to: 'status'; status: Status }
    | { to: 'stats'; stats: LinkStats }
    | { to: 'world'; world: WorldInfo };

const page = self as unknown as {
    onmessage: ((event: MessageEvent<FromPage>) => void) | null;
    postMessage(message: ToPage): void;
};

/** The browser's decoder, through a canvas that keeps what it is given. */
function fileDecoder(): DecodeFile | null {
    if (typeof OffscreenCanvas === 'undefined' || typeof createImageBitmap === 'undefined') {
        return null;
    }
    const canvas = new OffscreenCanvas(1, 1);
    const context = canvas.getContext('2d', { willReadFrequently: true });
    return context === null ? null : async (bytes, type, width, height) => {
        const bitmap = await createImageBitmap(new Blob([bytes as BlobPart], { type }),
                                               { colorSpaceConversion: 'none' });
        try {
            if (bitmap.width !== width || bitmap.height !== height) {
                throw new RangeError('another size');
            }
            canvas.width = width; // also clears
            canvas.height = height;
            context.drawImage(bitmap, 0, 0);
            return context.getImageData(0, 0, width, height).data;
        } finally {
            bitmap.close();
        }
    };
}

async function get(url: string, token: string): Promise<{ status: number; text: string }> {
    const answer = await fetch(url, {
        headers: token !== '' ? { Authorization: `Bearer ${token}` } : {},
        cache: 'no-store', credentials: 'omit', redirect: 'error',
        signal: AbortSignal.timeout(10000),
    });
    return { status: answer.status, text: await readAtMost(answer, WORLD_BYTES) };
}

/** A body's text; fails where it does not end. */
async function readAtMost(answer: Response, most: number): Promise<string> {
    const reader = answer.body?.getReader(), decoder = new TextDecoder();
    let text = '', bytes = 0;
    for (let part = await reader?.read(); part?.value !== undefined; part = await reader?.read()) {
        bytes += part.value.length;
        if (bytes > most) {
            await reader?.cancel();
            throw new RangeError('an answer is too long');
        }
        text += decoder.decode(part.value, { stream: true });
    }
    return text;
}

async function start({ module, port, setup }: Extract<FromPage, { to: 'start' }>): Promise<Session> {
    const unpacker = new Unpacker(await instantiate(module), fileDecoder());
    const session = new Session(new Wire(schema), unpacker, setup, {
        connect: (url, protocol) => new WebSocket(url, protocol) as never,
        get,
        now: () => performance.now() / 1000,
        later: (seconds, call) => setTimeout(call, 1000 * seconds),
        never: (timer) => clearTimeout(timer as number),
        random: Math.random,
        toDisplay: (message, moved) => port.postMessage(message, moved),
        report: (status) => page.postMessage({ to: 'status', status }),
        stats: (stats) => page.postMessage({ to: 'stats', stats }),
        world: (world) => page.postMessage({ to: 'world', world }),
    });
    port.onmessage = ({ data }: MessageEvent<ToLink>) => session.fromDisplay(data);
    void session.connect();
    self.addEventListener('online', () => session.hurry());
    return session;
}

let session: Promise<Session> | null = null;
page.onmessage = async ({ data }) => {
    if (data.to === 'start') {
        session = start(data);
    } else if (data.to === 'wish') {
        (await session)?.wish(data.wishes);
    } else if (data.to === 'again') {
        void (await session)?.again(data.token);
    } else {
        (await session)?.close();
    }
};
