// The connection: its states, what it says and when, and what a server cannot do to it.
import assert from 'node:assert/strict';
import test from 'node:test';
import { Session } from '../generated/modules/session.js';
import { readWorld } from '../generated/modules/status.js';
import { Unpacker } from '../generated/modules/codec.js';
import { exchange, impostor, makeWasm, wire } from './support.mjs';

const WORLD = JSON.stringify({
    name: 'alps', version: '0.1', wire: 1, objects: 3,
    socket: { path: '/socket', protocol: 'veduta', batch_bytes: 102400 }, bounds: null,
    camera: { eye: [0, 0, 0], orientation: [0, 0, 0, 1], heading: 0, pitch: 0, roll: 0, fov: 60,
              near: 0.1, lens: [50, 50, 32, 24], size: [64, 48] },
});
const VIEW = { eye: [0, 0, 0], orientation: [0, 0, 0, 1], lens: [50, 50, 32, 24], near: 0.1, width: 64,
               height: 48 };

// One, as a page has: while node compiles a module better, it hangs now and then over many instances.
const wasm = await makeWasm();

/** A session among things that do as the test says. */
async function begin(answer = { status: 200, text: WORLD }) {
    const t = { time: 100, timers: [], said: [], states: [], display: [], sockets: [], answer };
    t.session = new Session(wire, new Unpacker(wasm, null), {
        origin: 'https://host:1/', token: 'secret', memoryBytes: 64 << 20, width: 64, height: 48,
        wishes: { mode: 'impostors', tolerancePx: 1, quality: 0, bytesPerSecond: 0 } }, {
        connect(url, protocol) {
            const socket = { url, protocol, closed: false, close() { this.closed = true; },
                             send: (bytes) => t.said.push(...wire.decode(bytes).messages) };
            t.sockets.push(socket);
            return socket;
        },
        get: async () => {
            if (t.answer === null) {
                throw new Error('no answer');
            }
            return t.answer;
        },
        now: () => t.time,
        later: (seconds, call) => {
            const timer = { at: t.time + seconds, call };
            t.timers.push(timer);
            return timer;
        },
        never: (timer) => { t.timers = t.timers.filter((other) => other !== timer); },
        random: () => 0.5,
        toDisplay(message) {
            t.display.push(message);
            if (message.to === 'held') {
                t.session.fromDisplay({ to: 'held', ids: BigUint64Array.of(4n, 9n), versions: [1, 2] });
            } else if (message.to === 'batch') {
                t.session.fromDisplay({ to: 'taken', connection: message.connection,
                                        batch: message.batch, bytes: message.bytes, held: 4096,
                                        dropped: new BigUint64Array(0) });
            }
        },
        report: (status) => { t.states.push(status.state); t.status = status; },
        stats: (stats) => { t.stats = stats; },
        world: () => {},
    });
    t.settle = () => new Promise((resolve) => setImmediate(() => setImmediate(resolve)));
    t.socket = () => t.sockets.at(-1);
    t.hear = async (batch, ...messages) => {
        t.socket().onmessage({ data: wire.encode(batch, messages).slice().buffer });
        await t.settle();
    };
    t.pass = async (seconds) => {
        for (const end = t.time + seconds; t.time < end;) {
            t.time = Math.min(end, t.time + 0.25);
            const due = t.timers.filter(({ at }) => at <= t.time);
            t.timers = t.timers.filter(({ at }) => at > t.time);
            due.forEach(({ call }) => call());
            await t.settle();
        }
    };
    t.kinds = () => t.said.splice(0).flatMap((m) => Object.keys(m));
    await t.session.connect();
    return t;
}

async function greeted() {
    const t = await begin();
    t.socket().onopen();
    await t.settle();
    await t.hear(0, { hello: { version: 1 } });
    return t;
}

test('from connecting to showing', async () => {
    const t = await begin();
    assert.equal(t.status.state, 'connecting');
    assert.equal(t.socket().url, 'wss://host:1/socket');
    assert.equal(t.socket().protocol, 'veduta');
    t.socket().onopen();
    await t.settle();
    const [{ hello }, { settings }] = t.said.splice(0);
    assert.equal(hello.token, 'secret');
    assert.equal(hello.particles, 1 << 18);
    assert.deepEqual([...hello.held_ids], [4n, 9n]);
    assert.deepEqual(hello.held_versions, [1, 2]);
    assert.equal(settings.mode, 1);
    await t.hear(0, { hello: { version: 1, name: 'alps' } });
    assert.equal(t.status.state, 'loading');
    assert.ok(t.display.some(({ to }) => to === 'connected'));
    await t.hear(1, { impostor: impostor(7n, 1) });
    assert.equal(t.status.state, 'loading');
    await t.hear(2, { order: { camera: 0, ids: BigUint64Array.of(7n) } });
    assert.equal(t.status.state, 'showing');
    assert.deepEqual(t.kinds(), ['ping', 'acknowledge', 'acknowledge']);
});

