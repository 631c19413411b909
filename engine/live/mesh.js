// The active mesh in three dimensions, with the sonar above it.
import {$, clamp, css, dark, fitCanvas, rgb} from './common.js';

export const scene = {gl: null, faces: 0, turn: 0.8, lift: 0.55, far: 1, dirty: true};

const meshShader = `#version 300 es
in vec3 corner; in float exact; uniform mat4 camera; uniform vec3 middle; uniform float step_m;
out vec3 place; out vec3 weight; out float whole;
void main() {
  place = corner * step_m + middle; whole = exact;
  int k = gl_VertexID % 3;
  weight = vec3(k == 0, k == 1, k == 2);
  gl_Position = camera * vec4(place, 1.0);
}`;
const meshPaint = `#version 300 es
precision highp float;
in vec3 place; in vec3 weight; in float whole; out vec4 colour;
uniform vec3 plain, amber, ground, lowHigh; uniform float reach;
void main() {
  vec3 n = normalize(cross(dFdx(place), dFdy(place)));
  if (n.z < 0.0) n = -n;
  float light = 0.35 + 0.75 * max(0.0, dot(n, normalize(vec3(-0.55, 0.35, 0.75))));
  vec3 paint = mix(plain, amber, whole) * light;
  vec3 w = weight / max(fwidth(weight), vec3(1e-6));
  float edge = clamp(min(min(w.x, w.y), w.z) - 0.2, 0.0, 1.0);
  vec3 size = fwidth(weight);
  float fine = clamp(1.0 - max(max(size.x, size.y), size.z) * 1.6, 0.0, 1.0);
  paint = mix(mix(paint, lowHigh, 0.62 * fine), paint, edge);
  float away = length(place.xy) / reach;
  colour = vec4(mix(paint, ground, smoothstep(0.8, 1.15, away)), 1.0);
}`;
const lineShader = `#version 300 es
in vec4 corner; uniform mat4 camera; out float strength;
void main() { strength = corner.w; gl_Position = camera * vec4(corner.xyz, 1.0); }`;
const linePaint = `#version 300 es
precision highp float;
in float strength; out vec4 colour; uniform vec3 ink;
void main() { colour = vec4(ink, 1.0) * strength; }`;

export function startMesh() {
  const gl = $('mesh').getContext('webgl2', {antialias: true, alpha: false});
  if (!gl) { $('mesh-note').textContent = 'this browser has no WebGL 2'; return; }
  const program = (vertex, fragment) => {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    return made;
  };
  Object.assign(scene, {gl, mesh: program(meshShader, meshPaint), lines: program(lineShader, linePaint),
    corners: gl.createBuffer(), exact: gl.createBuffer(), strokes: gl.createBuffer()});
  const canvas = $('mesh');
  let grip = null;
  canvas.addEventListener('pointerdown', event => { canvas.setPointerCapture(event.pointerId); grip = event; });
  canvas.addEventListener('pointermove', event => {
    if (!grip) return;
    scene.turn -= (event.clientX - grip.clientX) / 160;
    scene.lift = clamp(scene.lift + (event.clientY - grip.clientY) / 200, 0.05, 1.5);
    grip = event;
    scene.dirty = true;
  });
  const letGo = () => { grip = null; };
  canvas.addEventListener('pointerup', letGo);
  canvas.addEventListener('pointercancel', letGo);
  canvas.addEventListener('wheel', event => {
    event.preventDefault();
    scene.far = clamp(scene.far * (event.deltaY > 0 ? 1.12 : 0.89), 0.1, 3);
    scene.dirty = true;
  }, {passive: false});
}

export function takeMesh(bytes) {
  const view = new DataView(bytes), faces = view.getUint32(0, true);
  scene.middle = [4, 8, 12].map(i => view.getFloat32(i, true));
  scene.step = view.getFloat32(16, true);
  scene.faces = faces;
  scene.dirty = true;
  if (!scene.gl) return;
  const gl = scene.gl, flags = new Uint16Array(bytes, 20 + 18 * faces, faces), exact = new Uint8Array(3 * faces);
  for (let i = 0; i < faces; ++i) exact.fill(flags[i] ? 255 : 0, 3 * i, 3 * i + 3);
  gl.bindBuffer(gl.ARRAY_BUFFER, scene.corners);
  gl.bufferData(gl.ARRAY_BUFFER, new Int16Array(bytes, 20, 9 * faces), gl.DYNAMIC_DRAW);
  gl.bindBuffer(gl.ARRAY_BUFFER, scene.exact);
  gl.bufferData(gl.ARRAY_BUFFER, exact, gl.DYNAMIC_DRAW);
}

function product(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 4; ++i) for (let j = 0; j < 4; ++j) for (let k = 0; k < 4; ++k) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
  return c;
}
function look(eye, target, aspect, near, far) {
  const unit = v => { const l = Math.hypot(...v); return v.map(x => x / l); };
  const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const back = unit(eye.map((x, k) => x - target[k])), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
  const turn = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, -dot(right, eye), -dot(up, eye), -dot(back, eye), 1];
  const f = 1 / Math.tan(0.35);
  return product([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0], turn);
}

