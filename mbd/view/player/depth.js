// Facets on a canvas, nearer ones before farther ones: with a depth buffer where there is WebGL, else painted from behind.
const CORNERS = `attribute vec3 at; attribute vec4 color; uniform vec4 scale; uniform vec2 shift; varying vec4 tone;
void main() { gl_Position = vec4(at.xy * scale.xy + shift, -at.z * scale.z, 1.0); tone = vec4(color.rgb * color.a, color.a); }`;
const PIXELS = "precision mediump float; varying vec4 tone; void main() { gl_FragColor = tone; }";
let board = null; // null before the first picture, false without WebGL
function openBoard() {
  const canvas = document.createElement("canvas"), gl = canvas.getContext("webgl", { antialias: true, alpha: true, depth: true });
  if (!gl) return false;
  const program = gl.createProgram();
  for (const [kind, text] of [[gl.VERTEX_SHADER, CORNERS], [gl.FRAGMENT_SHADER, PIXELS]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) return false;
  gl.useProgram(program);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  for (const [name, size, start] of [["at", 3, 0], ["color", 4, 12]]) {
    const place = gl.getAttribLocation(program, name);
    gl.enableVertexAttribArray(place); gl.vertexAttribPointer(place, size, gl.FLOAT, false, 4 * EACH, start);
  }
  gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL); gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  return { canvas, gl, scale: gl.getUniformLocation(program, "scale"), shift: gl.getUniformLocation(program, "shift") };
}
function drawFacets(g, w, h, v) {
  if (board === null) board = openBoard();
  if (board && board.gl.isContextLost()) board = false;
  if (board) drawBuffered(g, w, h, v); else { paint(g, v, floorFacets, false); paint(g, v, solidFacets, true); paint(g, v, hiddenFacets, false); }
}
function drawBuffered(g, w, h, v) {
  const { canvas, gl } = board, { width, height } = g.canvas;
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  let deep = 1e-9;
  for (const { data, size } of [solidFacets, floorFacets]) for (let n = 2; n < size; n += EACH) { const z = Math.abs(data[n]); if (z > deep) deep = z; }
  gl.viewport(0, 0, width, height);
  gl.depthMask(true); gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  gl.uniform4f(board.scale, (2 * v.scale) / w, (2 * v.scale) / h, 0.99 / deep, 0);
  gl.uniform2f(board.shift, (2 * camera.dx) / w, (-2 * camera.dy) / h);
  for (const [{ data, size }, blended, behind] of [[solidFacets, false, false], [hiddenFacets, true, true], [floorFacets, true, false]]) {
    if (blended) gl.enable(gl.BLEND); else gl.disable(gl.BLEND);
    gl.depthFunc(behind ? gl.GREATER : gl.LEQUAL);
    gl.depthMask(!blended);
    gl.bufferData(gl.ARRAY_BUFFER, data.subarray(0, size), gl.STREAM_DRAW);
    gl.drawArrays(gl.TRIANGLES, 0, size / EACH);
  }
  g.drawImage(canvas, 0, 0, w, h);
}
function paint(g, v, { data, size }, sorted) { // from the farthest facet to the nearest
  const step = 3 * EACH, starts = Array.from({ length: Math.floor(size / step) }, (_, k) => k * step);
  const depth = (n) => data[n + 2] + data[n + 2 + EACH] + data[n + 2 + 2 * EACH];
  if (sorted) starts.sort((a, b) => depth(a) - depth(b));
  const to = (n) => [v.middle[0] + v.scale * data[n], v.middle[1] - v.scale * data[n + 1]];
  g.lineWidth = 0.6;
  for (const n of starts) {
    const tone = [3, 4, 5].map((k) => Math.round(85 * (data[n + k] + data[n + k + EACH] + data[n + k + 2 * EACH])));
    g.globalAlpha = (data[n + 6] + data[n + 6 + EACH] + data[n + 6 + 2 * EACH]) / 3;
    g.fillStyle = g.strokeStyle = `rgb(${tone})`;
    g.beginPath(); g.moveTo(...to(n)); g.lineTo(...to(n + EACH)); g.lineTo(...to(n + 2 * EACH)); g.closePath(); g.fill();
    if (sorted) g.stroke(); // no gaps between neighbors
  }
  g.globalAlpha = 1;
}
