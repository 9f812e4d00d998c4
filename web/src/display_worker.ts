// display_worker.ts: the worker that moves the camera and draws, at the screen's own rate, with what is
// there. It sleeps while nothing moves and nothing comes.
import type { CameraNumbers, GroundItem, ToDisplay, ToLink } from './items.js';
import { Motion, clearGround, groundAt, move, turn, type Axis, type Pose } from './motion.js';
import { DrawnScale, Intervals } from './pace.js';
import { Scene } from './scene.js';
import { instantiate, type Exports } from './wasm.js';
import { WireFault } from './wire.js';

export type FromPage =
    | { to: 'start'; module: WebAssembly.Module; port: MessagePort; canvas: OffscreenCanvas | null;
        memoryBytes: number; width: number; height: number; pose: Pose | null; screens: boolean }
    | { to: 'want'; axis: Axis; value: number }
    | { to: 'stop' }
    | { to: 'turn'; right: number; up: number }               // shares of the picture's height
    | { to: 'move'; forward: number; aside: number; zoom: number } // shares of the height; a factor
    | { to: 'pace'; steps: number }
    | { to: 'resize'; width: number; height: number }
    | { to: 'pose'; pose: Pose }
    | { to: 'home' }                                           // where it began, to the bit
    | { to: 'screens'; screens: boolean }
    | { to: 'bounds'; bounds: boolean }
    | { to: 'keep'; keep: boolean }
    | { to: 'shoot' }
    | { to: 'tick' };                                          // where the page has the clock
export type ToPage =
    | { to: 'view'; pose: Pose; pace: number; exact: boolean; empty: boolean; shown: number;
        framesPerSecond: number; p99: number; width: number; height: number }
    | { to: 'frame'; pixels: Uint8ClampedArray; stride: number; height: number; width: number }
    | { to: 'shot'; blob: Blob }
    | { to: 'failed'; sentence: string };

const page = self as unknown as {
    onmessage: ((event: MessageEvent<FromPage>) => void) | null;
    postMessage(message: ToPage, moved?: Transferable[]): void;
};

const TELL_MS = 200;
/** After so long without a turn or a move by fingers, a frame is drawn whole. */
const SETTLE_MS = 150;

class Display {
    private readonly motion = new Motion();
    private readonly pace = new Intervals();
    private readonly scale = new DrawnScale();
    private readonly context: OffscreenCanvasRenderingContext2D | null;
    private pose: Pose = { eye: [0, 0, 0], heading: 0, pitch: 0, roll: 0, fov: 60 };
    private camera: CameraNumbers | null = null;
    private min: number[] | null = null;
    private max: number[] | null = null;
    private given: Pose | null;
    private world: Extract<ToDisplay, { to: 'world' }> | null = null;
    private aimed = false;  // the camera is as the pose says; a world's own has its exact numbers
    private changed = true; // the camera, since it was last sent
    private dirty = true;
    private asked = false;
    private lastMs = 0;
    private draggedMs = -Infinity; // when it was last turned or moved by a pointer
    private drawn = { width: 0, height: 0 };
    private connection = 0;        // that the last batch came by
    private heights: GroundItem | null = null;
    private steered = false;       // the pose is somebody's here, neither the world's nor a link's
    private toldMs = 0;
    private screens: boolean;
    private bounds = false;
    private kept = false;   // the server hears of no camera, and so makes no pictures

    constructor(private readonly wasm: Exports, private readonly scene: Scene,
                private readonly port: MessagePort, private readonly canvas: OffscreenCanvas | null,
                private width: number, private height: number, pose: Pose | null,
                screens: boolean) {
        this.context = canvas?.getContext('2d', { alpha: false }) ?? null;
        this.given = pose;
        this.screens = screens;
        this.resize(width, height);
    }

    private post(message: ToLink): void {
        this.port.postMessage(message);
    }

    // ---- the camera -----------------------------------------------------------------------------

    private touch(): void {
        this.dirty = true;
        if (!this.asked && this.camera !== null) {
            this.asked = true;
            if (this.context !== null && typeof requestAnimationFrame !== 'undefined') {
                requestAnimationFrame((now) => this.tick(now));
            } else if (this.context !== null) {
                setTimeout(() => this.tick(performance.now()), 16);
            } // else the page's next tick
        }
    }

    private moved(): void {
        this.aimed = false;
        this.changed = true;
        this.touch();
    }

    private resize(width: number, height: number): void {
        this.width = width;
        this.height = height;
        this.scene.resize(width, height);
        if (this.camera !== null) {
            this.camera = { ...this.camera, width, height };
            this.moved();
        }
    }

    private readonly ground = (x: number, y: number): number =>
        this.heights === null ? -Infinity : groundAt(this.heights, x, y);

