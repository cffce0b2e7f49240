"use strict";
/* The page's own mathematics is that of playground_map.py and playground_states.py: the same names do the same.
   A state is {edges, closed, values}: on each piece between two edges the corners of the number `closed` are
   closed (A is 1, B is 2, both are 3), and two functions are given at nodes that crowd at its ends. */

const data = JSON.parse(document.getElementById("data").textContent);
const A = 1, B = 2, BOTH = 3, NODES = data.nodes;
const SHARE = Array.from({length: NODES}, (_, i) => (1 - Math.cos(Math.PI * i / (NODES - 1))) / 2);
const clip = (value, low, high) => Math.min(Math.max(value, low), high);
const sum = values => values.reduce((one, other) => one + other, 0);

/* ---- the table ---- */

function bytes(text) {
  return Uint8Array.from(atob(text), letter => letter.charCodeAt(0)).buffer;
}

/* [function of the numbers 0 to 65535] of the two functions of a piece. */
function readers(code) {
  const pressure = share => data.pressure * share;
  const angle = share => 2 * data.angle * (share - 0.5);
  const gap = share => (data.gap * share) ** 2;
  return [code ? pressure : gap, code === BOTH ? pressure : angle];
}

function unpacked() {
  const edges = new Float32Array(bytes(data.edges)), numbers = new Uint16Array(bytes(data.numbers));
  let edge = 0, number = 0;
  const functionOf = read => Float64Array.from(
    numbers.subarray(number, number += NODES), one => read(one / 65535));
  const state = code => {
    const closed = data.closed[code];
    const values = closed.map(one => readers(one).map(functionOf));
    return {edges: Array.from(edges.subarray(edge, edge += closed.length - 1)), closed, values};
  };
  for (const patch of data.patches) {
    const states = patch.closed.map(state);
    patch.states = patch.rows.map((_, i) => states.slice(i * patch.columns, (i + 1) * patch.columns));
  }
  return {patches: data.patches.slice(0, -1), unilateral: data.patches.at(-1)};
}

/* ---- interpolation ---- */

const ROWS = {
  crowded: alpha => {
    const far = Math.log(alpha / data.tip), size = Math.abs(far) + data.width;
    return Math.sign(far) * Math.sqrt(size * size - data.width * data.width);
  },
  even: Math.log,
};
const COLUMNS = {
  even: share => share,
  upper: share => Math.asin(share) * 2 / Math.PI,
  both: share => Math.asin(Math.sqrt(share)) * 2 / Math.PI,
};

/* [[number, Lagrange's weight], ...] of the nodes around a place. */
function neighbours(nodes, where, count) {
  count = Math.min(count, nodes.length);
  let after = nodes.findIndex(node => node >= where);
  if (after < 0) after = nodes.length;
  const first = clip(after - Math.floor(count / 2), 0, nodes.length - count);
  const own = nodes.slice(first, first + count);
  return own.map((node, i) => [first + i, own.reduce(
    (weight, other, j) => i === j ? weight : weight * (where - other) / (node - other), 1)]);
}

function interpolated(rows, row, values) {
  return sum(neighbours(rows, row, 4).map(([i, weight]) => weight * values[i]));
}

function ends(patch, alpha) {
  const row = ROWS[patch.rows_are](alpha);
  return [interpolated(patch.rows, row, patch.lower), interpolated(patch.rows, row, patch.upper)];
}

function column(patch, alpha, psi0) {
  const [low, high] = ends(patch, alpha);
  if (patch.columns === 1 || high <= low) return 0;
  return COLUMNS[patch.columns_are](clip((psi0 - low) / (high - low), 0, 1)) * (patch.columns - 1);
}

/* The state in a patch, by cubics along rows and columns. */
function within(patch, alpha, psi0) {
  const row = ROWS[patch.rows_are](alpha), where = column(patch, alpha, psi0);
  const columns = Array.from({length: patch.columns}, (_, j) => j), nodes = [];
  for (const [i, one] of neighbours(patch.rows, row, 4))
    for (const [j, other] of neighbours(columns, where, 4)) nodes.push([one * other, patch.states[i][j]]);
  const found = mean(nodes);
  return patch.columns === 1 && patch !== map.unilateral ? turned(found, alpha, psi0) : found;
}

/* A state of psi0 = data.alone, in which B alone touches, as that of another psi0: the mean gap of the corners
   grows with that of A, all else stays. */
function turned(state, alpha, psi0) {
  const more = alpha * (psi0 - data.alone) / 2, values = state.values.map(
    ([one, other], piece) => state.closed[piece] ? [one, other] : [one.map(gap => gap + more), other]);
  return {...state, values};
}

/* The weighted mean of states [[weight, state], ...] with zones alike; edges stay in order. */
function mean(nodes) {
  const {edges: {length}, closed, values: pieces} = nodes[0][1];
  const edges = Array.from({length}, (_, i) => sum(nodes.map(([weight, state]) => weight * state.edges[i])));
  for (let i = 1; i < length; i++) edges[i] = Math.max(edges[i], edges[i - 1]);
  const values = pieces.map((pair, piece) => pair.map((_, k) => {
    const found = new Float64Array(NODES);
    for (const [weight, state] of nodes)
      for (let i = 0; i < NODES; i++) found[i] += weight * state.values[piece][k][i];
    return found;
  }));
  return {edges, closed, values};
}