test('one camera at a time, the newest', async () => {
    const t = await greeted();
    t.kinds();
    for (let i = 0; i < 5; i++) {
        t.session.fromDisplay({ to: 'camera', camera: { ...VIEW, eye: [i, 0, 0] }, time: i });
    }
    assert.deepEqual(t.said.splice(0).map((m) => m.camera.eye.x), [0]);
    await t.hear(0, { stats: { shown: 1n, queued_bytes: 0n, clients: 1n } });
    assert.deepEqual(t.said.splice(0).map((m) => m.camera.eye.x), [4]);
    t.session.fromDisplay({ to: 'camera', camera: VIEW, time: 1 });
    await t.pass(0.5); // nobody answers: it goes on
    const [{ camera }] = t.said.splice(0);
    assert.equal(camera.sequence, 3);
    assert.equal(camera.time, 4); // does not fall
});

test('a recorded server is understood', async () => {
    const t = await begin();
    t.socket().onopen();
    await t.settle();
    const taken = [];
    for (const { side, bytes } of exchange()) {
        if (side === 'server') {
            const screen = wire.decode(bytes).messages.some((m) => m.screen);
            if (!screen) { // for a camera that was not sent here
                t.socket().onmessage?.({ data: bytes.slice().buffer });
                await t.settle();
                taken.push(t.status.state);
            }
        }
    }
    const items = t.display.flatMap((m) => m.to === 'batch' ? m.items.map(({ kind }) => kind) : []);
    assert.deepEqual(items, ['impostor', 'brick', 'order', 'replace', 'drop', 'light',
                             'instance', 'ground']);
    assert.ok(taken.includes('showing'));
});

test('lost: tries again, later each time, and says what it holds', async () => {
    const t = await greeted();
    t.socket().onclose({ code: 1006 });
    assert.equal(t.status.state, 'lost');
    const waits = [t.status.retryInS];
    t.answer = null;
    for (let i = 0; i < 6; i++) {
        await t.pass(t.status.retryInS + 0.3);
        waits.push(t.status.retryInS);
    }
    assert.deepEqual(waits, [0.5, 1, 2, 4, 8, 15, 15]);
    t.answer = { status: 200, text: WORLD };
    t.session.hurry();
    await t.settle();
    t.kinds();
    t.socket().onopen();
    await t.settle();
    assert.deepEqual([...t.said[0].hello.held_ids], [4n, 9n]);
    await t.hear(0, { hello: { version: 1 } });
    assert.equal(t.status.state, 'loading');
    await t.hear(1, { order: { camera: 0, ids: new BigUint64Array(0) } }); // numbered anew
    assert.equal(t.status.state, 'showing');
});

test('endings', async () => {
    const ends = [
        [{ error: { code: 2, sentence: 'old' } }, 'version', 'reload'],
        [{ error: { code: 3, sentence: 'no token' } }, 'refused', 'token'],
        [{ error: { code: 4, sentence: 'full' } }, 'lost', 'wait'],
        [{ error: { code: 99, sentence: '' } }, 'lost', 'wait'],
        [{ error: { code: 6, sentence: 'much' } }, 'refused', 'again'],
        [{ bye: { reason: 2, sentence: 'stops' } }, 'lost', 'wait'],
        [{ bye: { reason: 1, sentence: '' } }, 'ended', 'again'],
        [{ hello: { version: 1 } }, 'refused', 'again'], // twice
    ];
    for (const [message, state, remedy] of ends) {
        const t = await greeted();
        await t.hear(0, message);
        assert.deepEqual([t.status.state, t.status.remedy], [state, remedy]);
        assert.ok(t.socket().closed);
    }
    for (const [answer, state] of [[{ status: 401, text: '' }, 'refused'],
                                   [{ status: 200, text: '{}' }, 'lost'],
                                   [{ status: 200, text: WORLD.replace('"wire":1', '"wire":2') },
                                    'version'], [null, 'lost']]) {
        assert.equal((await begin(answer)).status.state, state);
    }
});

test('silence is noticed', async () => {
    const t = await greeted();
    await t.pass(6);
    assert.ok(t.kinds().includes('stats'));
    await t.pass(22);
    assert.equal(t.status.state, 'lost');
    const slow = await begin();
    await slow.pass(11);
    assert.equal(slow.status.state, 'lost');
});

