// session.ts: one client's connection: docs/wire.md, "States". No browser in it but a socket, fetch and a
// clock, so that it is tested without one.
//
//   CONNECTING ─► LOADING ─► SHOWING        refused, version, ended: somebody must do something
//       ▲            │          │
//       └── lost ◄───┴──────────┘           tries again, later each time; what is shown stays
import { checkMessage, VERSION } from './checks.js';
import type { CameraNumbers, Item, ToDisplay, ToLink } from './items.js';
import { readWorld, type LinkSetup, type LinkStats, type Remedy, type State, type Status, type Wishes,
         type WorldInfo } from './status.js';
import type { Unpacker } from './codec.js';
import { ENVELOPE_BYTES, WireFault, type Envelope, type Geometry, type Impostor, type Instance,
         type Message, type Outgoing, type Screen, type Stats, type Wire } from './wire.js';

export interface Socket {
    binaryType: string;
    onopen: ((event: never) => void) | null;
    onmessage: ((event: { data: unknown }) => void) | null;
    onclose: ((event: { code: number }) => void) | null;
    send(bytes: Uint8Array): void;
    close(code?: number): void;
}

/** What is around it. */
export interface Surroundings {
    connect(url: string, protocol: string): Socket;
    /** Status and text of a GET; rejects where there is no answer. */
    get(url: string, token: string): Promise<{ status: number; text: string }>;
    now(): number; // seconds
    later(seconds: number, call: () => void): unknown;
    never(timer: unknown): void;
    random(): number;
    toDisplay(message: ToDisplay, moved: Transferable[]): void;
    report(status: Status): void;
    stats(stats: LinkStats): void;
    world(world: WorldInfo): void;
}

const RETRY_S = [0.5, 1, 2, 4, 8, 15];
const ANSWER_S = 10;        // to connect, and for a hello
const CAMERA_S = 0.3;       // then a camera counts as answered
const QUIET_S = 5, SILENT_S = 25;
const MOST_WAITING_BYTES = 4 * ENVELOPE_BYTES;
const MOST_HANDED_BYTES = 128 << 20; // unpacked, on their way to the display
const SENT_CAMERAS = 64;
const MOST_PARTICLES = 1 << 18;      // of bricks, that are drawn for a frame
export const WORLD_BYTES = 1 << 20; // most of /world.json
const MODES = { impostors: 1, screens: 2 };
const MODELS_BIT = 1 << 8, BRICKS_BIT = 1 << 9, SCREENS_BIT = 1 << 10, GROUND_BIT = 1 << 11;
const FIXED_BIT = 1 << 12;
const MODEL = 1; // a kind of geometry
const TOO_MUCH = 6; // an error's code

/** Error codes of the wire, and what helps. */
const FAULTS: Record<number, [State, Remedy]> = {
    1: ['refused', 'again'], 2: ['version', 'reload'], 3: ['refused', 'token'], 4: ['lost', 'wait'],
    5: ['refused', 'again'], 6: ['refused', 'again'], 7: ['lost', 'wait'], 8: ['lost', 'wait'],
};

interface SentCamera { sequence: number; camera: CameraNumbers; at: number }

export class Session {
    private socket: Socket | null = null;
    private generation = 0; // of connections: what an old one said counts no longer
    private attempts = 0;
    private timer: unknown = null;
    private watch: unknown = null;
    private world: WorldInfo | null = null;
    private status: Status = { state: 'connecting', sentence: '', remedy: 'none', retryInS: 0,
                               pictures: 0, bytes: 0 };
    private wishes: Wishes;
    private readonly numbers: LinkStats = { bytesPerSecond: 0, roundTripS: 0, latencyS: 0, decodeS: 0,
        errorPx: 0, serverBytesPerSecond: 0, queuedBytes: 0, clients: 0, received: 0 };
    private greeted = false;
    private heardAt = 0;
    private pingAt = 0;
    private waiting: { bytes: Uint8Array; generation: number }[] = [];
    private waitingBytes = 0;
    private working = false;
    private handedBytes = 0;
    private onRoom: (() => void) | null = null;
    private newest: { camera: CameraNumbers; time: number } | null = null;
    private sent: SentCamera[] = [];
    private sequence = 0;
    private unanswered = false;
    private batch = 0;
    private lastTime = 0;
    private second = { since: 0, bytes: 0 };
    private frames = { frames_per_s: 0, frame_p99_s: 0, shown: 0 };
    private onHeld: ((held: { ids: BigUint64Array; versions: number[] }) => void) | null = null;

