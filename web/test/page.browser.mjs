// The page in a real browser, before a server that says what the test wants.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { isExact, keepPicture, launch, openPage, pause, stateIs, until } from
    './browser_support.mjs';
import { startServer, WORLD } from './server.mjs';
import { exchange, impostor, wire } from './support.mjs';

let browser;
before(async () => { browser = await launch(); });
after(() => browser.close());

const order = (...ids) => ({ order: { camera: 0, ids: BigUint64Array.from(ids) } });

/** A server that answers the first camera with one picture, and nothing after. */
function onePicture(picture = impostor(7n, 1)) {
    const heard = [];
    const hear = (message, client) => {
        heard.push(message);
        if (message.camera && client.batch === 0) {
            client.send({ impostor: picture }, order(picture.id));
        }
    };
    return { heard, hear };
}

/** Runs with a server and a page, and looks for what the page should not have done. */
async function withPage(hear, run, options = {}) {
    const server = await startServer(hear);
    Object.assign(server, options.server);
    const page = await openPage(browser, `${server.url}#token=secret`, options.context);
    try {
        await run(page, server);
        assert.deepEqual(page.wrong, []);
    } finally {
        await page.context().close();
        await server.stop();
    }
}

test('shows a picture, and says what it holds', async () => {
    const { heard, hear } = onePicture();
    await withPage(hear, async (page) => {
        await stateIs(page, 'showing');
        const kept = await keepPicture(page);
        assert.deepEqual([kept.width, kept.height], [640, 360]);
        assert.deepEqual(kept.at(320, 180), [200, 100, 50]);
        assert.deepEqual(kept.at(2, 2), [0x28, 0x2c, 0x33]);
        const [{ hello }] = heard;
        assert.equal(hello.token, 'secret');
        assert.equal(hello.capabilities & 0xff, 0b11111110);
        await until(() => heard.some((m) => m.acknowledge?.batch === 1), 'an acknowledgement');
        const { camera } = heard.find((m) => m.camera);
        assert.deepEqual([camera.width, camera.height], [640, 360]);
        assert.ok(Math.abs(camera.fy - 180 / Math.tan(Math.PI / 6)) < 1e-9);
        assert.equal(await page.textContent('#name'), WORLD.name); // text, not markup
    });
});

test('moves at once, whatever the server does', async () => {
    const { heard, hear } = onePicture();
    await withPage(hear, async (page) => {
        await stateIs(page, 'showing');
        await page.keyboard.press('n');
        const before = await keepPicture(page);
        await page.keyboard.down('d');
        await pause(700);
        await page.keyboard.up('d');
        await pause(400);
        const turned = await keepPicture(page);
        assert.ok(!turned.rgb.equals(before.rgb));
        const frames = Number(await page.textContent('#numbers-list dd'));
        assert.ok(frames > 20, `${frames} frames a second`);
        await page.keyboard.press('0'); // home
        await pause(300);
        assert.ok((await keepPicture(page)).rgb.equals(before.rgb));
        const asked = heard.length;
        await page.keyboard.press('x'); // kept: nothing is asked for while it moves
        await pause(100);
        await page.keyboard.press('ArrowLeft');
        await pause(400);
        assert.equal(heard.slice(asked).filter((m) => m.camera).length, 0);
        assert.ok(!(await keepPicture(page)).rgb.equals(before.rgb));
        await page.keyboard.press('x');
        await until(() => heard.slice(asked).some((m) => m.camera), 'a camera');
        await page.keyboard.press('0');
        await pause(300);
        await page.mouse.move(450, 180);
        await page.mouse.down();
        await page.mouse.move(510, 180, { steps: 4 });
        await page.mouse.up();
        await pause(300);
        assert.ok(!(await keepPicture(page)).rgb.equals(before.rgb));
        await page.mouse.move(450, 180); // off the tools
        await page.mouse.wheel(0, -100);
        await until(async () => (await page.textContent('#note')).includes('1.25'), 'a pace');
        const cameras = heard.filter((m) => m.camera).map((m) => m.camera.sequence);
        assert.ok(cameras.length > 3);
        assert.deepEqual(cameras, [...cameras].sort((a, b) => a - b));
    });
});

