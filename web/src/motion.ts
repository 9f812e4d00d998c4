// motion.ts: how keys move the camera, as app/window_motion.c does: speeds approach what is wanted, places
// are their integral in closed form, so that a way is the same in two steps or in two hundred.

export const AXES = ['forward', 'turn', 'rise', 'look', 'fov', 'aside'] as const;
export type Axis = typeof AXES[number];

export interface Pose {
    eye: [number, number, number];
    heading: number; pitch: number; roll: number; fov: number; // degrees
}

const TIME_CONSTANT = 0.08;
const AT_REST = 5e-3;
const NUDGE = 0.5;

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
    advance(pose: Pose, metres: number, seconds: number): void {
        const way = Object.fromEntries(
            AXES.map((axis) => [axis, this.integrate(axis, seconds)])) as Record<Axis, number>;
        turn(pose, way.turn * 60, way.look * 45);
        move(pose, way.forward * metres * this.pace, way.aside * metres * this.pace,
             way.rise * 0.5 * metres * this.pace);
        pose.fov = clamp(pose.fov * Math.exp(way.fov), 5, 140);
    }
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
