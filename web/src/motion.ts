// motion.ts: how keys move the camera, as app/window_motion.c does: speeds approach what is wanted, places
// are their integral in closed form, so that a way is the same in two steps or in two hundred.

import { NO_GROUND, type GroundItem } from './items.js';

export const AXES = ['forward', 'turn', 'rise', 'look', 'fov', 'aside'] as const;
export type Axis = typeof AXES[number];

export interface Pose {
    eye: [number, number, number];
    heading: number; pitch: number; roll: number; fov: number; // degrees
}

const TIME_CONSTANT = 0.08;
const AT_REST = 5e-3;
const NUDGE = 0.5;

/** Metres that the eye stays above the ground, and seconds that it is looked at ahead, so that it rises
 *  before a slope. */
const CLEARANCE = 10;
const LOOK_AHEAD = 0.6;
const AHEAD_STEPS = 6;

/** Height of the ground; −Infinity where it is not known. */
export type GroundAt = (x: number, y: number) => number;

const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);

/** Turns by degrees, as the mouse does. */
export function turn(pose: Pose, right: number, up: number): void {
    pose.heading = (((pose.heading + right) % 360) + 360) % 360;
    pose.pitch = clamp(pose.pitch + up, -89, 89);
}

export class Motion {
    private readonly wanted = new Map<Axis, number>(AXES.map((axis) => [axis, 0]));
    private readonly speed = new Map<Axis, number>(AXES.map((axis) => [axis, 0]));
    pace = 1;

    /** What keys ask for, −1 … 1 each; one that is newly asked for moves at least a little. */
    want(axis: Axis, value: number): void {
        const before = this.wanted.get(axis)!;
        this.wanted.set(axis, clamp(value, -1, 1));
        if (value !== 0 && value !== before) {
            this.speed.set(axis, clamp(this.speed.get(axis)! + NUDGE * Math.sign(value), -1, 1));
        }
    }

    stop(): void {
        AXES.forEach((axis) => this.wanted.set(axis, 0));
    }

    get active(): boolean {
        return AXES.some((axis) => this.wanted.get(axis) !== 0 || this.speed.get(axis) !== 0);
    }

    private integrate(axis: Axis, seconds: number): number {
        const wanted = this.wanted.get(axis)!, speed = this.speed.get(axis)!;
        const left = Math.exp(-seconds / TIME_CONSTANT);
        const next = wanted + (speed - wanted) * left;
        this.speed.set(axis, wanted === 0 && Math.abs(next) < AT_REST ? 0 : next);
        return wanted * seconds + (speed - wanted) * TIME_CONSTANT * (1 - left);
    }

    /** `metres`: of a second at full speed. */
    advance(pose: Pose, metres: number, seconds: number, ground: GroundAt): void {
        const before = [...pose.eye];
        const way = Object.fromEntries(
            AXES.map((axis) => [axis, this.integrate(axis, seconds)])) as Record<Axis, number>;
        turn(pose, way.turn * 60, way.look * 45);
        move(pose, way.forward * metres * this.pace, way.aside * metres * this.pace,
             way.rise * 0.5 * metres * this.pace);
        riseBeforeSlopes(pose, pose.eye[0] - before[0]!, pose.eye[1] - before[1]!, seconds, ground);
        clearGround(pose, ground);
        pose.fov = clamp(pose.fov * Math.exp(way.fov), 5, 140);
    }
}

/** Rises towards the clearance over the highest ground ahead, the sooner the nearer it is. */
function riseBeforeSlopes(pose: Pose, dx: number, dy: number, seconds: number, ground: GroundAt): void {
    for (let i = 1; i <= AHEAD_STEPS && seconds > 0 && (dx !== 0 || dy !== 0); i++) {
        const ahead = LOOK_AHEAD * i / AHEAD_STEPS;
        const [x, y, z] = pose.eye;
        const least = ground(x + dx * ahead / seconds, y + dy * ahead / seconds) + CLEARANCE;
        if (z < least) {
            pose.eye[2] = least + (z - least) * Math.exp(-seconds / ahead);
        }
    }
}

/** Lifts the eye to the clearance where it is below. */
export function clearGround(pose: Pose, ground: GroundAt): void {
    pose.eye[2] = Math.max(pose.eye[2], ground(pose.eye[0], pose.eye[1]) + CLEARANCE);
}

/** The ground of a window of heights; where some around a place are missing the highest of the others. */
export function groundAt(g: GroundItem, x: number, y: number): number {
    const u = (x - g.x) / g.step, v = (y - g.y) / g.step;
    if (!(u >= 0 && v >= 0 && u < g.columns - 1 && v < g.rows - 1)) {
        return -Infinity;
    }
    const at = Math.floor(v) * g.columns + Math.floor(u);
    const heights = [at, at + 1, at + g.columns, at + g.columns + 1].map((i) => g.heights[i]!);
    const known = heights.filter((height) => height > NO_GROUND);
    if (known.length < 4) {
        return Math.max(...known); // −Infinity of none
    }
    const [a, b, c, d] = heights as [number, number, number, number];
    const east = u - Math.floor(u), low = a + east * (b - a), high = c + east * (d - c);
    return low + (v - Math.floor(v)) * (high - low);
}

/** Moves along the heading, to the right of it, and up. */
export function move(pose: Pose, forward: number, aside: number, up: number): void {
    const heading = pose.heading * Math.PI / 180;
    const way = [forward * Math.sin(heading) + aside * Math.cos(heading),
                 forward * Math.cos(heading) - aside * Math.sin(heading), up];
    way.forEach((metres, i) => {
        pose.eye[i as 0 | 1 | 2] = clamp(pose.eye[i as 0 | 1 | 2] + metres, -1e9, 1e9);
    });
}