/* The weighted mean of states [[weight, state, psi0], ...] with other zones: a corner is closed where the mean of its
   pressures is larger than that of its gaps. */
function blended(nodes, alpha) {
  const psi0 = sum(nodes.map(([weight, , own]) => weight * own));
  const means = x => {
    const found = [0, 0, 0, 0];
    for (const [weight, state, own] of nodes)
      fields(state, x, alpha, own).forEach((one, k) => { found[k] += weight * one; });
    return found;
  };
  const closing = corner => x => {
    const [one, other, psi, gap] = means(x), half = alpha * (psi0 + psi - x) / 2;
    return corner === A ? one - gap - half : other - gap + half;
  };
  const ascending = list => [...new Set(list)].sort((one, other) => one - other);
  const marks = ascending(nodes.flatMap(([, state]) => state.edges)), x = [];
  const wide = [marks[0] - alpha, ...marks, marks.at(-1) + alpha];
  for (let i = 0; i + 1 < wide.length; i++)
    for (let part = 0; part < data.parts; part++) x.push(wide[i] + (wide[i + 1] - wide[i]) * part / data.parts);
  x.push(wide.at(-1));
  const zones = {[A]: positive(closing(A), x), [B]: positive(closing(B), x)};
  const edges = ascending(Object.values(zones).flat(2)), bounds = [-data.far, ...edges, data.far];
  const closed = [], values = [];
  for (let i = 0; i + 1 < bounds.length; i++) {
    const middle = (bounds[i] + bounds[i + 1]) / 2;
    const code = sum([A, B].filter(corner => zones[corner].some(([left, right]) => left < middle && middle < right)));
    const found = SHARE.map(share => means(bounds[i] + (bounds[i + 1] - bounds[i]) * share));
    const chosen = {0: [3, 2], [A]: [0, 2], [B]: [1, 2], [BOTH]: [0, 1]}[code];
    closed.push(code);
    values.push(chosen.map(k => Float64Array.from(found, one => one[k])));
  }
  return {edges, closed, values};
}

/* Intervals in which a function is positive, their ends halved out between samples x. */
function positive(f, x) {
  const inside = x.map(place => f(place) > 0), found = [];
  const zero = (into, out) => {
    for (let i = 0; i < 20; i++) {
      const middle = (into + out) / 2;
      if (f(middle) > 0) into = middle; else out = middle;
    }
    return into;
  };
  for (let i = 0; i < x.length; i++) {
    if (!inside[i] || inside[i - 1]) continue;
    let j = i;
    while (inside[j + 1]) j++;
    const interval = [zero(x[i], x[Math.max(i - 1, 0)]), zero(x[j], x[Math.min(j + 1, x.length - 1)])];
    if (interval[1] - interval[0] > data.narrow) found.push(interval);
  }
  return found;
}

function across(alpha) {
  return map.patches.filter(patch => patch.span[0] <= alpha && alpha <= patch.span[1])
    .sort((one, other) => ends(one, alpha)[0] - ends(other, alpha)[0]);
}

/* [patch, next one or null, share]: psi0 >= 0 lies in the patch, or at a share of the strip above it. */
function place(alpha, psi0) {
  const own = across(alpha);
  for (let i = 0; i + 1 < own.length; i++) {
    const high = ends(own[i], alpha)[1], low = ends(own[i + 1], alpha)[0];
    if (psi0 <= high) return [own[i], null, 0];
    if (psi0 < low) return [own[i], own[i + 1], (psi0 - high) / (low - high)];
  }
  return [own.at(-1), null, 0];
}

function mirrored(state) {
  const swap = [0, B, A, BOTH], back = own => Float64Array.from(own).reverse();
  const closed = state.closed.map(code => swap[code]).reverse();
  const values = state.values.map(pair => pair.map(back)).reverse().map(([one, other], i) =>
    closed[i] === BOTH ? [other, one] : [one, other.map(value => -value)]);
  return {edges: state.edges.map(edge => -edge).reverse(), closed, values};
}

/* The state at alpha and psi0, both at its own load. */
function stateAt(alpha, psi0, law) {
  if (law === "unilateral") return within(map.unilateral, alpha, 0);
  if (psi0 < 0) return mirrored(stateAt(alpha, -psi0, law));
  const [patch, after, share] = place(alpha, psi0);
  if (!after) return within(patch, alpha, psi0);
  const high = ends(patch, alpha)[1], low = ends(after, alpha)[0];
  return blended([[1 - share, within(patch, alpha, high), high], [share, within(after, alpha, low), low]], alpha);
}

/* The largest error in the middle of the cell and of those around it, with something for elsewhere. */
function errorAt(alpha, psi0, law) {
  const size = Math.abs(psi0);
  const [patch, after] = law === "unilateral" ? [map.unilateral, null] : place(alpha, size);
  const row = ROWS[patch.rows_are](alpha), number = patch.rows.findIndex(one => one >= row);
  const i = clip((number < 0 ? patch.rows.length : number) - 1, 0, patch.rows.length - 2);
  const j = Math.min(Math.floor(column(patch, alpha, size)), Math.max(patch.columns - 2, 0));
  const around = (list, k) => list.slice(Math.max(k - 1, 0), k + 2);
  if (after) return data.safety * Math.max(...around(patch.strip, i));
  return data.safety * Math.max(...around(patch.errors, i).flatMap(one => around(one, j)));
}

