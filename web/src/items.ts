// items.ts: what the two workers say to each other: pictures unpacked, in the server's order.

export interface CameraNumbers {
    eye: [number, number, number];
    orientation: [number, number, number, number];
    lens: [number, number, number, number];
    near: number;
    width: number;
    height: number;
}

export interface PictureItem {
    kind: 'impostor'; id: bigint; version: number; corners: Float64Array; opaque: number[];
    width: number; height: number; pixels: Uint8Array;
    fixed: boolean; // to the screen
}
export interface ScreenItem {
    kind: 'screen'; camera: CameraNumbers; exact: boolean; width: number; height: number;
    pixels: Uint8Array;
}
export interface ModelItem { kind: 'model'; id: bigint; version: number; block: Uint8Array }
/** `origin`: where the block's numbers begin. */
export interface BrickItem {
    kind: 'brick'; id: bigint; version: number; origin: Float64Array; block: Uint8Array;
}
/** `numbers` as vd_wasm_instance_add takes them. */
export interface InstanceItem {
    kind: 'instance'; id: bigint; version: number; model: bigint; numbers: Float64Array;
}
/** Heights around the eye, the southernmost row first; NO_GROUND: there is none. */
export interface GroundItem {
    kind: 'ground'; x: number; y: number; step: number; columns: number; rows: number;
    heights: Float32Array;
}
export const NO_GROUND = -1e9;

export type Item = PictureItem | ScreenItem | ModelItem | BrickItem | InstanceItem | GroundItem
    | { kind: 'light'; numbers: Float64Array } // as vd_wasm_light_set takes them
    | { kind: 'order'; ids: BigUint64Array }
    | { kind: 'replace'; out: BigUint64Array; in: BigUint64Array }
    | { kind: 'drop'; ids: BigUint64Array };

export type ToDisplay =
    | { to: 'batch'; connection: number; batch: number; items: Item[]; bytes: number }
    | { to: 'world'; camera: CameraNumbers; heading: number; pitch: number; roll: number;
        fov: number; min: number[] | null; max: number[] | null }
    | { to: 'held' }      // what is still there is asked for
    | { to: 'connected' }; // a camera is wanted

export type ToLink =
    | { to: 'camera'; camera: CameraNumbers; time: number }
    | { to: 'taken'; connection: number; batch: number; bytes: number; held: number;
        dropped: BigUint64Array; fault?: string } // fault: what cannot be right
    | { to: 'held'; ids: BigUint64Array; versions: number[] }
    | { to: 'absurd'; connection: number }            // that was ordered last, see scene.ts
    | { to: 'frames'; framesPerSecond: number; p99: number; shown: number };
