// pace.ts: how the page keeps up with the screen: times between frames, and the size of frames that can
// be drawn in time while the camera moves, as app/window_pace.c finds it.

const INTERVALS = 240;

/** Times between frames that follow each other. */
export class Intervals {
    private readonly intervals: number[] = [];
    private last = 0;

    note(now: number): void {
        if (this.last > 0) {
            this.intervals.push(now - this.last);
            if (this.intervals.length > INTERVALS) {
                this.intervals.shift();
            }
        }
        this.last = now;
    }

    rest(): void {
        this.last = 0;
    }

    /** Frames a second and the 99th percentile in seconds, of the last frames that moved. */
    get numbers(): { framesPerSecond: number; p99: number } {
        const sorted = [...this.intervals].sort((a, b) => a - b);
        const sum = sorted.reduce((all, one) => all + one, 0);
        return { framesPerSecond: sum > 0 ? 1000 * sorted.length / sum : 0,
                 p99: (sorted[Math.floor(0.99 * (sorted.length - 1))] ?? 0) / 1000 };
    }
}

/** Coarse: a canvas that is shown at another size costs Chromium 2 ms more without a GPU. */
const STEP = 1 / 8;
const LEAST = 0.5;
const CALM_FRAMES = 24;
const FRAMES = 9;
/** What a frame takes goes by its rows and by its pixels: between the scale and its square. */
const POWER = 1.5;
/** Of the 16.7 ms of a frame at 60 a second: the browser needs the rest to bring it to the screen. */
const BUDGET_MS = 11;

/**
 * A controller with hysteresis: it shrinks at once, and grows a step where there has been room. It
 * goes by the median, for on a busy machine a frame may take long whatever its size.
 */
export class DrawnScale {
    value = 1;
    private readonly whole: number[] = []; // what the last frames would have taken at scale 1
    private calm = 0;

    private set(value: number): void {
        this.value = value;
        this.calm = 0;
    }

    /** A frame of this scale took so long. */
    note(ms: number): void {
        this.whole.push(ms / this.value ** POWER);
        if (this.whole.length > FRAMES) {
            this.whole.shift();
        }
        if (this.whole.length < FRAMES) {
            return;
        }
        const median = [...this.whole].sort((a, b) => a - b)[FRAMES >> 1]!;
        if (median * this.value ** POWER > BUDGET_MS) {
            const fitting = (BUDGET_MS / median) ** (1 / POWER);
            this.set(Math.max(Math.floor(fitting / STEP) * STEP, LEAST));
            return;
        }
        const larger = Math.min(this.value + STEP, 1);
        this.calm = median * larger ** POWER < 0.9 * BUDGET_MS ? this.calm + 1 : 0;
        if (this.calm >= CALM_FRAMES && larger > this.value) {
            this.set(larger);
        }
    }
}