    constructor(private readonly wire: Wire, private readonly unpacker: Unpacker,
                private readonly setup: LinkSetup, private readonly around: Surroundings) {
        this.wishes = setup.wishes;
        this.watch = around.later(1, () => this.everySecond());
    }

    // ---- states -------------------------------------------------------------------------------------

    private tell(change: Partial<Status>): void {
        this.status = { ...this.status, ...change };
        this.around.report(this.status);
    }

    private hangUp(): void {
        const { socket } = this;
        this.generation++;
        this.socket = null;
        this.greeted = this.unanswered = false;
        this.waiting = [];
        this.waitingBytes = 0;
        this.around.never(this.timer);
        if (socket !== null) {
            socket.onopen = socket.onmessage = socket.onclose = null;
            socket.close(1000);
        }
    }

    /** What was shown stays; another try follows, later each time. */
    private lose(sentence: string, leastS = 0): void {
        this.hangUp();
        const step = RETRY_S[Math.min(this.attempts++, RETRY_S.length - 1)]!;
        const seconds = Math.max(leastS, step * (0.75 + 0.5 * this.around.random()));
        this.timer = this.around.later(seconds, () => void this.connect());
        this.tell({ state: 'lost', sentence, remedy: 'wait', retryInS: seconds });
    }

    private refuse(state: State, sentence: string, remedy: Remedy): void {
        this.hangUp();
        this.tell({ state, sentence, remedy, retryInS: 0 });
    }

    /** The server is at fault: it is told, and left. */
    private blame(fault: unknown, code = 1): void {
        const sentence = fault instanceof WireFault ? fault.message
            : `what the server sent could not be used (${String(fault).slice(0, 120)})`;
        try {
            this.send([{ error: { code, sentence: sentence.slice(0, 120) } }]);
        } catch { /* it is being left */ }
        this.refuse('refused', `The server sent what cannot be right: ${sentence}`, 'again');
    }

    /** Ends for good; the server is told. */
    close(): void {
        this.around.never(this.watch);
        try {
            this.send([{ bye: { reason: 1, sentence: '' } }]);
        } catch { /* not connected */ }
        this.hangUp();
    }

    /** Another token was given, or somebody asked to try again now. */
    async again(token: string): Promise<void> {
        this.setup.token = token;
        this.attempts = 0;
        await this.connect();
    }

    /** There is a network again: the next try need not wait. */
    hurry(): void {
        if (this.status.state === 'lost') {
            void this.again(this.setup.token);
        }
    }

    // ---- connecting ---------------------------------------------------------------------------------

    async connect(): Promise<void> {
        this.hangUp();
        const { generation } = this;
        const lost = this.status.state === 'lost';
        this.tell({ ...(lost ? {} : { state: 'connecting' as const, sentence: '' }), pictures: 0,
                    bytes: 0, retryInS: 0 });
        try {
            const answer = await this.around.get(`${this.setup.origin}world.json`, this.setup.token);
            if (generation !== this.generation) {
                return;
            }
            if (answer.status === 401 || answer.status === 403) {
                this.refuse('refused', this.setup.token === ''
                    ? 'This address lacks its token. Open the whole address that the server printed.'
                    : "The token is not the server's. Open the whole address that it printed.",
                            'token');
                return;
            }
            const world = answer.status === 200 && answer.text.length <= WORLD_BYTES
                ? readWorld(answer.text) : null;
            if (world === null) {
                this.lose(`The server's answer is none of ours (status ${answer.status}).`);
                return;
            }
            this.open(world, generation);
        } catch {
            if (generation === this.generation) {
                this.lose('The server does not answer.');
            }
        }
    }

