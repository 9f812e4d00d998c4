// share.ts: what stands in the address behind the #: the token, which browsers do not send, and a camera.
import type { Pose } from './motion.js';

export interface Fragment { token: string; pose: Pose | null }

const numbers = (pose: Pose) => [...pose.eye, pose.heading, pose.pitch, pose.fov];

function poseOf(text: string | null): Pose | null {
    const v = (text ?? '').split(',').map(Number);
    const [x, y, z, heading, pitch, fov] = v as [number, number, number, number, number, number];
    const sound = text !== null && v.length === 6 && v.every(Number.isFinite) &&
        [x, y, z].every((metres) => Math.abs(metres) <= 1e9) &&
        Math.abs(heading) <= 360 && Math.abs(pitch) <= 90 && fov >= 1 && fov <= 170;
    return sound ? { eye: [x, y, z], heading, pitch, roll: 0, fov } : null;
}

/** Reads `#token=…&camera=x,y,z,heading,pitch,fov`; what is not sound counts as not there. */
export function parseFragment(fragment: string): Fragment {
    const values = new URLSearchParams(fragment.replace(/^#/, ''));
    return { token: (values.get('token') ?? '').slice(0, 256), pose: poseOf(values.get('camera')) };
}

export function formatFragment({ token, pose }: Fragment): string {
    const parts = token !== '' ? [`token=${encodeURIComponent(token)}`] : [];
    return `#${[...parts, ...pose ? [`camera=${numbers(pose).join(',')}`] : []].join('&')}`;
}

/** The same camera for the command line. */
export function formatFlags(pose: Pose): string {
    return `--eye ${pose.eye.join(',')} --heading ${pose.heading} --pitch ${pose.pitch} ` +
        `--fov ${pose.fov}`;
}
