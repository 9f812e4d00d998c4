// raster-tables.mjs: writes what `veduta bench raster --json` measured into a page of the docs.
//
//   node bench/raster-tables.mjs RESULTS.json PAGE.md
//
// Replaces what stands between <!-- NAME --> and <!-- end --> in the page, for every table below.
// In parentheses: the figures of the rasterization thesis (2026, §4.2, Quadro M2000M, CUDA).
import { readFileSync, writeFileSync } from 'node:fs'

const [, , json, page] = process.argv
const run = JSON.parse(readFileSync(json, 'utf8'))
const rows = run.results
const models = ['bunny', 'monkey', 'armadillo', 'dragon202k', 'dragon871k']
  .filter(m => rows.some(r => r.model === m))
const sizes = [1024, 2048, 4096, 8192]
const methods = ['scanline', 'immediate', 'tiled', 'hybrid']
const most = Math.max(...rows.map(r => r.threads ?? 0))
const level = rows.find(r => r.model)?.isa

// ---- the thesis's figures: milliseconds, and megabytes in table 2 ---------------------------------
const theirs = ['bunny', 'monkey', 'dragon202k', 'armadillo'] // 4,968; 3,936; 249,881; 99,976
const pick = (list, model) => theirs.includes(model) ? list[theirs.indexOf(model)] : undefined
const table1 = {
  'i7-6820HQ, multicore': [30.5, 36.5, 71.8, 35.9], 'Vega 8, HIP': [10.9, 15.7, 37.9, 20.8],
  'M2000M, CUDA': [4.6, 6.0, 13.6, 6.7]
}
const table2 = {
  scanline: {
    25: [[3.7, 18.9], [3.7, 22.0], [5.6, 37.2], [3.9, 22.3]],
    50: [[4.3, 22.1], [3.9, 26.0], [7.6, 47.1], [4.1, 27.1]],
    100: [[4.9, 24.8], [5.1, 33.0], [11.0, 77.3], [5.8, 35.7]]
  },
  immediate: {
    25: [[4.2, 18.8], [4.4, 22.0], [6.7, 33.7], [4.3, 21.3]],
    50: [[5.4, 21.8], [4.6, 25.7], [10.0, 40.9], [5.7, 25.0]],
    100: [[6.4, 24.4], [6.0, 32.5], [13.9, 63.7], [7.5, 32.4]]
  },
  tiled: {
    25: [[3.5, 9.2], [3.8, 9.3], [10.9, 22.2], [5.6, 13.4]],
    50: [[4.1, 9.3], [4.6, 9.3], [17.4, 28.3], [8.3, 14.1]],
    100: [[4.6, 9.4], [6.1, 9.5], [29.3, 52.4], [13.1, 21.5]]
  },
  hybrid: {
    25: [[4.6, 17.7], [4.8, 17.7], [7.4, 33.7], [4.7, 21.2]],
    50: [[4.9, 17.8], [5.9, 17.8], [10.3, 40.9], [5.8, 25.0]],
    100: [[5.4, 17.9], [6.4, 20.0], [15.5, 63.6], [8.6, 32.3]]
  }
}
const table3 = {
  scanline: {
    1024: [3.7, 4.9, 11.0, 5.8], 2048: [10.2, 13.8, 23.1, 12.5],
    4096: [34.3, 47.0, 66.7, 35.3], 8192: [126.0, 174.1, 219.3, 112.7]
  },
  immediate: {
    1024: [4.5, 5.7, 13.2, 6.8], 2048: [12.0, 17.1, 29.2, 14.0],
    4096: [41.4, 57.2, 82.8, 37.4], 8192: [156.0, 222.8, 280.9, 128.8]
  },
  tiled: {
    1024: [4.3, 5.4, 29.4, 12.8], 2048: [10.3, 13.5, 43.7, 19.1],
    4096: [32.3, 44.1, 88.6, 40.3], 8192: [114.1, 158.9, 237.3, 113.1]
  },
  hybrid: {
    1024: [5.1, 6.0, 15.3, 7.9], 2048: [11.7, 15.7, 35.2, 15.5],
    4096: [38.0, 50.6, 96.6, 44.5], 8192: [136.0, 183.4, 267.8, 130.3]
  }
}
const table4 = {
  '16,4': 14.4, '32,4': 16.0, '64,4': 21.4, '32,8': 18.3, '64,8': 20.7, '128,8': 26.9, '64,16': 37.7,
  '128,16': 45.6
}
const table5 = {
  32: [6.2, 8.2, 26.0, 8.6], 64: [6.3, 8.3, 15.1, 6.7], 128: [6.3, 8.2, 13.1, 6.7],
  256: [6.0, 8.3, 13.6, 6.4]
}