    private open(world: WorldInfo, generation: number): void {
        if (world.wire !== VERSION) {
            this.refuse('version', 'The server is of another version than this page.', 'reload');
            return;
        }
        if (this.world === null) {
            const { camera: c, min, max } = world;
            const [width, height] = c.size;
            this.around.toDisplay({ to: 'world', heading: c.heading, pitch: c.pitch, roll: c.roll,
                fov: c.fov, min, max, camera: { eye: c.eye, orientation: c.orientation, lens: c.lens,
                near: c.near, width, height } }, []);
        }
        this.world = world;
        this.around.world(world);
        const url = this.setup.origin.replace(/^http/, 'ws').replace(/\/$/, '') + world.socketPath;
        const socket = this.around.connect(url, world.protocol);
        socket.binaryType = 'arraybuffer';
        this.socket = socket;
        socket.onopen = () => void this.greet(generation);
        socket.onclose = () => this.lose(this.greeted ? 'The connection was lost.'
            : 'The server does not take the connection.');
        socket.onmessage = ({ data }) => this.receive(data);
        this.timer = this.around.later(ANSWER_S, () => this.lose('The server does not answer.'));
    }

    private send(messages: Outgoing[]): void {
        this.socket?.send(this.wire.encode(0, messages));
    }

    private settings(): Outgoing {
        const { mode, tolerancePx, quality, bytesPerSecond } = this.wishes;
        return { settings: { mode: MODES[mode], tolerance_px: tolerancePx, quality,
                             bytes_per_s: bytesPerSecond } };
    }

    private async greet(generation: number): Promise<void> {
        const held = await new Promise<{ ids: BigUint64Array; versions: number[] }>((resolve) => {
            this.onHeld = resolve;
            this.around.toDisplay({ to: 'held' }, []);
        });
        if (generation !== this.generation) {
            return;
        }
        this.batch = 0;
        this.sent = [];
        this.heardAt = this.around.now();
        const capabilities = this.unpacker.codecs | MODELS_BIT | BRICKS_BIT | SCREENS_BIT |
            GROUND_BIT | FIXED_BIT;
        this.send([{ hello: { version: VERSION, capabilities,
                              token: this.setup.token, memory_bytes: BigInt(this.setup.memoryBytes),
                              particles: MOST_PARTICLES,
                              width: this.setup.width, height: this.setup.height, name: 'page',
                              held_ids: held.ids, held_versions: held.versions } },
                   this.settings()]);
    }

    // ---- from the server ----------------------------------------------------------------------------

    private receive(data: unknown): void {
        if (!(data instanceof ArrayBuffer)) {
            this.blame(new WireFault('a message is a text'));
            return;
        }
        this.heardAt = this.around.now();
        this.numbers.received += data.byteLength;
        this.second.bytes += data.byteLength;
        this.waitingBytes += data.byteLength;
        if (this.waitingBytes > MOST_WAITING_BYTES) {
            this.blame(new WireFault('more was sent than was acknowledged'));
            return;
        }
        this.waiting.push({ bytes: new Uint8Array(data), generation: this.generation });
        if (!this.working) {
            void this.work();
        }
    }

    /** Takes envelopes in one after the other, since pictures may be unpacked aside. */
    private async work(): Promise<void> {
        this.working = true;
        for (let next = this.waiting.shift(); next !== undefined; next = this.waiting.shift()) {
            try {
                if (this.handedBytes > MOST_HANDED_BYTES) {
                    await new Promise<void>((resolve) => { this.onRoom = resolve; });
                }
                await this.takeIn(this.wire.decode(next.bytes), next.bytes.length, next.generation);
            } catch (fault) {
                if (next.generation === this.generation) {
                    this.blame(fault);
                }
            }
            if (next.generation === this.generation) {
                this.waitingBytes -= next.bytes.length;
            }
        }
        this.working = false;
    }