test('a recorded exchange', async () => {
    const recorded = exchange().filter(({ side }) => side === 'server').map(({ bytes }) => bytes);
    const hear = (message, client) => {
        if (message.camera && client.batch === 0) {
            client.batch = 9; // hello is said; the screen of camera 12 is for a longer exchange
            recorded.slice(1, 4).forEach((bytes) => client.bytes(bytes));
        }
    };
    await withPage(hear, async (page, server) => {
        await stateIs(page, 'showing');
        [...server.clients][0].bytes(recorded.at(-1));
        await until(() => page.evaluate(() => document.documentElement.dataset.state !== 'showing'),
                    'an end');
    });
});

test('files of the browser: PNG to the bit, JPEG and WebP nearly', async () => {
    const answers = [];
    await withPage((message, client) => {
        if (message.camera && client.batch === 0) {
            client.send(order());
        }
    }, async (page, server) => {
        await stateIs(page, 'showing');
        const files = await page.evaluate(async () => {
            const canvas = new OffscreenCanvas(32, 32), context = canvas.getContext('2d');
            context.fillStyle = 'rgb(200, 100, 50)';
            context.fillRect(0, 0, 32, 32);
            const made = {};
            for (const [codec, type, quality] of [[4, 'image/png'], [5, 'image/jpeg', 0.95],
                                                  [6, 'image/webp', 0.9], [7, 'image/webp', 1]]) {
                const blob = await canvas.convertToBlob({ type, quality });
                made[codec] = [...new Uint8Array(await blob.arrayBuffer())];
            }
            return made;
        });
        const [client] = server.clients;
        for (const [codec, bytes] of Object.entries(files)) {
            const picture = Uint8Array.from(codec === '6' ? bytes : [0, 0, 0, 0, ...bytes]);
            client.send({ impostor: { ...impostor(7n, Number(codec)), codec: Number(codec), width: 32,
                                      height: 32, picture } }, order(7n));
            await pause(400);
            answers.push((await keepPicture(page)).at(320, 180));
        }
        assert.deepEqual(answers[0], [200, 100, 50]);
        assert.deepEqual(answers[3], [200, 100, 50]);
        for (const answer of answers) {
            answer.forEach((v, i) => assert.ok(Math.abs(v - [200, 100, 50][i]) < 8, String(answer)));
        }
    });
});

test('lost and found again: the world stays, and what is held is said', async () => {
    const { heard, hear } = onePicture();
    await withPage(hear, async (page, server) => {
        await stateIs(page, 'showing');
        const { port } = server;
        await server.stop();
        await stateIs(page, 'lost');
        assert.ok((await page.textContent('#chip')).includes('lost'));
        assert.ok(await page.locator('#notice').isHidden());
        await page.keyboard.down('d'); // it still moves
        await pause(300);
        await page.keyboard.up('d');
        await page.keyboard.press('0');
        await pause(300);
        assert.deepEqual((await keepPicture(page)).at(320, 180), [200, 100, 50]);
        heard.length = 0;
        const again = await startServer((message, client) => {
            heard.push(message);
            if (message.camera && client.batch === 0) {
                client.send(order(7n));
            }
        }, port);
        await stateIs(page, 'showing');
        assert.deepEqual([...heard[0].hello.held_ids], [7n]);
        assert.deepEqual((await keepPicture(page)).at(320, 180), [200, 100, 50]);
        await again.stop();
    });
});

test('refusals say why and what helps', async () => {
    const refusals = [
        [{ error: { code: 3, sentence: 'the token is <i>wrong</i>' } }, 'refused', '#token'],
        [{ error: { code: 2, sentence: 'load the page again' } }, 'version', '#notice-button'],
        [{ error: { code: 4, sentence: 'there is no room' } }, 'lost', '#notice-button'],
        [{ bye: { reason: 1, sentence: 'done' } }, 'ended', '#notice-button'],
    ];
    for (const [message, state, remedy] of refusals) {
        await withPage((heard, client) => heard.hello && client.say(message), async (page) => {
            await stateIs(page, state);
            const said = message.error?.sentence ?? message.bye.sentence;
            assert.ok((await page.textContent('#notice-text')).includes(said));
            assert.ok(await page.locator(remedy).isVisible());
        }, { server: { hello: null } });
    }
    await withPage(() => {}, async (page, server) => {
        await stateIs(page, 'refused');
        server.status = 200;
        server.hear = onePicture().hear;
        await page.fill('#token', 'another');
        await page.keyboard.press('Enter');
        await stateIs(page, 'showing');
        assert.ok(page.url().endsWith('#token=another'));
    }, { server: { status: 401 } });
    await withPage(() => {}, (page) => stateIs(page, 'version'),
                   { server: { world: { ...WORLD, wire: 2 } } });
    await withPage(() => {}, (page) => stateIs(page, 'lost'), { server: { world: '[' } });
});