// Draws the mesh around the sonar at the row's position, with the track of earlier rows, if the row
// or the mesh is new. `counts` is the status frame's `mesh`.
export function drawMesh(row, rows, isNew, counts) {
  const {gl} = scene;
  if (!gl) return;
  if (fitCanvas($('mesh'))) scene.dirty = true;
  if (!scene.dirty && !isNew) return;
  scene.dirty = false;
  const canvas = $('mesh'), range = row.setting.sonars[row.sonar].range_m, {x, y, z, heading} = row.origin, height = row.origin.height || 5;
  // The origin is the sonar. The camera looks along the track from behind, to starboard and above.
  const round = heading + Math.PI + scene.turn * -1, away = scene.far * 1.75 * range;
  const eye = [Math.sin(round) * Math.cos(scene.lift) * away, Math.cos(round) * Math.cos(scene.lift) * away, Math.sin(scene.lift) * away - height];
  const camera = look(eye, [0, 0, -height], canvas.width / canvas.height, 0.02 * away, 4 * away);
  const colour = name => rgb(css(name)).map(x => x / 255);
  const ground = colour('--deep'), accent = colour('--accent');
  gl.viewport(0, 0, canvas.width, canvas.height);
  gl.clearColor(...ground, 1);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.enable(gl.DEPTH_TEST);
  const use = (program, values) => {
    gl.useProgram(program);
    gl.uniformMatrix4fv(gl.getUniformLocation(program, 'camera'), false, camera);
    for (const [name, value] of Object.entries(values)) {
      const place = gl.getUniformLocation(program, name);
      if (typeof value === 'number') gl.uniform1f(place, value);
      else gl.uniform3fv(place, value);
    }
  };
  const feed = (program, name, buffer, size, type, normal) => {
    const place = gl.getAttribLocation(program, name);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, size, type, normal, 0, 0);
  };
  if (scene.faces) {
    use(scene.mesh, {middle: [scene.middle[0] - x, scene.middle[1] - y, scene.middle[2] - z], step_m: scene.step, reach: range,
      plain: dark.matches ? [0.36, 0.47, 0.54] : [0.66, 0.73, 0.77], amber: accent, ground, lowHigh: dark.matches ? [0.05, 0.08, 0.1] : [0.32, 0.38, 0.42]});
    feed(scene.mesh, 'corner', scene.corners, 3, gl.SHORT, false);
    feed(scene.mesh, 'exact', scene.exact, 1, gl.UNSIGNED_BYTE, true);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1, 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * scene.faces);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }
  const strokes = [];
  const stroke = (a, b, from, to) => strokes.push(...a, from, ...b, to);
  for (let i = 0; i < row.ends.length; i += 3)
    stroke([0, 0, 0], [row.ends[i] - x, row.ends[i + 1] - y, row.ends[i + 2] - z], 0.85, 0.3);
  for (let i = Math.max(1, rows.length - 800); i < rows.length; ++i) {
    const a = rows[i - 1].origin, b = rows[i].origin;
    if (a && b) stroke([a.x - x, a.y - y, a.z - z], [b.x - x, b.y - y, b.z - z], 1, 1);
  }
  // The sonar, drawn as an enlarged towfish above a plumb line.
  const size = 0.05 * range, ahead = [Math.sin(heading), Math.cos(heading)], side = [ahead[1], -ahead[0]];
  const hull = (f, s, u) => [size * (f * ahead[0] + s * side[0]), size * (f * ahead[1] + s * side[1]), size * u];
  for (let k = 0; k < 12; ++k) {
    const a = k * Math.PI / 6, b = (k + 1) * Math.PI / 6;
    for (const [f, r] of [[-1, 0.16], [0, 0.24], [0.9, 0.2]]) stroke(hull(f, r * Math.cos(a), r * Math.sin(a)), hull(f, r * Math.cos(b), r * Math.sin(b)), 1, 1);
    stroke(hull(-1, 0.16 * Math.cos(a), 0.16 * Math.sin(a)), hull(0, 0.24 * Math.cos(a), 0.24 * Math.sin(a)), 1, 1);
    stroke(hull(0, 0.24 * Math.cos(a), 0.24 * Math.sin(a)), hull(0.9, 0.2 * Math.cos(a), 0.2 * Math.sin(a)), 1, 1);
    stroke(hull(0.9, 0.2 * Math.cos(a), 0.2 * Math.sin(a)), hull(1.25, 0, 0), 1, 1);
  }
  for (const s of [-1, 1]) { stroke(hull(-1, 0, 0), hull(-1.35, 0.5 * s, 0), 1, 1); stroke(hull(-1, 0, 0), hull(-1.35, 0, 0.5 * s), 1, 1); }
  stroke([0, 0, 0], [0, 0, -height], 0.5, 0.5);
  use(scene.lines, {ink: dark.matches ? [1, 0.93, 0.8] : [0.12, 0.14, 0.18]});
  gl.bindBuffer(gl.ARRAY_BUFFER, scene.strokes);
  gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(strokes), gl.DYNAMIC_DRAW);
  feed(scene.lines, 'corner', scene.strokes, 4, gl.FLOAT, false);
  gl.enable(gl.BLEND);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  gl.drawArrays(gl.LINES, 0, strokes.length / 4);
  gl.disable(gl.BLEND);
  $('mesh-note').textContent = counts ? `${counts.exact_faces.toLocaleString('en')} exact of ${counts.active_faces.toLocaleString('en')} active` : 'analysing the seafloor';
}
