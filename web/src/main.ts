// main.ts: the page: what is said and asked. Workers talk to the server and draw; nothing here waits.
import './style.css';
import wasmUrl from '../generated/veduta-display.wasm?url';
import type { FromPage as ToDisplay, ToPage as FromDisplay } from './display_worker.js';
import { listenToKeys, listenToPointers, type Action } from './input.js';
import type { FromPage as ToLink, ToPage as FromLink } from './link_worker.js';
import { formatFlags, formatFragment, parseFragment } from './share.js';
import type { LinkStats, State, Status, Wishes } from './status.js';

const SERVER_PIXELS = 1 << 23; // more are not drawn for anybody
const AUTO_PIXELS = 1e6;

function find<T extends HTMLElement>(id: string): T {
    return document.getElementById(id) as T;
}

const canvas = find<HTMLCanvasElement>('view');
const fragment = parseFragment(location.hash);
let token = fragment.token;
let view: Extract<FromDisplay, { to: 'view' }> | null = null;
let status: Status | null = null;
let linkStats: LinkStats | null = null;
let failed = false;

const link = new Worker(new URL('./link_worker.ts', import.meta.url), { type: 'module' });
const display = new Worker(new URL('./display_worker.ts', import.meta.url), { type: 'module' });
const toLink = (message: ToLink, moved: Transferable[] = []) => link.postMessage(message, moved);
const toDisplay = (message: ToDisplay, moved: Transferable[] = []) =>
    display.postMessage(message, moved);

// ---- sizes and wishes ---------------------------------------------------------------------------

const choice = (id: string) => find<HTMLSelectElement>(id).value;

function wishes(): Wishes {
    return { mode: choice('mode') === 'screens' ? 'screens' : 'impostors',
             tolerancePx: Number(choice('tolerance')), quality: Number(choice('quality')),
             bytesPerSecond: Number(choice('bandwidth')) };
}

/** Of frames: pixels of the screen, as many as are wished for and the server draws. */
function frameSize(): { width: number; height: number } {
    const wide = Math.max(canvas.clientWidth, 16), high = Math.max(canvas.clientHeight, 16);
    const size = choice('size');
    const most = Math.min(size === 'auto' ? AUTO_PIXELS : SERVER_PIXELS, SERVER_PIXELS);
    const wanted = devicePixelRatio * (size === 'half' ? 0.5 : 1);
    const scale = Math.min(wanted, Math.sqrt(most / (wide * high)), 16383 / Math.max(wide, high));
    return { width: Math.max(Math.floor(wide * scale), 2),
             height: Math.max(Math.floor(high * scale), 2) };
}

// ---- notes and states ---------------------------------------------------------------------------

let noteTimer = 0;

function note(text: string): void {
    const box = find('note');
    box.textContent = text;
    box.hidden = false;
    clearTimeout(noteTimer);
    noteTimer = setTimeout(() => { box.hidden = true; }, 2500) as unknown as number;
}

const kilobytes = (bytes: number) => bytes < 1e6 ? `${(bytes / 1e3).toFixed(0)} KB`
    : `${(bytes / 1e6).toFixed(1)} MB`;

const TITLES: Record<State, string> = {
    connecting: 'Connecting', loading: 'Loading', showing: '', lost: 'Connection lost',
    refused: 'Refused', version: 'Another version', ended: 'Ended',
};
const BUTTONS: Record<string, string> = {
    again: 'Connect again', wait: 'Try now', reload: 'Load the page again',
};

let retryAt = 0;

function sentenceOf(s: Status): string {
    switch (s.state) {
    case 'connecting':
        return 'The server is asked for its world.';
    case 'loading':
        return `First pictures of the world: ${s.pictures}, ${kilobytes(s.bytes)} so far.`;
    case 'lost': {
        const seconds = Math.ceil((retryAt - performance.now()) / 1000);
        return `${s.sentence} ${seconds > 0 ? `Next try in ${seconds} s.` : 'Trying again.'}`;
    }
    default:
        return s.sentence;
    }
}

/** Over an empty page a card; over a world, which stays, a word at its top. */
function showStatus(): void {
    if (status === null || failed) {
        return;
    }
    const { state, remedy } = status;
    const hasWorld = view !== null && !view.empty;
    const quiet = state === 'showing' || (hasWorld && (state === 'lost' || state === 'connecting' ||
                                                       state === 'loading'));
    const sentence = sentenceOf(status);
    document.documentElement.dataset.state = state;
    find('notice').hidden = quiet;
    find('notice-title').textContent = TITLES[state];
    find('notice-text').textContent = sentence;
    find('notice-progress').hidden = state !== 'connecting' && state !== 'loading';
    find('token-form').hidden = remedy !== 'token';
    const button = find('notice-button');
    button.hidden = BUTTONS[remedy] === undefined;
    button.textContent = BUTTONS[remedy] ?? '';
    const chip = find('chip');
    const word = state === 'showing' ? '' : `${TITLES[state]}. ${state === 'lost' ? sentence : ''}`;
    if (chip.textContent !== word) {
        chip.textContent = word;
    }
    chip.classList.toggle('warns', state !== 'connecting' && state !== 'loading');
}