    private async takeIn(envelope: Envelope, bytes: number, generation: number): Promise<void> {
        const start = this.around.now();
        const items: (Item | Promise<Item>)[] = [];
        this.checkMemory(envelope.messages);
        for (const message of envelope.messages) {
            checkMessage(message);
            if (!this.greeted && !message.hello && !message.error && !message.bye) {
                throw new WireFault('the first message is no hello');
            }
            const item = this.takeMessage(message);
            if (generation !== this.generation) {
                return; // it was the last one
            }
            if (item !== null) {
                items.push(item);
            }
        }
        if (envelope.batch !== 0 && envelope.batch !== this.batch + 1) {
            throw new WireFault(`batch ${envelope.batch} follows batch ${this.batch}`);
        }
        const settled = await Promise.all(items);
        if (generation !== this.generation) {
            return;
        }
        if (envelope.batch !== 0 || settled.length > 0) {
            this.batch = envelope.batch || this.batch;
            this.numbers.decodeS = this.around.now() - start;
            this.handOver(envelope.batch, settled, bytes);
        }
    }

    /** Transparent pictures of any size are a few bytes: what they unpack to is bounded. */
    private checkMemory(messages: Message[]): void {
        let all = 0;
        for (const { impostor, geometry } of messages) {
            const bytes = impostor ? 4 * impostor.width * impostor.height
                : geometry?.block.length ?? 0;
            all += bytes;
            if (bytes > this.setup.memoryBytes || all > 2 * this.setup.memoryBytes) {
                throw new WireFault('pictures take more than the memory that was stated');
            }
        }
    }

    private handOver(batch: number, items: Item[], bytes: number): void {
        const moved = items.flatMap((item) => 'pixels' in item ? [item.pixels.buffer]
            : 'block' in item ? [item.block.buffer] : []);
        const unpacked = moved.reduce((sum, buffer) => sum + buffer.byteLength, 0);
        this.handedBytes += unpacked;
        this.around.toDisplay({ to: 'batch', connection: this.generation, batch, items,
                                bytes: unpacked }, moved);
        this.answered(true);
        const shows = items.some(({ kind }) => kind === 'order' || kind === 'screen');
        this.status.pictures += items.filter((item) => 'pixels' in item).length;
        this.status.bytes += bytes;
        if (this.status.state === 'loading') {
            this.tell({ state: shows ? 'showing' : 'loading' });
        }
    }

    /** What the display is to be given; null for what is dealt with here. */
    private takeMessage(m: Message): Item | Promise<Item> | null {
        if (m.hello) {
            this.takeHello(m.hello.version);
        } else if (m.impostor) {
            return this.takeImpostor(m.impostor);
        } else if (m.screen) {
            return this.takeScreen(m.screen);
        } else if (m.geometry) {
            return this.takeGeometry(m.geometry);
        } else if (m.instance) {
            return this.takeInstance(m.instance);
        } else if (m.light) {
            const { x, y, z } = m.light.sun_direction!;
            return { kind: 'light',
                     numbers: Float64Array.of(x, y, z, ...m.light.colors, m.light.haze_m) };
        } else if (m.ground) {
            return { kind: 'ground', ...m.ground, heights: Float32Array.from(m.ground.heights) };
        } else if (m.order) {
            return { kind: 'order', ids: m.order.ids };
        } else if (m.replace) {
            return { kind: 'replace', out: m.replace.out, in: m.replace.in };
        } else if (m.drop) {
            return { kind: 'drop', ids: m.drop.ids };
        } else if (m.ping) {
            this.send([{ pong: { stamp: m.ping.stamp } }]);
        } else if (m.pong) {
            this.numbers.roundTripS = Math.max(0, this.around.now() - Number(m.pong.stamp) / 1e6);
        } else if (m.stats) {
            this.takeStats(m.stats);
        } else if (m.error) {
            const [state, remedy] = FAULTS[m.error.code] ?? FAULTS[8]!;
            const sentence = m.error.sentence || 'The server refuses, and does not say why.';
            if (state === 'lost') {
                this.lose(sentence, m.error.code === 4 ? 5 : 0);
            } else {
                this.refuse(state, sentence, remedy);
            }
        } else if (m.bye) {
            if (m.bye.reason === 2) {
                this.lose(m.bye.sentence || 'The server stops.');
            } else {
                this.refuse('ended', m.bye.sentence || 'The server has ended this.', 'again');
            }
        }
        return null;
    }