    private enter(world: Extract<ToDisplay, { to: 'world' }>): void {
        const { camera, heading, pitch, roll, fov } = world;
        this.steered = false;
        const [x, y, z] = camera.eye;
        this.world = world;
        this.aimed = false;
        this.min = world.min;
        this.max = world.max;
        this.pose = structuredClone(this.given) ?? { eye: [x, y, z], heading, pitch, roll, fov };
        this.camera = { ...camera, width: this.width, height: this.height };
        if (this.given === null && camera.width === this.width && camera.height === this.height) {
            this.aimed = true; // its very numbers
        } else if (this.given === null) {
            const { orientation } = camera; // only the lens is another
            this.scene.aim(this.camera, heading, pitch, roll, fov);
            this.camera.orientation = orientation;
            this.aimed = true;
        }
        this.changed = true;
        this.touch();
    }

    /** Metres a second: a hundredth of the world, more from high up. */
    private fullSpeed(): number {
        const ground = this.ground(this.pose.eye[0], this.pose.eye[1]);
        if (this.min === null || this.max === null) {
            return Math.max(10, 0.5 * Math.abs(this.pose.eye[2] - (ground > -Infinity ? ground : 0)));
        }
        const { min, max } = this;
        const size = Math.hypot(max[0]! - min[0]!, max[1]! - min[1]!);
        const above = this.pose.eye[2] - (ground > -Infinity ? ground : (min[2]! + max[2]!) / 2);
        return Math.max(size / 100, 0.5 * above, 1);
    }

    // ---- frames ---------------------------------------------------------------------------------

    private aim(): CameraNumbers {
        const camera = this.camera!;
        if (!this.aimed) {
            const { eye, heading, pitch, roll, fov } = this.pose;
            const next = { ...camera, eye: [...eye] as CameraNumbers['eye'] };
            this.scene.aim(next, heading, pitch, roll, fov);
            this.camera = next;
            this.aimed = true;
        }
        return this.camera!;
    }

    tick(now: number): void {
        this.asked = false;
        if (this.camera === null) {
            return;
        }
        const moving = this.motion.active;
        if (moving) {
            const seconds = this.lastMs > 0 ? Math.min((now - this.lastMs) / 1000, 0.1) : 1 / 60;
            this.motion.advance(this.pose, this.fullSpeed(), seconds, this.ground);
            this.steered = true;
            this.moved();
        }
        this.lastMs = moving ? now : 0;
        const busy = moving || performance.now() - this.draggedMs < SETTLE_MS;
        if (this.dirty) {
            this.dirty = false;
            const camera = this.aim();
            if (this.changed && !this.kept) {
                this.changed = false;
                this.post({ to: 'camera', camera, time: performance.now() / 1000 });
            }
            const start = performance.now();
            this.show(busy ? this.smaller(camera) : camera);
            if (busy) {
                this.scale.note(performance.now() - start);
            }
            this.pace.note(now);
        }
        if (moving || (busy && this.scale.value < 1)) { // the last one is drawn whole
            this.touch();
        } else {
            this.pace.rest();
        }
        this.tell(now, !moving);
    }

    /** The camera of a frame that can be drawn in time. */
    private smaller(camera: CameraNumbers): CameraNumbers {
        const scale = this.scale.value;
        const width = Math.max(Math.round(camera.width * scale), 2);
        const height = Math.max(Math.round(camera.height * scale), 2);
        const [fx, fy, cx, cy] = camera.lens;
        const [wide, high] = [width / camera.width, height / camera.height];
        return scale === 1 ? camera
            : { ...camera, width, height, lens: [fx * wide, fy * high, cx * wide, cy * high] };
    }

    private show(camera: CameraNumbers): void {
        const frame = this.scene.draw(camera, this.screens, this.bounds);
        this.drawn = { width: frame.width, height: frame.height };
        if (this.scene.absurd) {
            this.scene.absurd = false;
            this.post({ to: 'absurd', connection: this.connection });
        }
        if (this.canvas !== null &&
            (this.canvas.width !== frame.width || this.canvas.height !== frame.height)) {
            this.canvas.width = frame.width;
            this.canvas.height = frame.height;
        }
        const pixels = new Uint8ClampedArray(this.wasm.memory.buffer, frame.at,
                                             4 * frame.stride * frame.height);
        if (this.context !== null) {
            this.context.putImageData(new ImageData(pixels, frame.stride, frame.height), 0, 0);
        } else {
            const copy = pixels.slice();
            page.postMessage({ to: 'frame', pixels: copy, stride: frame.stride,
                               width: frame.width, height: frame.height }, [copy.buffer]);
        }
    }

    private tell(now: number, atOnce: boolean): void {
        if (atOnce || now - this.toldMs > TELL_MS) {
            this.toldMs = now;
            const { framesPerSecond, p99 } = this.pace.numbers;
            page.postMessage({ to: 'view', pose: this.pose, pace: this.motion.pace,
                               exact: this.scene.isExact(this.aim()), empty: this.scene.isEmpty,
                               shown: this.scene.shown, framesPerSecond, p99,
                               ...this.drawn });
            this.post({ to: 'frames', framesPerSecond, p99, shown: Math.max(0, this.scene.shown) });
        }
    }