test('a hostile server cannot crash the page', async () => {
    const flat = impostor(7n, 1);
    const bomb = Buffer.alloc(64); // a PNG that says it has 16383 x 16383 pixels
    Buffer.from([0, 0, 0, 0, 0x89, 0x50, 0x4e, 0x47, 13, 10, 26, 10, 0, 0, 0, 13, 0x49, 0x48, 0x44,
                 0x52]).copy(bomb);
    bomb.writeUInt32BE(16383, 20);
    bomb.writeUInt32BE(16383, 24);
    const acts = [
        (c) => c.bytes(Buffer.from([1, 2, 3])),
        (c) => c.bytes(Buffer.from('hello'), 1),
        (c) => c.bytes(Buffer.alloc((16 << 20) + 1)),
        (c) => c.send({ impostor: { ...flat, codec: 4, picture: new Uint8Array(bomb) } }),
        (c) => c.send({ impostor: { ...flat, codec: 3, picture: new Uint8Array(40) } }),
        (c) => c.send({ impostor: { ...flat, corners: Array(12).fill(NaN) } }),
        (c) => c.send({ impostor: { ...flat, width: 16383, height: 16383, codec: 2 } }),
        (c) => c.say({ hello: { version: 1 } }),
        (c) => { c.batch = 7; c.send(order()); },
        (c) => c.send(order(...Array(20000).fill(7n))),
        (c) => c.send({ screen: { camera: 4e9, codec: 1, width: 1, height: 1,
                                  picture: new Uint8Array(4) } }),
    ];
    let act = null;
    const hear = (message, client) => {
        if (message.camera && client.batch === 0) {
            client.send({ impostor: flat }, order(7n));
            act?.(client);
        }
    };
    await withPage(hear, async (page) => {
        await stateIs(page, 'showing');
        for (act of acts) {
            await page.evaluate(() => { document.documentElement.dataset.state = 'none'; });
            await page.reload();
            await stateIs(page, 'refused').catch((error) => {
                throw new Error(`act ${acts.indexOf(act)}: ${error.message}`);
            });
        }
        act = null;
        await page.locator('#notice-button').click();
        await stateIs(page, 'showing');
        assert.deepEqual((await keepPicture(page)).at(320, 180), [200, 100, 50]);
    });
});

test('pictures beyond the memory are given back', async () => {
    const heard = [];
    const side = 1024, runs = new Uint8Array(4 * side); // transparent
    await withPage((message, client) => {
        heard.push(message);
        if (message.camera && client.batch === 0) {
            client.send({ impostor: impostor(1n, 1) }, order(1n));
            for (let id = 2n; id < 42n; id++) {
                client.send({ impostor: { ...impostor(id, 1), codec: 2, width: side, height: side,
                                          picture: runs } });
            }
        }
    }, async (page) => {
        await until(() => heard.some((m) => m.acknowledge?.batch === 41), 'the last acknowledgement');
        const given = heard.flatMap((m) => m.drop ? [...m.drop.ids] : []);
        assert.ok(given.length >= 20 && !given.includes(1n), String(given.length));
        const most = heard.reduce((held, m) => Math.max(held, Number(m.acknowledge?.held_bytes ?? 0)), 0);
        const { hello } = heard[0];
        assert.ok(most <= 1.25 * Number(hello.memory_bytes), `${most}`);
        assert.deepEqual((await keepPicture(page)).at(320, 180), [200, 100, 50]);
    });
});

