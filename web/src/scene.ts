// scene.ts: the pictures, models and bricks that are kept, what of them is shown, and frames of it, in WebAssembly.
//
// Sizes and counts come from a server: what does not fit into the memory that was stated to it is not
// kept, and it is told. Ids that an order names and that are not held are left out.
import { MAX_IDS } from './checks.js';
import type { BrickItem, CameraNumbers, InstanceItem, Item, ModelItem, PictureItem,
              ScreenItem } from './items.js';
import { sentenceAt, take, type Exports } from './wasm.js';
import { WireFault } from './wire.js';

/** Behind everything, where nothing is: 0xAABBGGRR. */
const BACKGROUND = 0xff332c28;

/** Models, instances and bricks have slots of their own; in an order instances are numbered from here
 *  on, and bricks from there. */
const MAX_MODELS = 4096, MAX_INSTANCES = 16384, INSTANCES = 0x80000000;
const MAX_BRICKS = 16384, BRICKS = 0xc0000000;

/** Ids that the replacements of a batch walk over at most: a thousand of them, of a long order, would hold
 *  up frames for seconds. */
const MAX_WALKED = 1 << 22;

/** What an instance counts, as at the server; what of the memory models and bricks may take; and what
 *  unpacking and drawing them takes beside. */
const INSTANCE_BYTES = 256, MODEL_SHARE = 4, DRAWING_BYTES = 96 << 20;

/** Cameras are 12 doubles in C; two of them are kept, and a picture's place. */
const CAMERA_BYTES = 96;

interface Held {
    kind: 'impostor' | 'model' | 'brick' | 'instance'; slot: number; version: number;
    bytes: number;         // of a block, of an instance
    model: bigint | null;  // an instance's
}

export interface Frame { at: number; width: number; height: number; stride: number }

function sameView(a: CameraNumbers, b: CameraNumbers): boolean {
    return a.width === b.width && a.height === b.height && a.near === b.near &&
        (['eye', 'orientation', 'lens'] as const).every(
            (key) => a[key].every((value, i) => value === b[key][i]));
}

export class Scene {
    private readonly held = new Map<bigint, Held>();
    private readonly freeSlots: number[] = [];
    private readonly freeInstances: number[] = [];
    private readonly freeBricks: number[] = [];
    private readonly modelSlots = new Map<bigint, number>(); // by id, held or only named
    private placedBytes = 0; // of models and instances
    private readonly order: number;
    private readonly camera: number;
    private readonly seen: number;
    private readonly place: number;
    private readonly mark: number;
    private ordered: bigint[] = [];
    private frame: Frame = { at: 0, width: 0, height: 0, stride: 0 };
    private frameMark = 0;
    private screen: (ScreenItem & { at: number }) | null = null;
    private screenIsNewest = false;
    shown = 0;
    /** More was ordered than any world takes; what was is forgotten. */
    absurd = false;

    /** `memoryBytes`: what the server was told that pictures take at most. */
    constructor(private readonly wasm: Exports, private readonly memoryBytes: number) {
        // A quarter more: heads, and a new picture comes before the old one goes.
        this.order = wasm.vd_wasm_scene_create(MAX_IDS, Math.floor(memoryBytes * 1.25));
        if (this.order === 0) {
            throw new RangeError('no memory for pictures');
        }
        if (wasm.vd_wasm_placed_create(Math.floor(memoryBytes / MODEL_SHARE) + DRAWING_BYTES) === 0) {
            throw new RangeError('no memory for models');
        }
        this.camera = take(wasm, 3 * CAMERA_BYTES + 128);
        this.seen = this.camera + CAMERA_BYTES;
        this.place = this.seen + CAMERA_BYTES;
        this.mark = wasm.vd_wasm_mark();
        for (let slot = MAX_IDS - 1; slot >= 0; slot--) {
            this.freeSlots.push(slot);
        }
        for (let slot = MAX_INSTANCES - 1; slot >= 0; slot--) {
            this.freeInstances.push(slot);
        }
        for (let slot = MAX_BRICKS - 1; slot >= 0; slot--) {
            this.freeBricks.push(slot);
        }
    }

