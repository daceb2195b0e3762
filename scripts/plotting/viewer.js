"use strict";
// Shows the points of a run as small discs on the surface of bodies (surface.py), lit, in WebGL2.

const $ = (id) => document.getElementById(id);
const head = JSON.parse($("head").textContent);
const flat = head.dimension === 2;
const state = { azimuth: 35, elevation: 22, zoom: 1, pan: [0, 0], frame: 0, colour: -1, axis: -1, cut: 0.5, flip: false, contacts: false, picked: -1, playing: false };
let arrays = {}, gl, programs = {}, buffers = {}, targets = null, dirty = true;
let quality = 1; // share of the screen's pixels a side that are drawn: fewer while things move on a slow machine

// ---- numbers of the page

async function unpack() {
  const text = atob($("data").textContent.trim());
  $("data").remove();
  const packed = Uint8Array.from(text, (c) => c.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const block = await new Response(stream).arrayBuffer();
  const kinds = { uint8: Uint8Array, int8: Int8Array, uint32: Uint32Array, float32: Float32Array };
  for (const [name, [kind, offset, size]] of Object.entries(head.index)) arrays[name] = new kinds[kind](block, offset, size);
}

function places() { // 16-bit places at the start, from differences
  const n = head.points, place = new Uint16Array(3 * n);
  for (let axis = 0; axis < 3; ++axis) {
    const bytes = arrays["place_" + axis];
    for (let p = 0, value = 0; p < n; ++p) {
      value = (value + bytes[p] + 256 * bytes[n + p]) & 65535;
      place[3 * p + axis] = value;
    }
  }
  return place;
}

function interleaved(planes, count) {
  const n = head.points, out = new planes.constructor(count * n);
  for (let c = 0; c < count; ++c) for (let p = 0; p < n; ++p) out[count * p + c] = planes[c * n + p];
  return out;
}

// ---- what the graphics card does

const SPOTS = `#version 300 es
precision highp float; precision highp int; precision highp sampler2D;
layout(location = 0) in vec3 start; layout(location = 1) in float owner; layout(location = 2) in vec3 normal0;
layout(location = 3) in float deep0; layout(location = 4) in vec4 offA; layout(location = 5) in vec4 offB;
layout(location = 6) in float valueA; layout(location = 7) in float valueB;
uniform sampler2D motion, palette; uniform float extent, share, scaleA, scaleB, spacing, deepStep, reach, pixels, top;
uniform vec3 low, lower, period; uniform mat3 view; uniform vec2 centre, half_; uniform float depthHalf; uniform vec3 target;
uniform vec4 plane; uniform int cutting, flat_, valued;
flat out vec3 n, trim, colour; flat out float limit, radius, exact; flat out int body; out vec3 place;
void main() {
  gl_Position = vec4(2., 2., 2., 1.); gl_PointSize = 1.;
  body = int(owner);
  vec3 X = low + extent * start;
  vec4 r0 = texelFetch(motion, ivec2(0, body), 0), r1 = texelFetch(motion, ivec2(1, body), 0), r2 = texelFetch(motion, ivec2(2, body), 0);
  mat3 F = transpose(mat3(r0.xyz, r1.xyz, r2.xyz));
  if (offA.x < -127.5 || offB.x < -127.5) return;  // no longer there
  vec3 x = F * X + vec3(r0.w, r1.w, r2.w) + mix(offA.xyz * scaleA, offB.xyz * scaleB, share);
  vec3 wrapped = x - lower - period * floor((x - lower) / max(period, vec3(1e-30)));
  x = mix(x, lower + wrapped, vec3(greaterThan(period, vec3(0.))));
  bool inside = deep0 > 254.5;
  float deep = deep0 * deepStep;
  vec3 N = dot(normal0, normal0) > .1 ? normalize(inverse(transpose(F)) * normal0) : vec3(0.);
  radius = reach * spacing; trim = vec3(0.); limit = 1.; exact = 0.;
  float above = dot(plane.xyz, x) - plane.w;
  if (flat_ == 1) { N = view[0] * 0. + vec3(0., 0., 1.); radius = .85 * spacing; }
  else if (cutting == 2) {
    if (above > .25 * spacing || above < -spacing) return;
    vec3 moved = -above * plane.xyz;
    x += moved; radius = 1.7 * spacing; exact = 1.;
    if (!inside) { trim = N; limit = deep - dot(moved, N); if (limit < -.5 * spacing) return; }
    N = plane.xyz;
  } else {
    if (inside || deep > 1.4 * spacing) return;
    x += N * deep;
    if (cutting == 1) { above = dot(plane.xyz, x) - plane.w; if (above > radius) return; trim = plane.xyz; limit = -above; }
  }
  n = view * N;
  if (dot(N, N) < .1) n = vec3(0., 0., 1.);
  if (n.z < .02) return;
  trim = view * trim;
  place = view * (x - target);
  gl_Position = vec4((place.xy - centre) / half_, -place.z / depthHalf, 1.);
  gl_PointSize = max(2. * radius * pixels, 1.5);
  vec4 own = texelFetch(palette, ivec2(0, body), 0);
  float v = mix(valueA, valueB, share);
  colour = valued == 1 ? texelFetch(palette, ivec2(1, int(clamp(v, 0., 1.) * 63. + .5)), 0).rgb : own.rgb;
  if (valued == 0) exact = 0.;
}`;

const DISCS = `#version 300 es
precision highp float; precision highp int;
flat in vec3 n, trim, colour; flat in float limit, radius, exact; flat in int body; in vec3 place;
uniform float pixels, depthHalf, gain; uniform int flat_;
layout(location = 0) out vec4 shade; layout(location = 1) out vec4 id;
void main() {
  float size = max(2. * radius * pixels, 1.5);
  vec2 d = (gl_PointCoord - .5) * vec2(1., -1.) * size / pixels;
  float dz = flat_ == 1 ? 0. : -dot(n.xy, d) / max(n.z, .12);
  float r2 = dot(d, d) + dz * dz;
  if (size > 2. && r2 > radius * radius) discard;
  if (dot(trim, vec3(d, dz)) > limit) discard;
  // The middle of a disc is before its rim, so that neighbours blend without seams.
  float z = place.z + dz - (flat_ == 1 ? sqrt(r2) : .12 * r2 / radius);
  gl_FragDepth = .5 - .5 * z / depthHalf;
  vec3 light = normalize(vec3(-.38, .58, .72));
  float lit = flat_ == 1 ? 1. : .5 + .1 * n.y + .5 * max(dot(n, light), 0.);
  lit = mix(mix(lit, .3 + .7 * lit, gain), 1., exact);
  shade = vec4(colour * lit, 1.);
  int k = body + 1;
  id = vec4(float(k & 255), float((k >> 8) & 255), float((k >> 16) & 255), 255.) / 255.;
}`;

const COPY_POINTS = `#version 300 es
void main() { vec2 c = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4. - 1.; gl_Position = vec4(c, 0., 1.); }`;

const COPY = `#version 300 es
precision highp float; precision highp sampler2D;
uniform sampler2D shades, ids, depths; uniform float pale, edge; uniform int picked, flat_; uniform vec2 size;
out vec4 colour;
int id(ivec2 p) { vec3 c = texelFetch(ids, clamp(p, ivec2(0), ivec2(size) - 1), 0).rgb * 255. + .5; return int(c.r) + int(c.g) * 256 + int(c.b) * 65536; }
float depth(ivec2 p) { return texelFetch(depths, clamp(p, ivec2(0), ivec2(size) - 1), 0).r; }
void main() {
  ivec2 p = ivec2(gl_FragCoord.xy); int k = id(p); float z = depth(p), hidden = 0.;
  vec3 c = k == 0 ? vec3(1.) : texelFetch(shades, p, 0).rgb;
  bool line = false, mark = false;
  for (int i = 0; i < 4; ++i) { int o = id(p + ivec2(i % 2 == 0 ? i - 1 : 0, i % 2 == 1 ? i - 2 : 0)); line = line || (o != k && k != 0); }
  if (picked >= 0) for (int i = -2; i <= 2; ++i) for (int j = -2; j <= 2; ++j) { bool o = id(p + ivec2(i, j)) == picked + 1; mark = mark || (o != (k == picked + 1)); }
  if (flat_ == 0 && k != 0) for (int i = 0; i < 8; ++i) {  // crevices: what is near in the picture and nearer to the eye
    float t = 2.399963 * float(i), far = edge * float(i + 1) / 8.;
    float rise = (z - depth(p + ivec2(far * vec2(cos(t), sin(t))))) / (far + 1.);
    hidden += clamp(rise * size.y * .5 - .3, 0., 1.) * step(rise * size.y, 6.);
  }
  c *= 1. - .45 * clamp(hidden / 4., 0., 1.);
  if (line) c *= .45;
  c = mix(c, vec3(1.), pale);
  if (picked >= 0 && mark) c = vec3(.85, .1, .1);
  colour = vec4(c, 1.);
}`;

const RODS_POINTS = `#version 300 es
precision highp float;
layout(location = 0) in vec3 a; layout(location = 1) in vec3 b; layout(location = 2) in float wide; layout(location = 3) in float strong;
uniform mat3 view; uniform vec3 target; uniform vec2 centre, half_, size; uniform float widest;
out float across; flat out float strength;
void main() {
  vec2 p = ((view * (a - target)).xy - centre) / half_, q = ((view * (b - target)).xy - centre) / half_;
  vec2 along = (q - p) * size; along /= max(length(along), 1e-6);
  float w = max(wide * widest, 1.2); across = float(gl_VertexID & 1) * 2. - 1.;
  vec2 at = gl_VertexID < 2 ? p : q;
  gl_Position = vec4(at + across * w * vec2(-along.y, along.x) / size, 0., 1.); strength = strong;
}`;

const RODS = `#version 300 es
precision highp float; in float across; flat in float strength; out vec4 colour;
void main() { colour = vec4((strength > .5 ? vec3(.65, .06, .14) : vec3(.45)) * (1. - .4 * across * across), 1.); }`;

function program(points, fragments) {
  const made = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, points], [gl.FRAGMENT_SHADER, fragments]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const at = {};
  for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); ++k) {
    const name = gl.getActiveUniform(made, k).name;
    at[name] = gl.getUniformLocation(made, name);
  }
  return { made, at };
}