    private takeHello(version: number): void {
        if (this.greeted) {
            throw new WireFault('hello is said once');
        }
        if (version !== VERSION) {
            this.refuse('version', 'The server is of another version than this page.', 'reload');
            return;
        }
        this.around.never(this.timer);
        this.greeted = true;
        this.attempts = 0;
        this.tell({ state: 'loading', sentence: '', remedy: 'none', retryInS: 0 });
        this.around.toDisplay({ to: 'connected' }, []);
        this.ping();
    }

    private takeStats(stats: Stats): void {
        this.numbers.errorPx = stats.error_px;
        this.numbers.serverBytesPerSecond = stats.link_bytes_per_s;
        this.numbers.queuedBytes = Number(stats.queued_bytes);
        this.numbers.clients = Number(stats.clients);
        this.answered(false);
    }

    private takeImpostor(m: Impostor): Item | Promise<Item> {
        const { x, y, z } = m.origin!;
        const from = [x, y, z];
        const corners = Float64Array.from(m.corners, (value, i) => from[i % 3]! + value);
        const make = (pixels: Uint8Array): Item => (
            { kind: 'impostor', id: m.id, version: m.version, corners, opaque: m.opaque,
              width: m.width, height: m.height, pixels, fixed: m.fixed });
        const pixels = this.unpacker.unpack(m.codec, m.picture, m.width, m.height);
        return pixels instanceof Uint8Array ? make(pixels) : pixels.then(make);
    }

    private takeGeometry(m: Geometry): Item {
        const { x, y, z } = m.origin!;
        return m.kind === MODEL
            ? { kind: 'model', id: m.id, version: m.version, block: m.block.slice() }
            : { kind: 'brick', id: m.id, version: m.version, origin: Float64Array.of(x, y, z),
                block: m.block.slice() };
    }

    private takeInstance(m: Instance): Item {
        const { x, y, z } = m.origin!;
        const [height, east, north] = m.ground.length === 3 ? m.ground : [0, 0, 0];
        return { kind: 'instance', id: m.id, version: m.version, model: m.model,
                 numbers: Float64Array.of(x, y, z, ...m.axes, m.sun, height!, east!, north!,
                                          m.ground.length === 3 ? 1 : 0) };
    }

    private takeScreen(m: Screen): Item | Promise<Item> | null {
        const sent = this.sent.find(({ sequence }) => sequence === m.camera);
        if (sent === undefined) {
            if (m.camera > this.sequence) {
                throw new WireFault('a screen is for a camera that was not sent');
            }
            return null; // so old that nobody knows where it was
        }
        if (m.width !== sent.camera.width || m.height !== sent.camera.height) {
            throw new WireFault("a screen is of another size than its camera's");
        }
        const make = (pixels: Uint8Array): Item => (
            { kind: 'screen', camera: sent.camera, exact: m.exact, width: m.width, height: m.height,
              pixels });
        const pixels = this.unpacker.unpack(m.codec, m.picture, m.width, m.height);
        return pixels instanceof Uint8Array ? make(pixels) : pixels.then(make);
    }

    // ---- to the server ------------------------------------------------------------------------------