    private get bytes(): Uint8Array {
        return new Uint8Array(this.wasm.memory.buffer);
    }

    get heldBytes(): number {
        return this.wasm.vd_wasm_scene_bytes() + this.placedBytes;
    }

    /** What is held, ascending, for a server that may know it. */
    heldIds(): { ids: BigUint64Array; versions: number[] } {
        const ids = new BigUint64Array(this.held.keys()).sort();
        return { ids, versions: Array.from(ids, (id) => this.held.get(id)!.version) };
    }

    private forget(id: bigint): boolean {
        const held = this.held.get(id);
        if (held === undefined) {
            return false;
        }
        this.placedBytes -= held.bytes;
        if (held.kind === 'impostor') {
            this.wasm.vd_wasm_scene_remove(held.slot);
            this.freeSlots.push(held.slot);
        } else if (held.kind === 'instance') {
            this.wasm.vd_wasm_instance_remove(held.slot);
            this.freeInstances.push(held.slot);
        } else if (held.kind === 'brick') {
            this.wasm.vd_wasm_brick_remove(held.slot);
            this.freeBricks.push(held.slot);
        } else {
            this.wasm.vd_wasm_model_remove(held.slot);
        }
        return this.held.delete(id);
    }

    /** Room for a picture, by giving up what is not shown; null when that does not do. */
    private makeRoom(item: PictureItem, slot: number, dropped: Set<bigint>): number {
        let at = this.wasm.vd_wasm_scene_add(slot, item.width, item.height);
        if (at !== 0) {
            return at;
        }
        const needed = new Set(this.ordered);
        for (const [id, { kind }] of this.held) {
            if (kind === 'impostor' && id !== item.id && !needed.has(id)) {
                this.forget(id);
                dropped.add(id);
                at = this.wasm.vd_wasm_scene_add(slot, item.width, item.height);
                if (at !== 0) {
                    break;
                }
            }
        }
        return at;
    }

    /** An id that was something else before is that no more. */
    private forgetOther(item: PictureItem | ModelItem | BrickItem | InstanceItem): void {
        if (this.held.has(item.id) && this.held.get(item.id)!.kind !== item.kind) {
            this.forget(item.id);
        }
    }

    /** The slot of a model, whether it has come or not; undefined when there are too many. */
    private modelSlot(id: bigint): number | undefined {
        if (!this.modelSlots.has(id) && this.modelSlots.size < MAX_MODELS) {
            this.modelSlots.set(id, this.modelSlots.size);
        }
        return this.modelSlots.get(id);
    }

    /** Takes a block, which is checked; false when there is no room for it. */
    private takeBlock(item: ModelItem | BrickItem, slot: number): boolean {
        const { block } = item;
        const room = this.placedBytes + block.length <= this.memoryBytes / MODEL_SHARE
            ? this.wasm.vd_wasm_model_room(block.length) : 0;
        if (room === 0) {
            return false;
        }
        this.bytes.set(block, room);
        let fault: number;
        if (item.kind === 'model') {
            fault = this.wasm.vd_wasm_model_add(slot, room, block.length);
        } else {
            new Float64Array(this.wasm.memory.buffer, this.place, 3).set(item.origin);
            fault = this.wasm.vd_wasm_brick_add(slot, room, block.length, this.place);
        }
        if (fault > 1) {
            throw new WireFault(sentenceAt(this.wasm, fault));
        }
        return fault === 0;
    }

    private keepBlock(item: ModelItem | BrickItem, dropped: Set<bigint>): void {
        this.forgetOther(item);
        this.forget(item.id);
        const slot = item.kind === 'model' ? this.modelSlot(item.id) : this.freeBricks.at(-1);
        if (slot === undefined || !this.takeBlock(item, slot)) {
            dropped.add(item.id);
            return;
        }
        if (item.kind === 'brick') {
            this.freeBricks.pop();
        }
        this.placedBytes += item.block.length;
        this.held.set(item.id, { kind: item.kind, slot, version: item.version,
                                 bytes: item.block.length, model: null });
        dropped.delete(item.id);
    }