function showFailure(sentence: string): void {
    failed = true;
    document.documentElement.dataset.state = 'failed';
    find('notice').hidden = false;
    find('notice-title').textContent = 'This browser cannot go on';
    find('notice-text').textContent = sentence;
    find('notice-progress').hidden = true;
    find('token-form').hidden = true;
    const button = find('notice-button');
    button.hidden = false;
    button.textContent = BUTTONS.reload!;
}

function showNumbers(): void {
    if (find('numbers').hidden) {
        return;
    }
    const s = linkStats, v = view;
    const ms = (seconds: number | undefined) => seconds ? `${(1000 * seconds).toFixed(0)} ms` : '–';
    const rows: [string, string][] = [
        ['frames a second', v ? v.framesPerSecond.toFixed(0) : '–'],
        ['99 % of frames within', ms(v?.p99)],
        ['size', v ? `${v.width} × ${v.height}` : '–'],
        ['impostors shown', v ? (v.exact ? 'still picture' : String(v.shown)) : '–'],
        ['screen error', s?.errorPx ? `${s.errorPx.toFixed(2)} px` : `≤ ${choice('tolerance')} px`],
        ['camera to picture', ms(s?.latencyS)],
        ['there and back', ms(s?.roundTripS)],
        ['unpacking a batch', ms(s?.decodeS)],
        ['bandwidth', s ? `${kilobytes(s.bytesPerSecond)}/s` : '–'],
        ['link, by the server', s?.serverBytesPerSecond ? `${kilobytes(s.serverBytesPerSecond)}/s`
            : '–'],
        ['received', s ? kilobytes(s.received) : '–'],
        ['speed', v ? `× ${v.pace.toFixed(2)}` : '–'],
        ['clients', s?.clients ? String(s.clients) : '–'],
    ];
    find('numbers-list').replaceChildren(...rows.flatMap(([name, value]) => {
        const term = document.createElement('dt'), text = document.createElement('dd');
        term.textContent = name;
        text.textContent = value;
        return [term, text];
    }));
}

// ---- what can be done ---------------------------------------------------------------------------

const CARDS = ['help', 'options', 'numbers'] as const;

function toggle(card: typeof CARDS[number], open = find(card).hidden): void {
    find(card).hidden = !open;
    find(`tool-${card}`).setAttribute('aria-pressed', String(open));
    if (open && card !== 'numbers') { // there is room for one of them
        const other = card === 'help' ? 'options' : 'help';
        find(other).hidden = true;
        find(`tool-${other}`).setAttribute('aria-pressed', 'false');
    }
    showNumbers();
}

async function copy(text: string, said: string): Promise<void> {
    try {
        await navigator.clipboard.writeText(text);
        note(said);
    } catch {
        note('The clipboard is not to be had: copy the address instead.');
    }
}

function share(): void {
    if (view !== null) {
        const hash = formatFragment({ token, pose: view.pose });
        history.replaceState(null, '', hash);
        void copy(location.href, 'A link to this view is copied. It lets in who has it.');
    }
}

function save(blob: Blob): void {
    const anchor = document.createElement('a');
    anchor.href = URL.createObjectURL(blob);
    anchor.download = 'veduta-view.png';
    anchor.click();
    setTimeout(() => URL.revokeObjectURL(anchor.href), 10000);
    note('A picture is kept: veduta-view.png');
}

function fullScreen(): void {
    const change = document.fullscreenElement ? document.exitFullscreen()
        : document.documentElement.requestFullscreen?.();
    change?.catch(() => note('The browser does not allow the full screen.'));
}

function tick(id: 'bounds' | 'keep', said: [string, string]): void {
    const box = find<HTMLInputElement>(id);
    box.checked = !box.checked;
    box.dispatchEvent(new Event('change'));
    note(said[box.checked ? 0 : 1]);
}

function act(action: Action): void {
    switch (action) {
    case 'help':
    case 'options':
    case 'numbers':
        toggle(action);
        break;
    case 'share':
        share();
        break;
    case 'flags':
        if (view !== null) {
            void copy(formatFlags(view.pose), "The camera's flags are copied.");
        }
        break;
    case 'shot':
        toDisplay({ to: 'shoot' });
        break;
    case 'full':
        fullScreen();
        break;
    case 'bounds':
        tick('bounds', ['Shown is where pictures are.', 'Shown are pictures.']);
        break;
    case 'keep':
        tick('keep', ['Pictures are kept as they are.', 'Pictures follow again.']);
        break;
    case 'home':
        toDisplay({ to: 'home' });
        break;
    case 'faster':
    case 'slower':
        changePace(action === 'faster' ? 1 : -1);
        break;
    case 'close':
        CARDS.forEach((card) => toggle(card, false));
        canvas.focus();
        break;
    }
}

function changePace(steps: number): void {
    toDisplay({ to: 'pace', steps });
    if (view !== null) {
        const pace = Math.min(Math.max(view.pace * 1.25 ** steps, 1 / 64), 64);
        note(`speed × ${pace.toFixed(2)}`);
    }
}