    /** The server has dealt with the last camera; the newest goes, if there is one. */
    private answered(byBatch: boolean): void {
        const last = this.sent.at(-1);
        if (this.unanswered && last !== undefined && byBatch) {
            this.numbers.latencyS = this.around.now() - last.at;
        }
        this.unanswered = false;
        this.sendCamera();
    }

    private sendCamera(): void {
        const { newest } = this;
        if (newest === null || !this.greeted || this.unanswered) {
            return;
        }
        this.newest = null;
        this.unanswered = true;
        const { camera: c } = newest, sequence = ++this.sequence;
        const [x, y, z] = c.eye, [qx, qy, qz, qw] = c.orientation, [fx, fy, cx, cy] = c.lens;
        this.lastTime = Math.max(this.lastTime, newest.time);
        this.sent.push({ sequence, camera: c, at: this.around.now() });
        if (this.sent.length > SENT_CAMERAS) {
            this.sent.shift();
        }
        this.send([{ camera: { sequence, eye: { x, y, z }, qx, qy, qz, qw, fx, fy, cx, cy,
                               near: c.near, width: c.width, height: c.height,
                               time: this.lastTime } }]);
        const { generation } = this;
        this.around.later(CAMERA_S, () => {
            if (generation === this.generation && this.unanswered && this.sequence === sequence) {
                this.answered(false);
            }
        });
    }

    wish(wishes: Wishes): void {
        this.wishes = wishes;
        this.setup.wishes = wishes;
        if (this.greeted) {
            this.send([this.settings()]);
        }
    }

    /** What the display says. */
    fromDisplay(message: ToLink): void {
        switch (message.to) {
        case 'camera':
            this.newest = message;
            this.setup.width = message.camera.width;
            this.setup.height = message.camera.height;
            this.sendCamera();
            break;
        case 'taken':
            this.taken(message);
            break;
        case 'held':
            this.onHeld?.(message);
            break;
        case 'absurd':
            if (message.connection === this.generation) {
                this.blame(new WireFault('its pictures and models would fill the screen a ' +
                                         'thousand times over'), TOO_MUCH);
            }
            break;
        case 'frames':
            this.frames = { frames_per_s: message.framesPerSecond, frame_p99_s: message.p99,
                            shown: message.shown };
            break;
        }
    }

    private taken({ connection, batch, bytes, held, dropped, fault }:
        Extract<ToLink, { to: 'taken' }>): void {
        this.handedBytes -= bytes;
        if (this.handedBytes <= MOST_HANDED_BYTES) {
            this.onRoom?.();
            this.onRoom = null;
        }
        if (fault !== undefined && connection === this.generation) {
            this.blame(new WireFault(fault));
            return;
        }
        const messages: Outgoing[] = [
            ...batch !== 0 ? [{ acknowledge: { batch, held_bytes: BigInt(held) } }] : [],
            ...dropped.length > 0 ? [{ drop: { ids: dropped } }] : [],
        ];
        if (connection === this.generation && this.greeted && messages.length > 0) {
            this.send(messages);
        }
    }

    // ---- time ---------------------------------------------------------------------------------------

    private ping(): void {
        this.pingAt = this.around.now();
        this.send([{ ping: { stamp: BigInt(Math.round(this.pingAt * 1e6)) } }]);
    }

    private everySecond(): void {
        this.watch = this.around.later(1, () => this.everySecond());
        const now = this.around.now();
        const since = Math.max(now - this.second.since, 1e-3);
        this.numbers.bytesPerSecond = this.second.bytes / since;
        this.second = { since: now, bytes: 0 };
        this.around.stats({ ...this.numbers });
        if (!this.greeted) {
            return;
        }
        if (now - this.heardAt > SILENT_S) {
            this.lose('The server has gone silent.');
            return;
        }
        if (now - this.pingAt > QUIET_S) {
            this.ping();
            const { shown, ...rest } = this.frames;
            this.send([{ stats: { ...rest, decode_s: this.numbers.decodeS, shown: BigInt(shown),
                                  queued_bytes: 0n } }]);
        }
    }
}