function buffer(values) {
  const made = gl.createBuffer();
  gl.bindBuffer(gl.ARRAY_BUFFER, made);
  gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
  return made;
}

function texture(unit, width, height, inner, format, kind, data) {
  const made = gl.createTexture();
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, made);
  gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, format, kind, data);
  for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.NEAREST], [gl.TEXTURE_MAG_FILTER, gl.NEAREST], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) gl.texParameteri(gl.TEXTURE_2D, name, value);
  return made;
}

function attribute(at, data, count, kind, normalised, divisor = 0, stride = 0, offset = 0) {
  gl.bindBuffer(gl.ARRAY_BUFFER, data);
  gl.enableVertexAttribArray(at);
  gl.vertexAttribPointer(at, count, kind, normalised, stride, offset);
  gl.vertexAttribDivisor(at, divisor);
}

function prepare() {
  gl = $("scene").getContext("webgl2", { antialias: false, preserveDrawingBuffer: true });
  if (!gl) throw new Error("this browser has no WebGL2");
  programs = { spots: program(SPOTS, DISCS), copy: program(COPY_POINTS, COPY), rods: program(RODS_POINTS, RODS) };
  const n = head.points, owner = new Float32Array(n);
  for (let b = 0, p = 0; b < arrays.counts.length; ++b) for (let k = 0; k < arrays.counts[b]; ++k) owner[p++] = b;
  buffers = { start: buffer(places()), owner: buffer(owner), normal: buffer(interleaved(arrays.normal, 3)), deep: buffer(arrays.deep), off: {}, value: {}, rods: gl.createBuffer() };
  for (const k of head.full) {
    buffers.off[k] = buffer(interleaved(arrays["off_" + k], 3));
    head.values.forEach((v, i) => { buffers.value[i + "_" + k] = buffer(arrays["value_" + v.name + "_" + k]); });
  }
  buffers.none = buffer(new Uint8Array(n));
  buffers.motion = texture(0, 3, head.bodies.length, gl.RGBA32F, gl.RGBA, gl.FLOAT, null);
  const rows = Math.max(head.bodies.length, 64), colours = new Uint8Array(8 * rows);
  buffers.colours = colours;
  for (let b = 0; b < head.bodies.length; ++b) colours.set([...arrays.colour.subarray(3 * b, 3 * b + 3), 255], 8 * b);
  buffers.palette = texture(1, 2, rows, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, colours);
}

