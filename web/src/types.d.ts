// What Vite makes of files that are no modules.
declare module '*.proto' {
    const schema: import('./wire.js').Schema;
    export default schema;
}
declare module '*.wasm?url' {
    const url: string;
    export default url;
}
declare module '*.css' {}