/* Values at nodes, in between by cubics. */
function onNodes(values, theta) {
  const first = clip(Math.floor(theta) - 1, 0, NODES - 4), s = theta - first;
  return -values[first] * (s - 1) * (s - 2) * (s - 3) / 6 + values[first + 1] * s * (s - 2) * (s - 3) / 2
    - values[first + 2] * s * (s - 1) * (s - 3) / 2 + values[first + 3] * s * (s - 1) * (s - 2) / 6;
}

/* [pressure of A (or of the one point), of B, psi, mean gap] at x. */
function fields(state, x, alpha, psi0, law) {
  const after = state.edges.findIndex(edge => edge > x), n = state.edges.length, piece = after < 0 ? n : after;
  const left = piece ? state.edges[piece - 1] : -data.far, right = piece < n ? state.edges[piece] : data.far;
  const along = clip((x - left) / Math.max(right - left, 1e-300), 0, 1);
  const theta = Math.acos(1 - 2 * along) * (NODES - 1) / Math.PI;
  const [one, other] = state.values[piece].map(values => onNodes(values, theta));
  const code = state.closed[piece];
  if (code === BOTH) return [one, other, x - psi0, 0];
  if (!code) return [0, 0, other, one];
  const gap = law === "unilateral" ? 0 : Math.abs(alpha * (psi0 + other - x)) / 2;
  return code === A ? [one, 0, other, gap] : [0, one, other, gap];
}

/* [[left, right], ...] where a corner is closed. */
function zonesOf(state, corner) {
  const ends = [-data.far, ...state.edges, data.far], found = [];
  state.closed.forEach((code, i) => {
    if (!(code & corner)) return;
    if (found.length && found.at(-1)[1] === ends[i]) found.at(-1)[1] = ends[i + 1];
    else found.push([ends[i], ends[i + 1]]);
  });
  return found;
}

/* [[left, right]] where both corners are closed. */
function fullZones(state) {
  const found = [];
  state.closed.forEach((code, i) => { if (code === BOTH) found.push([state.edges[i - 1], state.edges[i]]); });
  return found;
}

const map = unpacked();

/* ---- what is chosen ---- */

const $ = id => document.getElementById(id);
const START = {load: 1, alpha: 0.25, psi0: 0.1, law: "microblock", follow: false};
const RANGES = {load: [0.05, 2], alpha: [0.02, 2], psi0: [-0.8, 0.8]};
const STEP = {load: 0.02, alpha: 0.02, psi0: 0.01};  // of arrow keys, of the logarithm or of psi0; times ten of page keys
const toSlider = (name, value) => name === "psi0" ? value : Math.log(value);
const fromSlider = (name, value) => name === "psi0" ? value : Math.exp(value);
const choice = {...START};
let shown = null;  // the state, with what is needed to draw it

/* The chosen state: lengths, pressures and angles of its own load come in `scale` of those of load 1. */
function solved() {
  const scale = Math.sqrt(choice.load), alpha = choice.alpha / scale, psi0 = choice.psi0 / scale;
  const law = choice.law, state = stateAt(alpha, psi0, law);
  const turn = law === "unilateral" ? 0 : psi0;
  return {scale, alpha, psi0: turn, law, state, error: errorAt(alpha, psi0, law),
          at: x => fields(state, x, alpha, turn, law)};
}

function set(name, value) {
  if (name in RANGES) value = clip(value, ...RANGES[name]);
  if (name === "psi0" && Math.abs(value) < 1e-9) value = 0;
  choice[name] = value;
}

/* ---- numbers ---- */

const digits = (value, count) => value.toFixed(count).replace("-", "\u2212").replace(/^\u2212(0\.?0*)$/, "$1");
const interval = ([left, right], scale) => `${digits(left * scale, 3)} \u2026 ${digits(right * scale, 3)}`;
const listed = (zones, scale) => zones.length ? zones.map(one => interval(one, scale)).join("; ") : "none";

/* One digit, rounded upwards. */
function upwards(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  return Number((Math.ceil(value / decade * 0.999) * decade).toPrecision(1));
}

function widths(state) {
  const found = [0, 0, 0, 0];
  state.closed.slice(1, -1).forEach((code, i) => { found[code] += state.edges[i + 1] - state.edges[i]; });
  return found;
}

/* [largest pressure, its place], over all pieces in contact. */
function peak() {
  const {state, at} = shown;
  let best = [0, 0];
  state.closed.slice(1, -1).forEach((code, i) => {
    if (!code) return;
    for (let k = 0; k <= 200; k++) {
      const x = state.edges[i] + (state.edges[i + 1] - state.edges[i]) * (1 - Math.cos(Math.PI * k / 200)) / 2;
      const [one, other] = at(x);
      if (one + other > best[0]) best = [one + other, x];
    }
  });
  return best;
}

function inWords(state, law) {
  const contact = zonesOf(state, BOTH), apart = contact.length;
  const both = state.closed.includes(BOTH), one = zonesOf(state, A).length, other = zonesOf(state, B).length;
  if (law === "unilateral") return "One contact point in each block: one zone, no micromoment.";
  if (!one) return "Corner B alone touches: the blocks are rotated too far for A.";
  if (!other) return "Corner A alone touches: the blocks are rotated too far for B.";
  if (apart > 1 && both) return `${apart} zones apart; both corners are closed in a part of one.`;
  if (apart > 1) return `${apart} zones apart: on the left B touches, on the right A.`;
  const parts = widths(state), share = Math.round(100 * parts[BOTH] / sum(parts.slice(1)));
  return `One zone; both corners are closed in ${share || "less than 1"}\u00a0% of it.`;
}

