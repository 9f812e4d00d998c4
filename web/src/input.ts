// input.ts: keys, mouse and touch: the keys are those of `veduta view` (docs/view.md).
import type { Axis } from './motion.js';

const HELD: Record<string, [Axis, number]> = {
    KeyW: ['forward', 1], ArrowUp: ['forward', 1], KeyS: ['forward', -1], ArrowDown: ['forward', -1],
    KeyA: ['turn', -1], ArrowLeft: ['turn', -1], KeyD: ['turn', 1], ArrowRight: ['turn', 1],
    KeyR: ['rise', 1], KeyF: ['rise', -1], KeyE: ['look', 1], KeyQ: ['look', -1],
    KeyU: ['fov', 1], KeyJ: ['fov', -1],
};

export type Action = 'help' | 'options' | 'numbers' | 'share' | 'flags' | 'shot' | 'full' | 'bounds' |
    'keep' | 'home' | 'faster' | 'slower' | 'close';

const PRESSED: Record<string, Action> = {
    KeyH: 'help', F1: 'help', KeyP: 'options', KeyN: 'numbers', KeyC: 'share', KeyG: 'shot',
    F11: 'full', KeyV: 'bounds', KeyX: 'keep', Digit0: 'home', Equal: 'faster', NumpadAdd: 'faster',
    BracketRight: 'faster', Minus: 'slower', NumpadSubtract: 'slower', Slash: 'slower',
    Escape: 'close',
};

export interface Controls {
    want(axis: Axis, value: number): void;
    stop(): void;
    turn(right: number, up: number): void; // shares of the picture's height
    move(forward: number, aside: number, zoom: number): void;
    pace(steps: number): void;
    act(action: Action): void;
}

/** Where keys mean what they do everywhere: in fields, and with keys that the browser has. */
function isElsewhere(event: KeyboardEvent): boolean {
    const target = event.target as HTMLElement;
    return event.ctrlKey || event.metaKey || event.altKey ||
        (/^(INPUT|SELECT|TEXTAREA)$/.test(target.tagName) && event.code !== 'Escape');
}

export function listenToKeys(controls: Controls): void {
    const down = new Set<string>();
    const wanted = (axis: Axis) => [...down].reduce(
        (sum, code) => sum + (HELD[code]![0] === axis ? HELD[code]![1] : 0), 0);
    window.addEventListener('keydown', (event) => {
        const held = HELD[event.code], action = PRESSED[event.code];
        if (isElsewhere(event) || (held === undefined && action === undefined)) {
            return;
        }
        event.preventDefault();
        if (held !== undefined) {
            down.add(event.code);
            controls.want(held[0], wanted(held[0]));
        } else if (!event.repeat || action === 'faster' || action === 'slower') {
            controls.act(action === 'share' && event.shiftKey ? 'flags' : action!);
        }
    });
    window.addEventListener('keyup', (event) => {
        const held = HELD[event.code];
        if (held !== undefined && down.delete(event.code)) {
            controls.want(held[0], wanted(held[0]));
        }
    });
    const letGo = () => {
        down.clear();
        controls.stop();
    };
    window.addEventListener('blur', letGo);
    document.addEventListener('visibilitychange', letGo);
}

type Finger = { x: number; y: number };

/** One pointer looks; two move and, apart or together, zoom. */
export function listenToPointers(view: HTMLElement, controls: Controls): void {
    const fingers = new Map<number, Finger>();
    const middle = () => {
        const [a, b] = [...fingers.values()] as [Finger, Finger];
        return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2,
                 apart: Math.max(Math.hypot(a.x - b.x, a.y - b.y), 1) };
    };
    view.addEventListener('pointerdown', (event) => {
        view.setPointerCapture(event.pointerId);
        view.focus({ preventScroll: true });
        if (fingers.size < 2) {
            fingers.set(event.pointerId, { x: event.clientX, y: event.clientY });
        }
    });
    view.addEventListener('pointermove', (event) => {
        const finger = fingers.get(event.pointerId);
        if (finger === undefined) {
            return;
        }
        const height = Math.max(view.clientHeight, 1);
        const before = fingers.size === 2 ? middle() : null;
        const dx = (event.clientX - finger.x) / height, dy = (event.clientY - finger.y) / height;
        finger.x = event.clientX;
        finger.y = event.clientY;
        if (before === null) {
            controls.turn(-dx, dy);
        } else {
            const after = middle();
            controls.move(2 * (after.y - before.y) / height, -2 * (after.x - before.x) / height,
                          after.apart / before.apart);
        }
    });
    for (const end of ['pointerup', 'pointercancel', 'lostpointercapture'] as const) {
        view.addEventListener(end, (event) => fingers.delete(event.pointerId));
    }
    view.addEventListener('wheel', (event) => {
        event.preventDefault();
        controls.pace(-Math.sign(event.deltaY));
    }, { passive: false });
    view.addEventListener('contextmenu', (event) => event.preventDefault());
}