    private keepInstance(item: InstanceItem, dropped: Set<bigint>): void {
        this.forgetOther(item);
        this.forget(item.id);
        const model = this.modelSlot(item.model), slot = this.freeInstances.pop();
        if (model === undefined || slot === undefined) {
            if (slot !== undefined) {
                this.freeInstances.push(slot);
            }
            dropped.add(item.id);
            return;
        }
        new Float64Array(this.wasm.memory.buffer, this.place, 17).set(item.numbers);
        this.wasm.vd_wasm_instance_add(slot, model, this.place);
        this.placedBytes += INSTANCE_BYTES;
        this.held.set(item.id, { kind: item.kind, slot, version: item.version,
                                 bytes: INSTANCE_BYTES, model: item.model });
        dropped.delete(item.id);
    }

    private keep(item: PictureItem, dropped: Set<bigint>): void {
        this.forgetOther(item);
        const before = this.held.get(item.id);
        const slot = before?.slot ?? this.freeSlots.pop();
        const at = slot !== undefined ? this.makeRoom(item, slot, dropped) : 0;
        if (slot === undefined || at === 0) {
            if (slot !== undefined) {
                this.freeSlots.push(slot);
            }
            this.held.delete(item.id);
            dropped.add(item.id);
            return;
        }
        this.bytes.set(item.pixels, at);
        new Float64Array(this.wasm.memory.buffer, this.place, 12).set(item.corners);
        new Int32Array(this.wasm.memory.buffer, this.place + 96, 4).set(
            item.opaque.length === 4 ? item.opaque : [0, 0, 0, 0]);
        this.wasm.vd_wasm_scene_place(slot, this.place, this.place + 96, item.fixed ? 1 : 0);
        this.held.set(item.id, { kind: item.kind, slot, version: item.version, bytes: 0,
                                 model: null });
        dropped.delete(item.id);
    }

    /** Those stop being shown, these begin, in the place of the first of those, or in front. */
    private replace(out: BigUint64Array, into: BigUint64Array): void {
        const stops = new Set(out);
        const first = this.ordered.findIndex((id) => stops.has(id));
        const place = first < 0 ? this.ordered.length : first;
        const stay = (id: bigint) => !stops.has(id);
        this.ordered = [...this.ordered.slice(0, place).filter(stay), ...into,
                        ...this.ordered.slice(place).filter(stay)].slice(0, MAX_IDS);
    }

    /** Puts frame and screen behind the scene's own memory anew. */
    private layOut(frame: { width: number; height: number }, screen: ScreenItem | null): void {
        const kept = screen !== null && screen === this.screen
            ? this.bytes.slice(this.screen.at, this.screen.at + 4 * screen.width * screen.height)
            : screen?.pixels;
        const stride = (frame.width + 15) & ~15;
        this.wasm.vd_wasm_return(this.mark);
        this.screen = null;
        this.frame = { ...frame, stride, at: take(this.wasm, 4 * stride * frame.height) };
        this.frameMark = this.wasm.vd_wasm_mark();
        if (screen !== null && kept !== undefined) {
            const at = take(this.wasm, kept.length);
            this.bytes.set(kept, at);
            this.screen = { ...screen, pixels: new Uint8Array(0), at };
        }
    }

    /** Sets the size of frames. */
    resize(width: number, height: number): void {
        if (width !== this.frame.width || height !== this.frame.height) {
            this.layOut({ width, height }, this.screen);
        }
    }

    private takeScreen(item: ScreenItem): void {
        if (this.frameMark !== 0) {
            this.wasm.vd_wasm_return(this.frameMark);
            this.screen = null;
            const at = take(this.wasm, item.pixels.length);
            this.bytes.set(item.pixels, at);
            this.screen = { ...item, pixels: new Uint8Array(0), at };
        }
        // A still picture does not end the order: that is what the camera moves on with.
        this.screenIsNewest = !item.exact || this.ordered.length === 0;
    }