// ---- cells ------------------------------------------------------------------------------------
const ms = v => v === undefined || v === null ? '' : v < 1 ? v.toFixed(2) : v < 100 ? v.toFixed(1) : v.toFixed(0)
const mb = v => (v / 1e6).toFixed(v < 1e8 ? 1 : 0)
const table = (head, body) => [
  '| ' + head.join(' | ') + ' |', '|' + head.map((_, i) => i === 0 ? '---|' : '--:|').join(''),
  ...body.map(line => '| ' + line.join(' | ') + ' |')].join('\n')

function find(where) {
  return rows.find(r => Object.entries(where).every(([k, v]) => r[k] === v) &&
    (where.threads !== undefined || r.threads === most) && (where.isa !== undefined || r.isa === level))
}

// The fastest of a row in bold.
const bold = list => {
  const numbers = list.map(v => v === undefined ? Infinity : v)
  const least = Math.min(...numbers)
  return list.map((v, i) => v === undefined ? '' : numbers[i] === least ? `**${ms(v)}**` : ms(v))
}

function cells(ending) {
  const head = ['model', 'side', 'llvmpipe', ...methods, 'auto', 'auto × llvmpipe']
  const body = []
  for (const m of models) for (const s of sizes) {
    const at = method => find({ case: `${m}-${s}`, method: method + ending })
    if (!at('auto')) continue
    const ratio = at('auto').vs_llvmpipe
    body.push([m, s, ms(at('llvmpipe')?.median_ms), ...bold([...methods, 'auto'].map(k => at(k)?.median_ms)),
      ratio === null ? '' : ratio.toFixed(1)])
  }
  return table(head, body)
}

function means() {
  return table(['method', 'threads', '× llvmpipe, geometric mean', 'least', 'there', 'speed-up by threads',
    'memory / output at 8192²'],
  run.raster_means.filter(m => m.isa === level).map(m => [m.method, m.threads, m.geomean?.toFixed(2) ?? '',
    m.least?.toFixed(2) ?? '', m.least_case ?? '', m.speed_up?.toFixed(2) ?? '',
    m.memory_of_output_8192?.toFixed(2) ?? '']))
}

function memory() {
  const body = []
  for (const m of models) for (const method of ['llvmpipe', ...methods, 'auto']) {
    const r = find({ case: `${m}-8192`, method })
    if (!r) continue
    body.push([m, method, r.peak_bytes ? mb(r.peak_bytes) : '',
      r.peak_bytes ? (r.peak_bytes / r.output_bytes).toFixed(2) : '', mb(r.peak_resident_bytes),
      (r.peak_resident_bytes / r.output_bytes).toFixed(2)])
  }
  return table(['model', 'method', 'allocated, MB', '/ output', 'resident, MB', '/ output'], body)
}

function agreement() {
  const body = []
  for (const m of models) for (const s of sizes) {
    const notes = ['llvmpipe', 'llvmpipe-phong'].map(k => find({ case: `${m}-${s}`, method: k })?.note ?? '')
    const parts = notes.map(n => /at (\d+), levels by <= (\d+), > 4 at (\d+)/.exec(n))
    if (parts[0]) body.push([m, s, parts[0][1], parts[0][2], parts[1]?.[1] ?? '', parts[1]?.[3] ?? ''])
  }
  return table(['model', 'side', 'depth: pixels covered by one only', 'levels apart, at most',
    'Phong: covered by one only', 'more than 4 levels apart'], body)
}

const both = (ours, published) => published === undefined ? ours : `${ours} (${published})`

function levels() {
  const body = []
  for (const method of ['immediate', 'auto']) for (const isa of ['v2', 'v3', 'v4']) {
    for (const threads of [...new Set(rows.filter(r => r.case === 'raster-levels').map(r => r.threads))]) {
      const line = models.map(m => find({ case: 'raster-levels', model: m, method, isa, threads })?.median_ms)
      if (line.some(v => v !== undefined)) body.push([`${method}, ${isa}, ${threads} threads`, ...line.map(ms)])
    }
  }
  for (const [name, list] of Object.entries(table1)) body.push([`thesis: ${name}`, ...models.map(m => ms(pick(list, m)))])
  return table(['', ...models], body)
}