function tell() {
  const {scale, state, law, error} = shown, unilateral = law === "unilateral";
  const width = (state.edges.at(-1) - state.edges[0]) / 2, parts = widths(state), contact = sum(parts.slice(1));
  const [top, where] = peak();
  const share = code => Math.round(100 * parts[code] / contact);
  const texts = {
    "words": inWords(state, law),
    "half-width": digits(width * scale, 3),
    "peak": digits(top * scale, 3),
    "peak-at": digits(where * scale, 2),
    "hardness": digits(2 / contact, 3),
    "closed": unilateral ? "\u2013" : `${share(A)}, ${share(BOTH)}, ${share(B)}\u00a0%`,
    "zones-a": unilateral ? "\u2013" : listed(zonesOf(state, A), scale),
    "zones-b": unilateral ? "\u2013" : listed(zonesOf(state, B), scale),
    "error": `${upwards(100 * error)}\u00a0%`,
    "command": command(),
    "load-value": digits(choice.load, 3),
    "alpha-value": digits(choice.alpha, 3),
    "psi0-value": digits(choice.psi0, 3),
  };
  for (const [id, text] of Object.entries(texts)) if ($(id).textContent !== text) $(id).textContent = text;
  for (const name of Object.keys(RANGES)) {
    $(name).value = toSlider(name, choice[name]);
    $(name).setAttribute("aria-valuetext", `${texts[`${name}-value`]} ${UNITS[name]}`);
  }
  $("blocks").setAttribute("aria-label", `Blocks under the cylinder. ${texts.words}`);
  $("curves").setAttribute("aria-label", "Pressures, micromoment and zones over the surface: half-width "
    + `${texts["half-width"]}, largest pressure ${texts.peak} at ${texts["peak-at"]}.`);
  if ($("details").open) table();
}

const UNITS = {load: "times load 1", alpha: "block sides over the Hertz half-width", psi0: "Hertz half-widths over the radius"};

/* The command of the case hertz that computes this state: with a radius so large that a_Hz/R is small. */
function command() {
  const R = 1e7, slope = Math.sqrt(4 * (1 - 0.3 ** 2) / (Math.PI * 100 * R));
  const psi0 = choice.psi0 * slope * 180 / Math.PI;
  const turn = choice.law === "microblock" ? `--psi0-deg ${psi0.toPrecision(6)}` : "--contact unilateral";
  return `python -m cases hertz --R 1e7 --alpha ${choice.alpha.toPrecision(6)} ${turn} `
    + `--loads ${choice.load.toPrecision(6)} --rtol 1e-5`;
}

function table() {
  const {scale, state, at} = shown, first = state.edges[0], last = state.edges.at(-1);
  const rows = Array.from({length: 25}, (_, i) => {
    const x = first + (last - first) * i / 24, [one, other] = at(x);
    const moment = shown.law === "unilateral" ? 0 : (one - other) / 2;
    return [x, one + other, one, other, moment].map(value => digits(value * scale, 3));
  });
  $("values").tBodies[0].innerHTML = rows.map(row => `<tr><td>${row.join("</td><td>")}</td></tr>`).join("");
}

/* ---- pictures ---- */

const ENLARGED = 0.3;  // a slope of a_Hz/R is drawn as one of this
const VIEW = 2.4;  // half of what is seen of the surface, over a_Hz at load 1
const SMALL = 5;  // pixels, below which blocks are not drawn one by one
const SIDE = 46, MAP_SIDE = 54, EDGE = 8;  // pixels left and right of the axes, of those of the map
let reading = null;  // abscissa that the pointer is at

const colour = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

/* A canvas as sharp as the screen; sizes are pixels of the page. */
function canvasOf(id) {
  const canvas = $(id), box = canvas.getBoundingClientRect(), ratio = window.devicePixelRatio || 1;
  const width = Math.round(box.width * ratio), height = Math.round(box.height * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, box.width, box.height);
  pen.font = "13px system-ui, sans-serif";
  return {pen, width: box.width, height: box.height};
}

/* Half of what is seen, over a_Hz at load 1. */
function view() {
  if (!choice.follow) return VIEW;
  const {scale, alpha, state} = shown;
  const reach = Math.max(-state.edges[0], state.edges.at(-1));
  return scale * Math.min(1.35 * reach + 0.4 * Math.min(alpha, 1), data.far);
}

function trace(pen, points) {
  pen.beginPath();
  points.forEach(([x, y], i) => i ? pen.lineTo(x, y) : pen.moveTo(x, y));
}

/* Height of the surface over the lowest point of the cylinder, and rotation of a block, at x of the own load. */
function surfaceAt(x) {
  const {alpha, psi0, law, at} = shown, [, , psi, gap] = at(x);
  const rise = law === "unilateral" ? 0 : alpha * alpha / 8;  // of the cylinder over corners, in their mean
  return {height: x * x / 2 + rise - gap, rotation: psi0 + psi};
}

