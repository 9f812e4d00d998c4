// page_numbers.mjs: what the page says of itself, and what its browser's threads take of one core.
import { execFileSync } from 'node:child_process';
import { existsSync, readdirSync, readFileSync } from 'node:fs';

const CORE = '1';

/** Binds this program's processes but one, a server, to one core; returns them. */
export function bindBrowser(server = 0) {
    const list = execFileSync('ps', ['-eo', 'pid=,ppid=']).toString().trim().split('\n')
        .map((line) => line.trim().split(/\s+/).map(Number));
    const found = [];
    for (let wanted = [process.pid]; wanted.length > 0;) {
        wanted = list.filter(([pid, parent]) => wanted.includes(parent) && pid !== server)
            .map(([pid]) => pid);
        found.push(...wanted);
    }
    const pids = found.filter((one) => existsSync(`/proc/${one}/task`)); // not ps itself
    pids.forEach((pid) => execFileSync('taskset', ['-a', '-p', '-c', CORE, String(pid)],
                                       { stdio: 'ignore' }));
    return pids;
}

/** Seconds of processor time of each named thread of these processes. */
export function threadTimes(pids) {
    const times = new Map();
    for (const pid of pids.filter((one) => existsSync(`/proc/${one}/task`))) {
        for (const task of readdirSync(`/proc/${pid}/task`)) {
            const stat = readFileSync(`/proc/${pid}/task/${task}/stat`, 'latin1');
            const name = stat.slice(stat.indexOf('(') + 1, stat.lastIndexOf(')'));
            const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
            const took = (Number(fields[11]) + Number(fields[12])) / 100;
            times.set(name, (times.get(name) ?? 0) + took);
        }
    }
    return times;
}

/** The first of the card of numbers, which must be open: [name, value] each. */
export const numbersOf = (page, count) => page.evaluate(
    (most) => [...document.querySelectorAll('#numbers-list dt')].slice(0, most)
        .map((term) => [term.textContent, term.nextSibling.textContent]), count);

/** Prints what each thread has taken since. */
export function printThreads(pids, before, took, frames) {
    const threads = [...threadTimes(pids)].map(([name, t]) => [name, t - (before.get(name) ?? 0)])
        .filter(([, t]) => t > 0.02 * took).sort((a, b) => b[1] - a[1]);
    threads.forEach(([name, t]) => console.log(
        `  ${name.padEnd(18)} ${(1000 * t / took / frames).toFixed(1)} ms a frame, ` +
        `${(100 * t / took).toFixed(0)} % of a core`));
}