test('what cannot be right ends the connection, with a word to the server', async () => {
    const hostile = [
        (t) => t.socket().onmessage({ data: 'text' }),
        (t) => t.socket().onmessage({ data: new ArrayBuffer(0) }),
        (t) => t.socket().onmessage({ data: new ArrayBuffer(17 << 20) }),
        (t) => t.socket().onmessage({ data: Uint8Array.of(255, 255, 255).buffer }),
        (t) => t.hear(5, { impostor: impostor(1n, 1) }),               // a batch too far
        (t) => t.hear(1, { impostor: { ...impostor(1n, 1), codec: 2 } }), // no runs
        (t) => t.hear(1, { impostor: impostor(0n, 1) }),
        (t) => t.hear(1, { screen: { camera: 9, codec: 1, width: 1, height: 1,
                                     picture: new Uint8Array(4) } }),
        (t) => t.hear(0, { camera: { sequence: 1 } }),
        (t) => t.hear(1, ...[1n, 2n, 3n].map((id) => ({ impostor: { ...impostor(id, 1), codec: 2,
            width: 4000, height: 4000, picture: new Uint8Array(4 * 4000) } }))),
        (t) => t.hear(1, { impostor: { ...impostor(1n, 1), codec: 2, width: 4097, height: 4096,
                                       picture: new Uint8Array(4 * 4096) } }),
    ];
    for (const act of hostile) {
        const t = await greeted();
        t.kinds();
        await act(t);
        await t.settle();
        assert.equal(t.status.state, 'refused');
        assert.deepEqual(t.kinds(), ['error']);
        assert.ok(t.socket().closed);
    }
    const early = await begin();
    early.socket().onopen();
    await early.settle();
    await early.hear(1, { impostor: impostor(1n, 1) });
    assert.equal(early.status.state, 'refused');
});

test('a screen is of its camera, or is not taken', async () => {
    const t = await greeted();
    t.session.fromDisplay({ to: 'camera', camera: VIEW, time: 1 });
    const screen = { camera: 1, codec: 1, exact: true, width: 64, height: 48,
                     picture: new Uint8Array(4 * 64 * 48) };
    await t.hear(1, { screen });
    const item = t.display.at(-1).items[0];
    assert.deepEqual([item.kind, item.exact, item.camera], ['screen', true, VIEW]);
    await t.hear(2, { screen: { ...screen, width: 48, height: 64 } });
    assert.equal(t.status.state, 'refused');
});

test('a flood waits for the display', async () => {
    const t = await greeted();
    let handed = 0;
    const { session } = t;
    const taken = session.fromDisplay.bind(session);
    const held = [];
    session.fromDisplay = (message) => message.to === 'taken' ? held.push(message) : taken(message);
    const big = wire.encode(0, [{ impostor: { ...impostor(1n, 1), width: 4096, height: 4096, codec: 2,
        picture: Uint8Array.from({ length: 4 * 4096 }, () => 0) } }]);
    for (let i = 0; i < 6; i++) {
        t.socket().onmessage({ data: big.slice().buffer });
        await t.settle();
    }
    handed = t.display.filter(({ to }) => to === 'batch').length;
    assert.equal(handed, 3); // of 64 MiB each
    held.splice(0).forEach(taken);
    await t.settle();
    assert.ok(t.display.filter(({ to }) => to === 'batch').length > handed);
});

test('a world is what its server may say', () => {
    assert.equal(readWorld(WORLD).name, 'alps');
    for (const [from, to] of [['"/socket"', '"//elsewhere.example/x"'], ['"/socket"', '5'],
                              ['"orientation":[0,0,0,1]', '"orientation":[0,0,0,2]'],
                              ['"fov":60', '"fov":1e9'], ['"near":0.1', '"near":"a"'],
                              ['[50,50,32,24]', '[50,50,32]'], ['"size":[64,48]', '"size":[0,48]']]) {
        const changed = WORLD.replace(from, to);
        assert.notEqual(changed, WORLD);
        assert.equal(readWorld(changed), null, to);
    }
    for (const text of ['', 'null', '[]', '5', '{"socket":null}']) {
        assert.equal(readWorld(text), null);
    }
});

test('who orders what no frame can be drawn of is told so, and left', async () => {
    const t = await begin();
    t.socket().onopen();
    await t.settle();
    await t.hear(0, { hello: { version: 1 } });
    t.session.fromDisplay({ to: 'absurd', connection: 999 }); // of an older connection
    assert.equal(t.status.state, 'loading');
    await t.hear(1, { order: { camera: 0, ids: BigUint64Array.of(4n) } });
    t.said.length = 0;
    const { connection } = t.display.findLast(({ to }) => to === 'batch');
    t.session.fromDisplay({ to: 'absurd', connection });
    assert.equal(t.said.find((m) => m.error).error.code, 6);
    assert.equal(t.status.state, 'refused');
    assert.match(t.status.sentence, /a thousand times/);
    assert.ok(t.socket().closed);
});