function drawBlocks() {
  const {pen, width, height} = canvasOf("blocks"), {scale, alpha, state, law} = shown;
  const half = view(), pixels = width / (2 * half), own = pixels * scale;  // to an a_Hz of load 1, of the own load
  const up = pixels * ENLARGED * scale * (choice.follow ? 1 : scale);  // pixels to a_Hz^2/R of the own load
  const steep = ENLARGED * (choice.follow ? 1 : scale);
  const far = half / scale, rest = (surfaceAt(-far).height + surfaceAt(far).height) / 2;
  const X = x => width / 2 + x * own, Y = z => height * 0.4 - (z - rest) * up;
  const places = Array.from({length: 241}, (_, i) => -far + 2 * far * i / 240);
  const line = places.map(x => [X(x), Y(surfaceAt(x).height)]);
  // the body, the blocks, the surface
  trace(pen, [...line, [width, height], [0, height]]);
  pen.fillStyle = colour("body");
  pen.fill();
  const zones = {[A]: zonesOf(state, A), [B]: zonesOf(state, B)};
  const inside = (corner, x) => zones[corner].some(([left, right]) => left <= x && x <= right);
  const codeAt = x => law === "unilateral" ? 0 : inside(A, x) * A + inside(B, x) * B;
  const fills = [colour("block"), colour("block-a"), colour("block-b"), colour("block-both")];
  const side = alpha * own, count = Math.ceil(far / alpha) + 1, corners = [];
  pen.lineWidth = 1;
  pen.strokeStyle = colour("outline");
  for (let i = -count; i < count && side >= SMALL; i++) {
    const x = (i + 0.5) * alpha, code = codeAt(x);
    if (Math.abs(x) > data.far) continue;
    const {height: z, rotation} = surfaceAt(x), angle = rotation * steep, long = side / Math.hypot(1, angle);
    const left = [X(x) - side / 2, Y(z) + angle * side / 2], right = [X(x) + side / 2, Y(z) - angle * side / 2];
    const down = [angle * long, long];
    trace(pen, [left, right, right.map((one, k) => one + down[k]), left.map((one, k) => one + down[k])]);
    pen.closePath();
    pen.fillStyle = fills[code];
    pen.fill();
    pen.stroke();
    if (code & A) corners.push([A, left]);
    if (code & B) corners.push([B, right]);
  }
  if (side < SMALL) band(pen, line, places, codeAt, fills);
  trace(pen, line);
  pen.lineWidth = 1.5;
  pen.strokeStyle = colour("ink");
  pen.stroke();
  // the cylinder, which the surface and closed corners touch
  trace(pen, [...places.map(x => [X(x), Y(x * x / 2)]), [width, 0], [0, 0]]);
  pen.closePath();
  pen.fillStyle = colour("cylinder");
  pen.fill();
  trace(pen, places.map(x => [X(x), Y(x * x / 2)]));
  pen.stroke();
  for (const [corner, [x, y]] of corners) mark(pen, corner, x, y, clip(side / 8, 2.5, 5));
  crosshair(pen, X, height);
  pen.fillStyle = colour("ink");
  pen.textAlign = "center";
  pen.fillText("cylinder", width / 2, 22);
  $("too-small").hidden = side >= SMALL;
  $("slope").textContent = digits(steep / scale, 2);
}

/* Where blocks are too small: the colour of each place, as a band below the surface. */
function band(pen, line, places, codeAt, fills) {
  for (let i = 0; i + 1 < line.length; i++) {
    pen.fillStyle = fills[codeAt((places[i] + places[i + 1]) / 2)];
    pen.beginPath();
    pen.rect(line[i][0], line[i][1], line[i + 1][0] - line[i][0] + 0.5, 14);
    pen.fill();
  }
}

function mark(pen, corner, x, y, size) {
  pen.beginPath();
  if (corner === A) {
    pen.arc(x, y, size, 0, 2 * Math.PI);
    pen.lineWidth = 2;
    pen.strokeStyle = colour("a");
    pen.stroke();
  } else {
    pen.rect(x - size * 0.65, y - size * 0.65, size * 1.3, size * 1.3);
    pen.fillStyle = colour("b");
    pen.fill();
  }
}

/* [[x, pressure of A, of B], ...] along each piece in contact, over scales of load 1, with its `code`. */
function pressureLines() {
  const {scale, state, at} = shown, found = [];
  state.closed.forEach((code, i) => {
    if (!code) return;
    const left = state.edges[i - 1], right = state.edges[i];
    const points = Array.from({length: 3 * NODES + 1}, (_, k) => {
      const x = left + (right - left) * (1 - Math.cos(Math.PI * k / (3 * NODES))) / 2;
      const [one, other] = at(clip(x, left + 1e-9, right - 1e-9));
      return [x * scale, one * scale, other * scale];
    });
    found.push({code, points});
  });
  return found;
}

/* The least of round numbers that is no smaller. */
function rounded(value) {
  const decade = 10 ** Math.floor(Math.log10(value));
  return [1, 1.5, 2, 3, 5, 7.5, 10].map(one => one * decade).find(one => one >= value * 0.9999);
}