function sized() {
  const canvas = $("scene"), ratio = quality * Math.min(devicePixelRatio || 1, 2);
  const wide = Math.max(2, Math.round(canvas.clientWidth * ratio)), tall = Math.max(2, Math.round(canvas.clientHeight * ratio));
  if (targets && targets.wide === wide && targets.tall === tall) return;
  canvas.width = wide;
  canvas.height = tall;
  if (targets) for (const old of [targets.shades, targets.ids, targets.depths]) gl.deleteTexture(old);
  const frame = targets ? targets.frame : gl.createFramebuffer();
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  const shades = texture(2, wide, tall, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, null);
  const ids = texture(3, wide, tall, gl.RGBA8, gl.RGBA, gl.UNSIGNED_BYTE, null);
  const depths = texture(4, wide, tall, gl.DEPTH_COMPONENT24, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, shades, 0);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT1, gl.TEXTURE_2D, ids, 0);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, depths, 0);
  targets = { wide, tall, frame, shades, ids, depths, ratio };
}

// ---- the view

const box = (() => {
  const lower = [...head.low], upper = head.low.map((x) => x + head.extent);
  for (let d = 0; d < head.dimension; ++d) { lower[d] = head.lower[d]; upper[d] = head.upper[d]; }
  if (flat) { lower[2] = 0; upper[2] = 0; }
  return { lower, upper, middle: lower.map((x, d) => (x + upper[d]) / 2), size: Math.hypot(...lower.map((x, d) => upper[d] - x)) };
})();

