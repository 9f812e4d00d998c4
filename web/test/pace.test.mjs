// The size of frames that can be drawn in time.
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { DrawnScale, Intervals } from '../generated/modules/pace.js';

/** Frames that take so long at scale 1. */
function draw(scale, ms, frames) {
    for (let i = 0; i < frames; i++) {
        scale.note(ms * scale.value ** 2);
    }
}

test('what can be drawn in time is drawn whole', () => {
    const scale = new DrawnScale();
    draw(scale, 10, 200);
    assert.equal(scale.value, 1);
});

test('frames that take longer become smaller at once, and fit', () => {
    for (const ms of [12, 16, 20, 30]) {
        const scale = new DrawnScale();
        draw(scale, ms, 9);
        assert.ok(scale.value < 1 && ms * scale.value ** 2 <= 11, `${ms} ms: ${scale.value}`);
        const found = scale.value;
        draw(scale, ms, 500);
        assert.equal(scale.value, found); // and stay
    }
});

test('never below half, and whole again when there is room', () => {
    const scale = new DrawnScale();
    draw(scale, 500, 20);
    assert.equal(scale.value, 0.5);
    draw(scale, 5, 40);
    assert.ok(scale.value < 0.75); // not all at once
    draw(scale, 5, 200);
    assert.equal(scale.value, 1);
});

test('a few frames that something else held up change nothing', () => {
    const scale = new DrawnScale();
    for (let i = 0; i < 300; i++) {
        scale.note(i % 3 === 0 ? 40 : 6);
    }
    assert.equal(scale.value, 1);
});

test('intervals are told as frames a second, without rests', () => {
    const pace = new Intervals();
    for (let i = 0; i < 100; i++) {
        pace.note(1000 + 20 * i);
    }
    pace.rest();
    pace.note(90000);
    pace.note(90020);
    assert.ok(Math.abs(pace.numbers.framesPerSecond - 50) < 1e-9);
    assert.ok(Math.abs(pace.numbers.p99 - 0.02) < 1e-9);
});