    /** Takes in what came, in its order; returns the ids that found no room. */
    apply(items: Item[]): BigUint64Array {
        const dropped = new Set<bigint>();
        let walked = 0;
        for (const item of items) {
            switch (item.kind) {
            case 'impostor':
                this.keep(item, dropped);
                break;
            case 'model':
            case 'brick':
                this.keepBlock(item, dropped);
                break;
            case 'instance':
                this.keepInstance(item, dropped);
                break;
            case 'light':
                new Float64Array(this.wasm.memory.buffer, this.place, 16).set(item.numbers);
                this.wasm.vd_wasm_light_set(this.place);
                break;
            case 'order':
                this.ordered = Array.from(item.ids);
                this.screenIsNewest = false;
                break;
            case 'replace':
                walked += this.ordered.length;
                if (walked > MAX_WALKED) {
                    throw new WireFault('a batch has too many replacements');
                }
                this.replace(item.out, item.in);
                break;
            case 'drop':
                item.ids.forEach((id) => this.forget(id));
                break;
            case 'screen':
                this.takeScreen(item);
                break;
            }
        }
        return new BigUint64Array(dropped).sort();
    }

    private writeCamera(at: number, c: CameraNumbers): void {
        new Float64Array(this.wasm.memory.buffer, at, 12).set(
            [...c.eye, ...c.orientation, ...c.lens, c.near]);
    }

    /** Turns a camera, and gives it the lens of its size, by the code that servers have. */
    aim(c: CameraNumbers, heading: number, pitch: number, roll: number, fov: number): void {
        this.wasm.vd_wasm_camera_aim(this.camera, heading, pitch, roll, fov, c.width, c.height);
        const numbers = new Float64Array(this.wasm.memory.buffer, this.camera, 12);
        c.orientation = Array.from(numbers.subarray(3, 7)) as CameraNumbers['orientation'];
        c.lens = Array.from(numbers.subarray(7, 11)) as CameraNumbers['lens'];
    }

    /** Whether the next frame is the one that `veduta render` draws of this camera. */
    isExact(camera: CameraNumbers): boolean {
        return this.screen !== null && this.screen.exact && sameView(this.screen.camera, camera);
    }

    /** Whether there is anything to show. */
    get isEmpty(): boolean {
        return this.ordered.length === 0 && this.screen === null;
    }

    /**
     * A frame for a camera of resize's size or a smaller one: RGBA rows in `wasm.memory`, until the next call.
     * `screens`: whole screens are shown whatever else there is; `bounds`: where pictures are.
     */
    draw(camera: CameraNumbers, screens: boolean, bounds: boolean): Frame {
        const { wasm, screen } = this;
        const width = Math.min(camera.width, this.frame.width);
        const height = Math.min(camera.height, this.frame.height);
        const frame = { at: this.frame.at, width, height, stride: (width + 15) & ~15 };
        this.shown = 0;
        if (screen !== null && !bounds && sameView(screen.camera, camera)) {
            return { at: screen.at, width: screen.width, height: screen.height,
                     stride: screen.width };
        }
        this.writeCamera(this.camera, camera);
        wasm.vd_wasm_fill(frame.at, frame.height, frame.stride, BACKGROUND);
        if (screen !== null && (screens || this.screenIsNewest) && screen.width > 1 &&
            screen.height > 1) {
            this.writeCamera(this.seen, screen.camera);
            wasm.vd_wasm_screen_draw(this.camera, frame.at, frame.width, frame.height, frame.stride,
                                     this.seen, screen.at, screen.width, screen.height);
            return frame;
        }
        const numbers = new Uint32Array(wasm.memory.buffer, this.order, MAX_IDS);
        let count = 0;
        for (const id of this.ordered) {
            const held = this.held.get(id);
            if (held?.kind === 'impostor') {
                numbers[count++] = held.slot;
            } else if (held?.kind === 'instance' && this.held.get(held.model!)?.kind === 'model') {
                numbers[count++] = INSTANCES + held.slot;
            } else if (held?.kind === 'brick') {
                numbers[count++] = BRICKS + held.slot;
            }
        }
        this.shown = wasm.vd_wasm_scene_draw(this.camera, frame.at, frame.width, frame.height,
                                             frame.stride, count, bounds ? 1 : 0);
        if (wasm.vd_wasm_scene_is_absurd() !== 0) {
            this.absurd = true;
            this.ordered = [];
        }
        return frame;
    }
}