function retry(): void {
    if (failed || status?.remedy === 'reload') {
        location.reload();
    } else {
        toLink({ to: 'again', token });
    }
}

function listen(): void {
    const controls = {
        want: (axis: never, value: number) => toDisplay({ to: 'want', axis, value }),
        stop: () => toDisplay({ to: 'stop' }),
        turn: (right: number, up: number) => toDisplay({ to: 'turn', right, up }),
        move: (forward: number, aside: number, zoom: number) =>
            toDisplay({ to: 'move', forward, aside, zoom }),
        pace: changePace,
        act,
    };
    listenToKeys(controls);
    listenToPointers(canvas, controls);
    for (const [id, action] of [['help', 'help'], ['options', 'options'], ['numbers', 'numbers'],
                                ['share', 'share'], ['shot', 'shot'], ['full', 'full']] as const) {
        find(`tool-${id}`).addEventListener('click', () => act(action));
    }
    find('notice-button').addEventListener('click', retry);
    find('token-form').addEventListener('submit', (event) => {
        event.preventDefault();
        token = find<HTMLInputElement>('token').value.trim();
        history.replaceState(null, '', formatFragment({ token, pose: fragment.pose }));
        toLink({ to: 'again', token });
    });
    for (const id of ['mode', 'quality', 'tolerance', 'bandwidth']) {
        find(id).addEventListener('change', () => {
            toLink({ to: 'wish', wishes: wishes() });
            toDisplay({ to: 'screens', screens: wishes().mode === 'screens' });
        });
    }
    find('bounds').addEventListener('change', () =>
        toDisplay({ to: 'bounds', bounds: find<HTMLInputElement>('bounds').checked }));
    find('keep').addEventListener('change', () =>
        toDisplay({ to: 'keep', keep: find<HTMLInputElement>('keep').checked }));
    const resize = () => toDisplay({ to: 'resize', ...frameSize() });
    new ResizeObserver(resize).observe(canvas);
    find('size').addEventListener('change', resize);
    window.addEventListener('hashchange', () => {
        const { token: other, pose } = parseFragment(location.hash);
        if (other !== token) {
            location.reload();
        } else if (pose !== null) {
            toDisplay({ to: 'pose', pose });
        }
    });
    window.addEventListener('pagehide', (event) => {
        if (!event.persisted) {
            toLink({ to: 'close' });
        }
    });
}

// ---- what workers say ---------------------------------------------------------------------------

/** Frames where the browser has no canvas for workers. */
function showFrame(message: Extract<FromDisplay, { to: 'frame' }>): void {
    canvas.width = message.width;
    canvas.height = message.height;
    const pixels = message.pixels as Uint8ClampedArray<ArrayBuffer>;
    canvas.getContext('2d', { alpha: false })?.putImageData(
        new ImageData(pixels, message.stride, message.height), 0, 0);
}

function fromDisplay({ data }: MessageEvent<FromDisplay>): void {
    switch (data.to) {
    case 'view':
        view = data;
        document.documentElement.dataset.exact = String(data.exact);
        showStatus();
        showNumbers();
        break;
    case 'frame':
        showFrame(data);
        break;
    case 'shot':
        save(data.blob);
        break;
    case 'failed':
        showFailure(data.sentence);
        break;
    }
}

function fromLink({ data }: MessageEvent<FromLink>): void {
    switch (data.to) {
    case 'status':
        status = data.status;
        retryAt = performance.now() + 1000 * status.retryInS;
        showStatus();
        break;
    case 'stats':
        linkStats = data.stats;
        showStatus();
        showNumbers();
        break;
    case 'world':
        find('name').textContent = data.world.name || 'Veduta';
        document.title = `${data.world.name || 'a world'}: Veduta`;
        break;
    }
}

async function start(): Promise<void> {
    const module = await WebAssembly.compile(await (await fetch(wasmUrl)).arrayBuffer());
    const { port1, port2 } = new MessageChannel();
    const memory = (navigator as { deviceMemory?: number }).deviceMemory ?? 8;
    const memoryBytes = (memory <= 2 ? 32 : 64) << 20;
    const size = frameSize();
    const offscreen = 'transferControlToOffscreen' in canvas ? canvas.transferControlToOffscreen()
        : null;
    display.onmessage = fromDisplay;
    link.onmessage = fromLink;
    display.onerror = link.onerror = () => showFailure('A part of this page could not be loaded.');
    toDisplay({ to: 'start', module, port: port1, canvas: offscreen, memoryBytes, ...size,
                pose: fragment.pose, screens: wishes().mode === 'screens' },
              offscreen !== null ? [port1, offscreen] : [port1]);
    toLink({ to: 'start', module, port: port2, setup: {
        origin: new URL('./', location.href.split('#')[0]!).href, token, memoryBytes, ...size,
        wishes: wishes() } }, [port2]);
    if (offscreen === null) {
        const loop = () => {
            toDisplay({ to: 'tick' });
            requestAnimationFrame(loop);
        };
        loop();
    }
    listen();
    canvas.focus();
}

start().catch(() => showFailure(
    'This page needs WebAssembly with SIMD, which browsers have since 2023.'));