function basis() { // rows: right, up, towards the viewer
  if (flat) return [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
  const up = head.up, one = (up + 1) % 3, two = (up + 2) % 3, a = state.azimuth * Math.PI / 180, e = state.elevation * Math.PI / 180;
  const rows = [[0, 0, 0], [0, 0, 0], [0, 0, 0]];
  rows[0][one] = -Math.sin(a); rows[0][two] = Math.cos(a);
  rows[1][one] = -Math.sin(e) * Math.cos(a); rows[1][two] = -Math.sin(e) * Math.sin(a); rows[1][up] = Math.cos(e);
  rows[2][one] = Math.cos(e) * Math.cos(a); rows[2][two] = Math.cos(e) * Math.sin(a); rows[2][up] = Math.sin(e);
  return rows;
}

function camera() {
  const rows = basis(), across = [0, 1, 2].map((d) => box.upper[d] - box.lower[d]);
  const span = (k) => across.reduce((sum, x, d) => sum + Math.abs(rows[k][d]) * x, 0);
  const pixels = 0.88 * state.zoom * Math.min(targets.wide / span(0), targets.tall / span(1)); // per metre
  return { rows, pixels, half: [targets.wide / 2 / pixels, targets.tall / 2 / pixels], view: [0, 1, 2].flatMap((c) => rows.map((r) => r[c])) };
}

function around(frame) { // the full frames about a frame, and how far between them it is
  let first = head.full[0], last = head.full[head.full.length - 1];
  for (const k of head.full) { if (k <= frame) first = k; }
  for (const k of [...head.full].reverse()) { if (k >= frame) last = k; }
  if (first > frame) first = last;
  if (last < frame) last = first;
  return [first, last, last > first ? (frame - first) / (last - first) : 0];
}

function plane() {
  if (state.axis < 0) return [0, 0, 0, 0];
  const sign = state.flip ? -1 : 1, out = [0, 0, 0, 0];
  out[state.axis] = sign;
  out[3] = sign * (box.lower[state.axis] + state.cut * (box.upper[state.axis] - box.lower[state.axis]));
  return out;
}

function draw() {
  sized();
  const seen = camera(), { made, at } = programs.spots, [first, last, share] = around(state.frame);
  gl.bindFramebuffer(gl.FRAMEBUFFER, targets.frame);
  gl.drawBuffers([gl.COLOR_ATTACHMENT0, gl.COLOR_ATTACHMENT1]);
  gl.viewport(0, 0, targets.wide, targets.tall);
  gl.enable(gl.DEPTH_TEST);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.useProgram(made);
  gl.activeTexture(gl.TEXTURE0);
  gl.bindTexture(gl.TEXTURE_2D, buffers.motion);
  const size = 12 * head.bodies.length;
  gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 3, head.bodies.length, gl.RGBA, gl.FLOAT, arrays.motion.subarray(state.frame * size, (state.frame + 1) * size));
  attribute(0, buffers.start, 3, gl.UNSIGNED_SHORT, true);
  attribute(1, buffers.owner, 1, gl.FLOAT, false);
  attribute(2, buffers.normal, 3, gl.BYTE, true);
  attribute(3, buffers.deep, 1, gl.UNSIGNED_BYTE, false);
  const valued = state.colour >= 0;
  for (const [k, off, value] of [[first, 4, 6], [last, 5, 7]]) {
    attribute(off, buffers.off[k], 3, gl.BYTE, false);
    attribute(value, valued ? buffers.value[state.colour + "_" + k] : buffers.none, 1, gl.UNSIGNED_BYTE, true);
  }
  const scaleOf = (k) => head.scales[head.full.indexOf(k)] / 127;
  const period = [0, 1, 2].map((d) => (d < head.dimension && head.periodic[d] ? head.upper[d] - head.lower[d] : 0));
  const numbers = { extent: head.extent, share, scaleA: scaleOf(first), scaleB: scaleOf(last), spacing: head.spacing, deepStep: head.deep, reach: 1.15, pixels: seen.pixels, depthHalf: box.size, gain: valued ? 1 : 0 };
  for (const [name, value] of Object.entries(numbers)) if (at[name]) gl.uniform1f(at[name], value);
  for (const [name, value] of Object.entries({ motion: 0, palette: 1, flat_: flat ? 1 : 0, valued: valued ? 1 : 0 })) if (at[name]) gl.uniform1i(at[name], value);
  gl.uniform3fv(at.low, head.low);
  gl.uniform3fv(at.lower, box.lower);
  gl.uniform3fv(at.period, period);
  gl.uniform3fv(at.target, box.middle);
  gl.uniform2fv(at.centre, state.pan);
  gl.uniform2fv(at.half_, seen.half);
  gl.uniformMatrix3fv(at.view, false, seen.view);
  gl.uniform4fv(at.plane, plane());
  for (const cutting of state.axis < 0 ? [0] : [1, 2]) {
    gl.uniform1i(at.cutting, cutting);
    gl.drawArrays(gl.POINTS, 0, head.points);
  }
  for (let k = 0; k < 8; ++k) gl.disableVertexAttribArray(k);
  copy(seen);
}