    private async shoot(): Promise<void> {
        const camera = this.camera;
        if (camera === null) {
            return;
        }
        const frame = this.scene.draw(this.aim(), this.screens, this.bounds);
        const pixels = new Uint8ClampedArray(this.wasm.memory.buffer, frame.at,
                                             4 * frame.stride * frame.height).slice();
        if (typeof OffscreenCanvas === 'undefined') {
            page.postMessage({ to: 'frame', pixels, stride: frame.stride, width: frame.width,
                               height: frame.height });
            return;
        }
        const canvas = new OffscreenCanvas(frame.width, frame.height);
        canvas.getContext('2d', { alpha: false })!.putImageData(
            new ImageData(pixels, frame.stride, frame.height), 0, 0);
        page.postMessage({ to: 'shot', blob: await canvas.convertToBlob({ type: 'image/png' }) });
    }

    // ---- what comes -----------------------------------------------------------------------------

    private takeIn({ connection, batch, items, bytes }: Extract<ToDisplay, { to: 'batch' }>): void {
        let dropped: BigUint64Array = new BigUint64Array(0), fault: string | undefined;
        this.connection = connection;
        for (const item of items) {
            if (item.kind === 'ground') {
                this.takeGround(item);
            }
        }
        try {
            dropped = this.scene.apply(items);
        } catch (error) {
            if (!(error instanceof WireFault)) {
                throw error;
            }
            fault = error.message;
        }
        this.post({ to: 'taken', connection, batch, bytes, held: this.scene.heldBytes, dropped,
                    ...fault !== undefined ? { fault } : {} });
        this.touch();
    }

    /** Where it was flown to before the ground was known, the eye is lifted now. */
    private takeGround(item: GroundItem): void {
        const { eye } = this.pose, height = eye[2];
        this.heights = item;
        if (this.steered) {
            clearGround(this.pose, this.ground);
        }
        if (eye[2] !== height) {
            this.moved();
        }
    }

    fromLink(message: ToDisplay): void {
        switch (message.to) {
        case 'world':
            this.enter(message);
            break;
        case 'held':
            this.post({ to: 'held', ...this.scene.heldIds() });
            break;
        case 'connected':
            this.changed = true;
            this.touch();
            break;
        case 'batch':
            this.takeIn(message);
            break;
        }
    }

    private zoom(factor: number): void {
        const half = Math.tan(this.pose.fov * Math.PI / 360) / Math.min(Math.max(factor, 0.1), 10);
        this.pose.fov = Math.min(Math.max(Math.atan(half) * 360 / Math.PI, 5), 140);
    }

    fromPage(message: FromPage): void {
        switch (message.to) {
        case 'want':
            this.motion.want(message.axis, message.value);
            this.touch();
            break;
        case 'stop':
            this.motion.stop();
            this.touch();
            break;
        case 'turn': // what is in the picture's middle follows the finger
            turn(this.pose, message.right * this.pose.fov, message.up * this.pose.fov);
            this.draggedMs = performance.now();
            this.moved();
            break;
        case 'move': {
            const metres = this.fullSpeed() * this.motion.pace;
            move(this.pose, message.forward * metres, message.aside * metres, 0);
            clearGround(this.pose, this.ground);
            this.steered = true;
            this.zoom(message.zoom);
            this.draggedMs = performance.now();
            this.moved();
            break;
        }
        case 'pace':
            this.motion.pace = Math.min(Math.max(this.motion.pace * 1.25 ** message.steps, 1 / 64),
                                        64);
            this.tell(performance.now(), true);
            break;
        case 'resize':
            this.resize(message.width, message.height);
            break;
        case 'pose':
            this.pose = message.pose;
            this.steered = false;
            this.moved();
            break;
        case 'home':
            if (this.world !== null) {
                this.enter(this.world);
            }
            break;
        case 'screens':
            this.screens = message.screens;
            this.touch();
            break;
        case 'bounds':
            this.bounds = message.bounds;
            this.touch();
            break;
        case 'keep':
            this.kept = message.keep;
            this.touch();
            break;
        case 'shoot':
            void this.shoot();
            break;
        case 'tick':
            if (this.asked) {
                this.tick(performance.now());
            }
            break;
        }
    }
}

async function start(m: Extract<FromPage, { to: 'start' }>): Promise<Display> {
    const wasm = await instantiate(m.module);
    const display = new Display(wasm, new Scene(wasm, m.memoryBytes), m.port, m.canvas, m.width,
                                m.height, m.pose, m.screens);
    m.port.onmessage = guarded(({ data }: MessageEvent<ToDisplay>) => display.fromLink(data));
    return display;
}

/** What goes wrong here is said: a page that stands still for no reason is worse. */
function guarded<T>(call: (event: T) => void): (event: T) => void {
    return (event) => {
        try {
            call(event);
        } catch (error) {
            page.postMessage({ to: 'failed', sentence: String(error).slice(0, 200) });
        }
    };
}

let display: Promise<Display> | null = null;
page.onmessage = async ({ data }) => {
    try {
        if (data.to === 'start') {
            display = start(data);
        }
        const ready = await display;
        if (data.to !== 'start') {
            ready?.fromPage(data);
        }
    } catch (error) {
        page.postMessage({ to: 'failed', sentence: String(error).slice(0, 200) });
    }
};