test('still pictures, whole screens, and a frame of another size', async () => {
    const flat = (camera, exact, color) => ({ screen: { camera: camera.sequence, codec: 1, exact,
        width: camera.width, height: camera.height, picture: Uint8Array.from(
            { length: 4 * camera.width * camera.height }, (_, i) => [...color, 255][i % 4]) } });
    await withPage((message, client) => {
        if (message.camera) {
            client.send(flat(message.camera, true, [1, 2, 3]));
        }
    }, async (page) => {
        await isExact(page);
        assert.deepEqual((await keepPicture(page)).at(5, 5), [1, 2, 3]);
        await page.setViewportSize({ width: 500, height: 300 });
        await until(async () => (await keepPicture(page)).width === 500, 'another size');
        await isExact(page);
        assert.deepEqual((await keepPicture(page)).at(499, 299), [1, 2, 3]);
    });
});

test('by keys alone, and on a phone', async () => {
    const { heard, hear } = onePicture();
    await withPage(hear, async (page) => {
        await stateIs(page, 'showing');
        const reached = new Set();
        for (let i = 0; i < 8; i++) {
            await page.keyboard.press('Tab');
            reached.add(await page.evaluate(() => document.activeElement.id));
        }
        for (const id of ['help', 'options', 'numbers', 'share', 'shot', 'full']) {
            assert.ok(reached.has(`tool-${id}`), id);
        }
        await page.keyboard.press('h');
        assert.ok(await page.locator('#help').isVisible());
        await page.keyboard.press('p');
        assert.ok(await page.locator('#options').isVisible() && await page.locator('#help').isHidden());
        await page.selectOption('#mode', 'screens');
        await page.selectOption('#quality', '100');
        await until(() => heard.some((m) => m.settings?.mode === 2 && m.settings.quality === 100),
                    'settings');
        await page.keyboard.press('Escape');
        assert.ok(await page.locator('#options').isHidden());
        await page.keyboard.press('v');
        assert.ok(await page.locator('#bounds').isChecked());
    });
    const phone = { viewport: { width: 360, height: 640 }, hasTouch: true, isMobile: true,
                    deviceScaleFactor: 3 };
    const small = { ...impostor(7n, 1), corners: [-2, 0, 2, 2, 0, 2, 2, 0, -2, -2, 0, -2] };
    await withPage(onePicture(small).hear, async (page) => {
        await stateIs(page, 'showing');
        const boxes = await page.evaluate(() => [...document.querySelectorAll('#tools button')].map(
            (button) => button.getBoundingClientRect().height));
        assert.ok(boxes.every((height) => height >= 44), String(boxes));
        assert.equal(await page.evaluate(() => document.documentElement.scrollWidth), 360);
        const before = await keepPicture(page);
        assert.ok(before.width * before.height <= 1e6);
        const touch = await page.context().newCDPSession(page);
        const send = (type, ...points) => touch.send('Input.dispatchTouchEvent', {
            type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
        await send('touchStart', [180, 300]);
        await send('touchMove', [230, 300]);
        await send('touchEnd');
        await pause(300);
        const looked = await keepPicture(page);
        assert.ok(!looked.rgb.equals(before.rgb));
        await send('touchStart', [150, 300], [210, 300]);
        await send('touchMove', [100, 300], [260, 300]);
        await send('touchEnd');
        await pause(300);
        assert.ok(!(await keepPicture(page)).rgb.equals(looked.rgb));
    }, { context: phone });
});

test('a link holds the view', async () => {
    const { heard, hear } = onePicture();
    await withPage(hear, async (page) => {
        await stateIs(page, 'showing');
        await page.keyboard.press('c');
        assert.ok(page.url().includes('&camera=0,0,0,0,0,60'));
        await page.goto(page.url().replace('camera=0,0,0,0,0,60', 'camera=1,2,3,90,-10,50'));
        await until(() => heard.some((m) => m.camera?.eye.z === 3), 'its camera');
        const { url } = { url: page.url() };
        await page.goto('about:blank');
        await page.goto(url);
        await stateIs(page, 'showing');
        const camera = heard.findLast((m) => m.camera).camera;
        assert.deepEqual(camera.eye, { x: 1, y: 2, z: 3 });
    });
});