function copy(seen) {
  const { made, at } = programs.copy;
  gl.bindFramebuffer(gl.FRAMEBUFFER, null);
  gl.disable(gl.DEPTH_TEST);
  gl.useProgram(made);
  [targets.shades, targets.ids, targets.depths].forEach((t, k) => { gl.activeTexture(gl.TEXTURE2 + k); gl.bindTexture(gl.TEXTURE_2D, t); });
  gl.uniform1i(at.shades, 2); gl.uniform1i(at.ids, 3); gl.uniform1i(at.depths, 4);
  gl.uniform1f(at.pale, state.contacts ? 0.7 : 0);
  gl.uniform1f(at.edge, Math.max(4, Math.min(24, 5 * head.spacing * seen.pixels)));
  gl.uniform1i(at.picked, state.picked);
  gl.uniform1i(at.flat_, flat ? 1 : 0);
  gl.uniform2f(at.size, targets.wide, targets.tall);
  gl.drawArrays(gl.TRIANGLES, 0, 3);
  if (state.contacts) rods(seen);
}

function contactsNow() { // of this frame, or of the last one before that has some
  for (let k = state.frame; k >= 0; --k) if (arrays["pairs_" + k]) return { pairs: arrays["pairs_" + k], rows: arrays["contacts_" + k] };
  return null;
}

