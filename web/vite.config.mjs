import { readFileSync } from 'node:fs';
import { defineConfig } from 'vite';
import { parseProto } from './proto.mjs';

// The messages as a table, from the file that the server's code is generated from.
const proto = {
    name: 'veduta-proto',
    load(id) {
        return id.endsWith('.proto')
            ? `export default ${JSON.stringify(parseProto(readFileSync(id, 'utf8')))}`
            : null;
    },
};

export default defineConfig({
    base: './',
    plugins: [proto],
    worker: { format: 'es', plugins: () => [proto] },
    build: {
        target: 'es2022',
        assetsInlineLimit: 0, // the content security policy allows nothing inline
        modulePreload: { polyfill: false },
        chunkSizeWarningLimit: 300,
    },
});
