// server.mjs: a small server for tests: the built page, a world, and a socket that says what the test wants.
import { createHash } from 'node:crypto';
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import { wire } from './support.mjs';

const dist = fileURLToPath(new URL('../dist/', import.meta.url));
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css',
                '.wasm': 'application/wasm' };

/** That of `veduta serve` (docs/serve.md). */
export const POLICY = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; " +
    "style-src 'self'; img-src 'self' blob: data:; connect-src 'self'; manifest-src 'self'; " +
    "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const FOCAL = 180 / Math.tan(Math.PI / 6);

export const WORLD = {
    name: '<b>alps</b>', version: '0.1.0', wire: 1, objects: 1,
    socket: { path: '/socket', protocol: 'veduta', batch_bytes: 102400 },
    camera: { eye: [0, 0, 0], orientation: [-Math.SQRT1_2, 0, 0, Math.SQRT1_2], heading: 0, pitch: 0,
              roll: 0, fov: 60, near: 0.1, lens: [FOCAL, FOCAL, 320, 180], size: [640, 360] },
    bounds: { min: [-100, -100, -100], max: [100, 100, 100] },
};

/** A client's side of a WebSocket (RFC 6455): whole binary messages, none of them fragmented. */
class Client {
    constructor(socket, hear) {
        this.socket = socket;
        this.hear = hear;
        this.rest = Buffer.alloc(0);
        this.batch = 0;
        socket.on('data', (data) => this.take(data));
        socket.on('error', () => {});
    }

    take(data) {
        this.rest = Buffer.concat([this.rest, data]);
        for (;;) {
            const { rest } = this;
            const short = (rest[1] ?? 0) & 127;
            const head = short === 126 ? 4 : short === 127 ? 10 : 2;
            if (rest.length < head) {
                return;
            }
            const length = short === 126 ? rest.readUInt16BE(2)
                : short === 127 ? Number(rest.readBigUInt64BE(2)) : short;
            if (rest.length < head + 4 + length) {
                return;
            }
            const mask = rest.subarray(head, head + 4);
            const payload = rest.subarray(head + 4, head + 4 + length).map((b, i) => b ^ mask[i & 3]);
            this.rest = rest.subarray(head + 4 + length);
            if ((rest[0] & 15) === 2) {
                wire.decode(new Uint8Array(payload)).messages.forEach((m) => this.hear(m, this));
            }
        }
    }

    bytes(bytes, kind = 2) {
        const { length } = bytes;
        const head = Buffer.alloc(length < 126 ? 2 : length < 65536 ? 4 : 10);
        head[0] = 128 | kind;
        head[1] = length < 126 ? length : length < 65536 ? 126 : 127;
        if (head.length === 4) {
            head.writeUInt16BE(length, 2);
        } else if (head.length === 10) {
            head.writeBigUInt64BE(BigInt(length), 2);
        }
        this.socket.write(Buffer.concat([head, bytes]));
    }

    say(...messages) {
        this.bytes(wire.encode(0, messages));
    }

    /** With the next number, to be acknowledged. */
    send(...messages) {
        this.bytes(wire.encode(++this.batch, messages));
    }

    end() {
        this.socket.destroy();
    }
}

/**
 * Starts one. `hear(message, client)` is called for each message; a hello is answered before.
 * `world` may be changed while it runs.
 */
export async function startServer(hear, port = 0) {
    const clients = new Set();
    const state = { clients, world: WORLD, status: 200, hear, hello: { version: 1, name: 'alps' } };
    const server = createServer((request, response) => {
        const path = normalize(new URL(request.url, 'http://host').pathname);
        const headers = { 'content-security-policy': POLICY, 'x-content-type-options': 'nosniff',
                          'cache-control': 'no-cache', 'cross-origin-opener-policy': 'same-origin',
                          'cross-origin-embedder-policy': 'require-corp' };
        if (path === '/world.json') {
            response.writeHead(state.status, { ...headers, 'content-type': 'application/json' });
            response.end(typeof state.world === 'string' ? state.world : JSON.stringify(state.world));
            return;
        }
        try {
            const name = path === '/' ? 'index.html' : path;
            const body = readFileSync(join(dist, name));
            response.writeHead(200, { ...headers, 'content-type': TYPES[extname(name)] ??
                                                                  'application/octet-stream' });
            response.end(body);
        } catch {
            response.writeHead(404, headers).end();
        }
    });
    server.on('upgrade', (request, socket) => {
        const key = request.headers['sec-websocket-key'];
        const accept = createHash('sha1').update(`${key}258EAFA5-E914-47DA-95CA-C5AB0DC85B11`)
            .digest('base64');
        socket.write('HTTP/1.1 101 Switching Protocols\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n' +
                     `Sec-WebSocket-Accept: ${accept}\r\nSec-WebSocket-Protocol: veduta\r\n\r\n`);
        const client = new Client(socket, (message, one) => {
            if (message.hello && state.hello) {
                one.say({ hello: state.hello });
            }
            state.hear(message, one);
        });
        clients.add(client);
        socket.on('close', () => clients.delete(client));
    });
    await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
    state.port = server.address().port;
    state.url = `http://127.0.0.1:${state.port}/`;
    state.stop = () => new Promise((resolve) => {
        clients.forEach((client) => client.end());
        server.closeAllConnections();
        server.close(resolve);
    });
    return state;
}