const share = (method, model, percent, size) =>
  find({ case: 'raster-triangles', method, model, at: percent, width: size })

function shares() {
  const body = []
  for (const method of methods) for (const percent of [25, 50, 100]) {
    body.push([`${method}, ${percent} %`, ...models.map(m => {
      const r = share(method, m, percent, 1024)
      const p = pick(table2[method][percent], m)
      return r ? both(`${ms(r.median_ms)} ms ${mb(r.peak_bytes)} MB`, p && `${p[0]} ms ${p[1]} MB`) : ''
    })])
  }
  return table(['', ...models], body)
}

function products() {
  const body = []
  for (const size of sizes) for (const method of methods) for (const percent of [25, 50, 100]) {
    const line = models.map(m => share(method, m, percent, size))
    if (line.some(r => r)) {
      body.push([size, method, `${percent} %`, ...line.map(r => r ? `${ms(r.median_ms)} ms ${mb(r.peak_bytes)} MB` : '')])
    }
  }
  return table(['side', 'method', 'triangles', ...models], body)
}

function bySize() {
  const body = []
  for (const method of methods) for (const size of sizes) {
    const line = models.map(m => share(method, m, 100, size))
    if (line.some(r => r)) {
      body.push([`${method}, ${size}²`, ...line.map((r, i) =>
        r ? both(ms(r.median_ms), ms(pick(table3[method][size], models[i])) || undefined) : '')])
    }
  }
  return table(['ms', ...models], body)
}

function bins() {
  const fines = [4, 8, 16]
  return table(['bin \\ fine', ...fines.map(f => `${f}×${f}`)], [16, 32, 64, 128].map(b => [`${b}×${b}`,
    ...fines.map(f => {
      const r = find({ case: 'raster-bins', at: b, fine_pixels: f })
      return r ? both(`${ms(r.median_ms)} ms`, `${table4[`${b},${f}`]} ms`) : ''
    })]))
}

function small() {
  const body = []
  for (const method of ['immediate', 'hybrid']) for (const pixels of [1, 32, 64, 128, 256]) {
    body.push([`${method}, ${pixels === 1 ? 'none' : pixels}`, ...models.map(m => {
      const r = find({ case: 'raster-small', method, model: m, at: pixels })
      const p = method === 'immediate' && table5[pixels] ? pick(table5[pixels], m) : undefined
      return r ? both(ms(r.median_ms), p) : ''
    })])
  }
  return table(['ms', ...models], body)
}

function tiles() {
  const body = []
  for (const method of ['tiled', 'hybrid']) for (const side of [16, 32, 64, 128, 256]) {
    body.push([`${method}, ${side}×${side}`, ...models.map(m => {
      const r = find({ case: 'raster-tiles', method, model: m, at: side })
      return r ? `${ms(r.median_ms)} ms ${mb(r.peak_bytes)} MB` : ''
    })])
  }
  return table(['', ...models], body)
}

function resolve() {
  const ways = ['visibility', 'tuples', 'tuples-early', 'search', 'search-again']
  const body = []
  for (const m of models) for (const s of sizes) for (const way of ways) {
    const [depth, phong] = ['', '-phong'].map(e =>
      find({ case: 'raster-resolve', model: m, width: s, method: way + e, threads: 1 }))
    if (depth) {
      body.push([m, s, way, ms(depth.median_ms), ms(phong?.median_ms), mb(depth.peak_bytes),
        (depth.shaded / depth.fragments).toFixed(2)])
    }
  }
  return table(['model', 'side', 'way', 'depth, ms', 'Phong, ms', 'MB beside the picture',
    'coloured of covered'], body)
}

const blocks = {
  machine: () => `Commit ${run.commit}, ${run.compiler}, \`${run.flags}\`, ${run.cpu}, ${level}, ${most} threads.`,
  means, 'cells-depth': () => cells(''), 'cells-phong': () => cells('-phong'), memory, agreement, levels,
  shares, products, sizes: bySize, bins, small, tiles, resolve
}
const text = readFileSync(page, 'utf8').replace(/(<!-- ([a-z-]+) -->\n)[^]*?(\n?<!-- end -->)/g,
  (whole, head, name) => name in blocks ? `${head}${blocks[name]()}\n<!-- end -->` : whole)
writeFileSync(page, text)