function middle(body) { // of a body now: its map, of the middle of its points at the start
  if (!buffers.middles) {
    const place = places();
    buffers.middles = [];
    for (let b = 0, p = 0; b < arrays.counts.length; ++b) {
      const sum = [0, 0, 0];
      for (let k = 0; k < arrays.counts[b]; ++k, ++p) for (let d = 0; d < 3; ++d) sum[d] += place[3 * p + d];
      buffers.middles.push(sum.map((s, d) => head.low[d] + head.extent * s / 65535 / Math.max(arrays.counts[b], 1)));
    }
  }
  const m = arrays.motion.subarray(12 * (state.frame * head.bodies.length + body)), x = buffers.middles[body];
  return [0, 1, 2].map((i) => m[4 * i] * x[0] + m[4 * i + 1] * x[1] + m[4 * i + 2] * x[2] + m[4 * i + 3]);
}

function rods(seen) {
  const now = contactsNow();
  if (!now) return;
  const count = now.pairs.length / 2, force = [], data = [], most = Math.max(...arrays.counts);
  for (let k = 0; k < count; ++k) force.push(Math.hypot(...now.rows.subarray(6 * k + 3, 6 * k + 6)));
  const sorted = [...force].sort((a, b) => a - b), top = sorted[Math.floor(0.99 * (count - 1))] || 1, mean = force.reduce((a, b) => a + b, 0) / Math.max(count, 1);
  const usual = [...arrays.counts].sort((a, b) => a - b)[Math.floor(head.bodies.length / 2)];
  for (let k = 0; k < count; ++k) {
    const point = [...now.rows.subarray(6 * k, 6 * k + 3)];
    for (let side = 0; side < 2; ++side) {
      const body = now.pairs[2 * k + side];
      if (arrays.counts[body] > 8 * usual) continue;
      const end = middle(body).map((x, d) => {
        const period = d < head.dimension && head.periodic[d] ? head.upper[d] - head.lower[d] : 0;
        return period ? x - period * Math.round((x - point[d]) / period) : x;
      });
      data.push(...point, ...end, Math.min(force[k] / top, 1), force[k] >= mean ? 1 : 0);
    }
  }
  const { made, at } = programs.rods;
  gl.useProgram(made);
  gl.bindBuffer(gl.ARRAY_BUFFER, buffers.rods);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(data), gl.DYNAMIC_DRAW);
  [[0, 3, 0], [1, 3, 12], [2, 1, 24], [3, 1, 28]].forEach(([k, n, o]) => attribute(k, buffers.rods, n, gl.FLOAT, false, 1, 32, o));
  gl.uniformMatrix3fv(at.view, false, seen.view);
  gl.uniform3fv(at.target, box.middle);
  gl.uniform2fv(at.centre, state.pan);
  gl.uniform2fv(at.half_, seen.half);
  gl.uniform2f(at.size, targets.wide, targets.tall);
  const mass = head.points / head.bodies.length, grain = head.spacing * (flat ? Math.sqrt(mass) : Math.cbrt(mass));
  gl.uniform1f(at.widest, 0.25 * grain * seen.pixels);
  gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, data.length / 8);
  for (let k = 0; k < 4; ++k) { gl.disableVertexAttribArray(k); gl.vertexAttribDivisor(k, 0); }
}

function pickAt(x, y) { // CSS pixels in the canvas; the body's index, or -1
  draw();
  gl.bindFramebuffer(gl.FRAMEBUFFER, targets.frame);
  gl.readBuffer(gl.COLOR_ATTACHMENT1);
  const out = new Uint8Array(4);
  gl.readPixels(Math.round(x * targets.ratio), targets.tall - 1 - Math.round(y * targets.ratio), 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, out);
  return out[0] + 256 * out[1] + 65536 * out[2] - 1;
}
