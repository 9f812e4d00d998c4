// proto.mjs: reads a file of messages (proto3: messages, scalar fields, repeated, one oneof) as a table
// that src/wire.ts encodes and decodes by. The file stays the one place where messages are said.

/**
 * Returns, by the message's name, its fields: name, number, type and whether repeated.
 * @param {string} text of a .proto file
 */
export function parseProto(text) {
    const plain = text.replace(/\/\/[^\n]*/g, '');
    const messages = {};
    const message = /message\s+(\w+)\s*\{/g;
    for (let found = message.exec(plain); found !== null; found = message.exec(plain)) {
        const body = plain.slice(message.lastIndex, endOf(plain, message.lastIndex));
        const field = /(repeated\s+)?(\w+)\s+(\w+)\s*=\s*(\d+)\s*;/g;
        messages[found[1]] = [...body.matchAll(field)].map(([, repeated, type, name, number]) => (
            { name, number: Number(number), type, repeated: repeated !== undefined }));
    }
    const known = new Set(['double', 'float', 'uint32', 'uint64', 'fixed64', 'bool', 'string',
                           'bytes', ...Object.keys(messages)]);
    for (const [name, fields] of Object.entries(messages)) {
        const strange = fields.find(({ type }) => !known.has(type));
        if (fields.length === 0 || strange !== undefined) {
            throw new Error(`message ${name}: cannot read ${strange?.type ?? 'its fields'}`);
        }
    }
    return messages;
}

/** Where the bracket that was opened before `from` is closed. */
function endOf(text, from) {
    let open = 1;
    for (let i = from; i < text.length; i++) {
        open += text[i] === '{' ? 1 : text[i] === '}' ? -1 : 0;
        if (open === 0) {
            return i;
        }
    }
    throw new Error('a message does not end');
}