function drawCurves() {
  const {pen, width, height} = canvasOf("curves"), {scale, law, state} = shown;
  const half = view(), unilateral = law === "unilateral";
  const X = x => SIDE + (x / half + 1) / 2 * (width - SIDE - EDGE);
  const lines = pressureLines(), known = lines.flatMap(({points}) => points);
  const names = unilateral ? ["contact"] : ["A", "B", "both", "contact"];
  const bars = names.length * 15 + 8, free = height - bars - 40;
  const top = rounded(1.05 * Math.max(scale, ...known.map(([, one, other]) => one + other)));
  const moments = known.map(([, one, other]) => Math.abs(one - other) / 2);
  const most = unilateral ? 0.1 : rounded(1.05 * Math.max(0.02 * scale, ...moments));
  const pressure = {low: 0, high: top, from: 16, to: 16 + free * 0.62, label: "p"};
  const moment = {low: -most, high: most, from: 16 + free * 0.62 + 18, to: height - bars - 24, label: "M"};
  for (const panel of [pressure, moment]) {
    panel.Y = value => panel.to - (value - panel.low) / (panel.high - panel.low) * (panel.to - panel.from);
    frame(pen, panel, X, half, width);
  }
  ticks(pen, X, half, height - bars - 22);
  // Hertz at this load, both corners, their sum
  const ellipse = Array.from({length: 121}, (_, i) => -Math.cos(Math.PI * i / 120));
  stroke(pen, ellipse.map(x => [X(x * scale), pressure.Y(scale * Math.sqrt(Math.max(1 - x * x, 0)))]), "hertz", 2, [2, 4]);
  pen.save();
  pen.beginPath();
  pen.rect(SIDE, 0, width - SIDE - EDGE, height);
  pen.clip();
  const draw = (panel, corner, size, name, thick, dash) => runs(lines, corner).forEach(
    points => stroke(pen, points.map(point => [X(point[0]), panel.Y(size(point))]), name, thick, dash));
  draw(pressure, BOTH, ([, one, other]) => one + other, "ink", 2.5, []);
  if (!unilateral) {
    draw(pressure, A, ([, one]) => one, "a", 2, []);
    draw(pressure, B, ([, , other]) => other, "b", 2, [7, 4]);
    draw(moment, BOTH, ([, one, other]) => (one - other) / 2, "ink", 2, []);
  }
  pen.restore();
  zoneBars(pen, X, names, height - bars + 4, width);
  crosshair(pen, X, height - bars - 20, scale);
  pen.fillStyle = colour("soft");
  pen.textAlign = "right";
  if (unilateral) pen.fillText("M = 0: no lever", width - EDGE, moment.from + 14);
  pen.textAlign = "left";
}

/* Points of the pieces on which a corner is closed; pieces that touch are one line. */
function runs(lines, corner) {
  const found = [];
  let last = null;
  for (const {code, points} of lines) {
    if (!(code & corner)) continue;
    if (last !== null && Math.abs(points[0][0] - last) < 1e-9) found.at(-1).push(...points); else found.push([...points]);
    last = points.at(-1)[0];
  }
  return found;
}

function stroke(pen, points, name, thick, dash) {
  trace(pen, points);
  pen.strokeStyle = colour(name);
  pen.lineWidth = thick;
  pen.lineJoin = "round";
  pen.setLineDash(dash);
  pen.stroke();
  pen.setLineDash([]);
}

function frame(pen, panel, X, half, width) {
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  const values = panel.low ? [panel.low, 0, panel.high] : [0, panel.high / 2, panel.high];
  for (const value of values) {
    pen.strokeStyle = colour("line");
    pen.lineWidth = value ? 0.6 : 1.2;
    trace(pen, [[SIDE, panel.Y(value)], [width - EDGE, panel.Y(value)]]);
    pen.stroke();
    pen.fillStyle = colour("soft");
    pen.fillText(String(Number(value.toPrecision(3))).replace("-", "\u2212"), SIDE - 6, panel.Y(value));
  }
  pen.fillStyle = colour("ink");
  pen.textAlign = "left";
  pen.font = "italic 14px system-ui, sans-serif";
  pen.fillText(panel.label, 4, panel.Y(panel.low ? 0 : panel.high / 4));
  pen.font = "13px system-ui, sans-serif";
  pen.textBaseline = "alphabetic";
}

function ticks(pen, X, half, y) {
  const step = [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2].find(one => one >= half / 3.5) || 5;
  pen.fillStyle = colour("soft");
  pen.strokeStyle = colour("soft");
  pen.lineWidth = 1;
  pen.textAlign = "center";
  for (let i = Math.ceil(-half / step); i * step <= 0.95 * half; i++) {
    trace(pen, [[X(i * step), y - 2], [X(i * step), y + 3]]);
    pen.stroke();
    pen.fillText(String(Number((i * step).toPrecision(3))).replace("-", "\u2212"), X(i * step), y + 16);
  }
  pen.font = "italic 14px system-ui, sans-serif";
  pen.fillStyle = colour("ink");
  pen.textAlign = "right";
  pen.fillText("x", X(half), y + 16);
  pen.textAlign = "left";
  pen.font = "13px system-ui, sans-serif";
}

function zoneBars(pen, X, names, from, width) {
  const {scale, state} = shown;
  const zones = {A: zonesOf(state, A), B: zonesOf(state, B), both: fullZones(state), contact: zonesOf(state, BOTH)};
  const colours = {A: "a", B: "b", both: "both", contact: "hertz"};
  names.forEach((name, row) => {
    const y = from + 15 * row;
    pen.fillStyle = colour("soft");
    pen.font = "12px system-ui, sans-serif";
    pen.fillText(name, 2, y + 9);
    pen.fillStyle = colour(colours[name]);
    for (const [left, right] of zones[name]) {
      const from = Math.max(X(left * scale), SIDE), to = Math.min(X(right * scale), width - EDGE);
      pen.fillRect(from, y, Math.max(to - from, 1.5), 10);
    }
  });
}

