// wasm.ts: the C code (src/display, the run-length decoder) as the page sees it.
export interface Exports {
    memory: WebAssembly.Memory;
    vd_wasm_mark(): number;
    vd_wasm_return(mark: number): void;
    vd_wasm_take(bytes: number): number;
    vd_wasm_unpack_runs(data: number, bytes: number, width: number, height: number, rgba: number,
                        stride: number): number;
    vd_wasm_unpack_plane(data: number, bytes: number, count: number, plane: number): number;
    vd_wasm_scene_create(slots: number, heapBytes: number): number;
    vd_wasm_scene_add(slot: number, width: number, height: number): number;
    vd_wasm_scene_place(slot: number, corners: number, opaque: number, fixed: number): void;
    vd_wasm_scene_remove(slot: number): void;
    vd_wasm_scene_bytes(): number;
    vd_wasm_placed_create(bytes: number): number;
    vd_wasm_model_room(bytes: number): number;
    vd_wasm_model_add(slot: number, block: number, bytes: number): number;
    vd_wasm_model_remove(slot: number): void;
    vd_wasm_brick_add(slot: number, block: number, bytes: number, origin: number): number;
    vd_wasm_brick_remove(slot: number): void;
    vd_wasm_instance_add(slot: number, model: number, numbers: number): number;
    vd_wasm_instance_remove(slot: number): void;
    vd_wasm_light_set(numbers: number): void;
    vd_wasm_camera_aim(camera: number, heading: number, pitch: number, roll: number, fov: number,
                       width: number, height: number): void;
    vd_wasm_fill(rgba: number, height: number, stride: number, color: number): void;
    vd_wasm_scene_draw(camera: number, rgba: number, width: number, height: number, stride: number,
                       count: number, bounds: number): number;
    vd_wasm_scene_is_absurd(): number;
    vd_wasm_screen_draw(camera: number, rgba: number, width: number, height: number, stride: number,
                        from: number, picture: number, pictureWidth: number,
                        pictureHeight: number): number;
}

export async function instantiate(module: WebAssembly.Module): Promise<Exports> {
    return (await WebAssembly.instantiate(module, {})).exports as unknown as Exports;
}

/** Takes memory or throws; what was taken goes back by vd_wasm_return. */
export function take(wasm: Exports, bytes: number): number {
    const at = wasm.vd_wasm_take(bytes);
    if (at === 0) {
        throw new RangeError(`no memory for ${bytes} bytes`);
    }
    return at;
}

/** The piece of a sentence that C code returned. */
export function sentenceAt(wasm: Exports, address: number): string {
    const bytes = new Uint8Array(wasm.memory.buffer, address, 200);
    const end = bytes.indexOf(0);
    return new TextDecoder().decode(bytes.slice(0, end < 0 ? bytes.length : end));
}