function crosshair(pen, X, height, scale = 1) {
  if (reading === null) return;
  const x = X === undefined ? 0 : X(reading * scale);
  trace(pen, [[x, 0], [x, height]]);
  pen.strokeStyle = colour("accent");
  pen.lineWidth = 1;
  pen.stroke();
}

function drawMap() {
  const {pen, width, height} = canvasOf("map"), scale = shown.scale;
  const wide = width - MAP_SIDE - EDGE;
  const X = alpha => MAP_SIDE + Math.log(alpha / RANGES.alpha[0]) / Math.log(RANGES.alpha[1] / RANGES.alpha[0]) * wide;
  const Y = psi0 => 8 + (1 - psi0 / RANGES.psi0[1]) / 2 * (height - 40);
  const step = wide / COLUMN_COUNT;
  for (let i = 0; i < COLUMN_COUNT; i++) {
    const alpha = RANGES.alpha[0] * (RANGES.alpha[1] / RANGES.alpha[0]) ** ((i + 0.5) / COLUMN_COUNT);
    const [left, right] = [i, i + 1].map(one => Math.round(MAP_SIDE + one * step));
    let low = 0;
    for (const [name, end] of areasAt(alpha / scale)) {
      const high = Math.min(end * scale, RANGES.psi0[1]);
      for (const side of [1, -1]) {
        pen.fillStyle = colour(`area-${name === "alone" ? (side > 0 ? "alone-b" : "alone-a") : name}`);
        const [top, bottom] = [Y(side * low), Y(side * high)].map(Math.round).sort((one, other) => one - other);
        pen.fillRect(left, top, right - left, bottom - top);
      }
      low = high;
    }
  }
  pen.fillStyle = pen.strokeStyle = colour("soft");
  pen.textAlign = "center";
  for (const alpha of [0.02, 0.05, 0.1, 0.2, 0.5, 1, 2]) pen.fillText(String(alpha), clip(X(alpha), 0, width - 10), height - 16);
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const psi0 of [-0.8, -0.4, 0, 0.4, 0.8]) pen.fillText(digits(psi0, 1), MAP_SIDE - 5, Y(psi0));
  pen.textBaseline = "alphabetic";
  pen.fillStyle = colour("ink");
  pen.textAlign = "left";
  pen.font = "italic 14px system-ui, sans-serif";
  pen.fillText("\u03b1", MAP_SIDE - 36, height - 15);
  // psi0 R/a_Hz, upwards along the axis
  pen.save();
  pen.translate(15, Y(0) + 28);
  pen.rotate(-Math.PI / 2);
  let along = 0;
  for (const [text, index] of [["\u03c8", "0"], ["\u2009R\u2009/\u2009a", "Hz"]]) {
    pen.font = "italic 14px system-ui, sans-serif";
    pen.fillText(text, along, 0);
    along += pen.measureText(text).width;
    pen.font = "10px system-ui, sans-serif";
    pen.fillText(index, along, 3);
    along += pen.measureText(index).width;
  }
  pen.restore();
  pen.font = "13px system-ui, sans-serif";
  // the same blocks at all loads, and the point
  const loads = Array.from({length: 61}, (_, i) => RANGES.load[0] * (RANGES.load[1] / RANGES.load[0]) ** (i / 60));
  const spot = load => [X(choice.alpha * scale / Math.sqrt(load)), Y(choice.psi0 * scale / Math.sqrt(load))];
  pen.save();
  pen.beginPath();
  pen.rect(MAP_SIDE, 8, wide, height - 40);
  pen.clip();
  stroke(pen, loads.map(spot), "ink", 1.2, []);
  pen.beginPath();
  pen.arc(...spot(RANGES.load[1]), 4, 0, 2 * Math.PI);
  pen.stroke();
  pen.restore();
  pen.beginPath();
  pen.arc(X(choice.alpha), Y(choice.psi0), 6.5, 0, 2 * Math.PI);
  pen.fillStyle = colour("accent");
  pen.fill();
  pen.lineWidth = 2;
  pen.strokeStyle = colour("ground");
  pen.stroke();
}

const COLUMN_COUNT = 120;

/* [[area, psi0 up to which], ...] of the map at an alpha of the own load, ascending; known for ALPHAS. */
const [LEAST, MOST] = map.unilateral.span, ALPHAS = 300;
const AREAS = Array.from({length: ALPHAS}, (_, i) => areas(LEAST * (MOST / LEAST) ** ((i + 0.5) / ALPHAS)));

function areas(alpha) {
  const kinds = {full: "full", inside: "full", apart: "apart", "B alone": "alone"}, found = [];
  across(alpha).forEach((patch, i, own) => {
    const name = kinds[patch.name], high = i + 1 < own.length ? ends(own[i + 1], alpha)[0] : Infinity;
    if (found.length && found.at(-1)[0] === name) found.at(-1)[1] = high; else found.push([name, high]);
  });
  return found;
}

function areasAt(alpha) {
  return AREAS[clip(Math.floor(Math.log(alpha / LEAST) / Math.log(MOST / LEAST) * ALPHAS), 0, ALPHAS - 1)];
}

/* ---- what is done ---- */

let asked = false;

/* Draw in the next frame, once however often this is called until then. */
function show() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    shown = solved();
    document.body.classList.toggle("one-point", shown.law === "unilateral");
    drawBlocks();
    drawCurves();
    drawMap();
    tell();
    read();
  });
}

function read() {
  if (reading === null) return;
  const {scale, at, law} = shown, [one, other] = at(reading / scale);
  const parts = [["x", "", digits(reading, 2)], ["p", "", digits((one + other) * scale, 3)]];
  if (law !== "unilateral") {
    parts.push(["p", "A", digits(one * scale, 3)], ["p", "B", digits(other * scale, 3)]);
    parts.push(["M", "", digits((one - other) / 2 * scale, 3)]);
  }
  $("read").innerHTML = parts.map(([name, index, value]) =>
    `<span><var>${name}</var>${index && `<sub>${index}</sub>`} = ${value}</span>`).join(", ");
}

function change(name, value) {
  stop();
  set(name, value);
  show();
  remember();
}

/* The address names the state, once it has been the same for a moment. */
let remembering = null;
const MOMENT = 300;  // ms

function remember() {
  clearTimeout(remembering);
  remembering = setTimeout(() => {
    const state = Object.keys(RANGES).map(name => `${name}=${Number(choice[name].toPrecision(5))}`);
    history.replaceState(null, "", `#${state.join("&")}&law=${choice.law}`);
  }, MOMENT);
}

for (const name of Object.keys(RANGES)) {
  const slider = $(name), [low, high] = RANGES[name].map(value => toSlider(name, value));
  Object.assign(slider, {min: low, max: high});
  slider.addEventListener("input", () => change(name, fromSlider(name, Number(slider.value))));
  slider.addEventListener("keydown", event => {
    const steps = {ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1, PageUp: 10, PageDown: -10}[event.key];
    const limit = {Home: low, End: high}[event.key];
    if (steps === undefined && limit === undefined) return;
    event.preventDefault();
    const next = limit === undefined ? toSlider(name, choice[name]) + steps * STEP[name] : limit;
    change(name, fromSlider(name, Number(next.toFixed(9))));
  });
}
for (const radio of document.getElementsByName("law")) radio.addEventListener("change", () => change("law", radio.value));
$("follow").addEventListener("change", () => change("follow", $("follow").checked));
$("details").addEventListener("toggle", show);
$("reset").addEventListener("click", () => {
  stop();
  Object.assign(choice, START);
  $("follow").checked = START.follow;
  for (const radio of document.getElementsByName("law")) radio.checked = radio.value === START.law;
  show();
  remember();
});

/* The load path, from the smallest load of the slider to the largest. */
let pressing = null;
const SECONDS = 6;

function stop() {
  if (pressing !== null) cancelAnimationFrame(pressing);
  pressing = null;
  $("press").textContent = "Press";
}

$("press").addEventListener("click", () => {
  if (pressing !== null) return stop();
  const [low, high] = RANGES.load, begin = performance.now();
  const step = now => {
    const share = Math.min((now - begin) / (1000 * SECONDS), 1);
    set("load", low * (high / low) ** share);
    show();
    remember();
    if (share < 1) pressing = requestAnimationFrame(step); else stop();
  };
  $("press").textContent = "Stop";
  pressing = requestAnimationFrame(step);
});

$("copy").addEventListener("click", async () => {
  try {
    await navigator.clipboard.writeText(command());
    $("copy").textContent = "Copied";
  } catch {  // a browser may not allow it to pages that are files
    getSelection().selectAllChildren($("command"));
    $("copy").textContent = "Selected";
  }
  setTimeout(() => { $("copy").textContent = "Copy"; }, 1500);
});

for (const id of ["blocks", "curves"]) {
  $(id).addEventListener("pointermove", event => {
    const box = $(id).getBoundingClientRect(), [side, edge] = id === "curves" ? [SIDE, EDGE] : [0, 0];
    const along = (event.clientX - box.left - side) / (box.width - side - edge);
    reading = clip(2 * along - 1, -1, 1) * view();
    show();
  });
  $(id).addEventListener("pointerleave", () => { reading = null; $("read").textContent = REST; show(); });
}
const REST = $("read").textContent;

function drag(event) {
  if (event.type === "pointermove" && !event.buttons) return;
  const box = $("map").getBoundingClientRect();
  const along = clip((event.clientX - box.left - MAP_SIDE) / (box.width - MAP_SIDE - EDGE), 0, 1);
  const down = clip((event.clientY - box.top - 8) / (box.height - 40), 0, 1);
  $("map").setPointerCapture(event.pointerId);
  change("alpha", RANGES.alpha[0] * (RANGES.alpha[1] / RANGES.alpha[0]) ** along);
  change("psi0", RANGES.psi0[1] * (1 - 2 * down));
}
$("map").addEventListener("pointerdown", drag);
$("map").addEventListener("pointermove", drag);

/* A state may be named in the address: #load=2&alpha=0.5&psi0=0.1&law=unilateral */
function named() {
  for (const [name, value] of new URLSearchParams(location.hash.slice(1))) {
    if (name in RANGES && Number.isFinite(Number(value))) set(name, Number(value));
    if (name === "law" && ["microblock", "unilateral"].includes(value)) set(name, value);
  }
  for (const radio of document.getElementsByName("law")) radio.checked = radio.value === choice.law;
  show();
}

window.addEventListener("hashchange", named);
window.addEventListener("resize", show);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", show);
stop();
named();
