"use strict";
// States between those of table.js, which cases/playground/table.py computes; a test compares them with the solver.
// A state has edges [left, right of A, left, right of B], and factors of corner, part and node.
const NUMBERS = new Int16Array(Uint8Array.from(atob(TABLE.numbers), letter => letter.charCodeAt(0)).buffer);
const LOGARITHMS = TABLE.alphas.map(Math.log), NODES = TABLE.nodes;
const COLUMNS = Array.from({ length: TABLE.columns }, (_, n) => n / (TABLE.columns - 1));
const ANGLES = Array.from({ length: NODES }, (_, n) => Math.PI / 2 * (1 - Math.cos(Math.PI * n / (NODES - 1))));
const [SIDE, SCALE_X, SCALE_P, LINE] = TABLE.picture;

// the first of the four nodes about a place, and their weights in the cubic polynomial
function cubic(nodes, place) {
  const before = nodes.findIndex(node => node >= place);
  const first = Math.max(0, Math.min((before < 0 ? nodes.length : before) - 2, nodes.length - 4));
  const four = nodes.slice(first, first + 4);
  const weight = node => four.reduce((product, other) => other === node ? product : product * (place - other) / (node - other), 1);
  return [first, four.map(weight)];
}

// the largest rotation in degrees of blocks of side alpha: linear between the rows
function largestRotation(alpha) {
  const place = Math.log(alpha), last = LOGARITHMS.length - 1;
  if (place <= LOGARITHMS[0]) return TABLE.rotations[0];
  if (place >= LOGARITHMS[last]) return TABLE.rotations[last];
  const row = LOGARITHMS.findIndex(node => node > place) - 1;
  const share = (place - LOGARITHMS[row]) / (LOGARITHMS[row + 1] - LOGARITHMS[row]);
  return TABLE.rotations[row] + share * (TABLE.rotations[row + 1] - TABLE.rotations[row]);
}

// the state of blocks of side alpha that are rotated by psi0 degrees; a negative rotation is the mirror image
function stateOf(alpha, psi0) {
  if (psi0 < 0) return mirrored(stateOf(alpha, -psi0));
  const [row, rowWeights] = cubic(LOGARITHMS, Math.log(alpha));
  const [column, columnWeights] = cubic(COLUMNS, psi0 / largestRotation(alpha));
  const count = 4 + 4 * NODES, numbers = new Array(count).fill(0);
  rowWeights.forEach((rowWeight, i) => columnWeights.forEach((columnWeight, j) => {
    const start = ((row + i) * COLUMNS.length + column + j) * count;
    for (let n = 0; n < count; n++) numbers[n] += rowWeight * columnWeight * NUMBERS[start + n];
  }));
  const part = n => numbers.slice(4 + n * NODES, 4 + (n + 1) * NODES).map(number => number * TABLE.steps[1]);
  return { edges: numbers.slice(0, 4).map(number => number * TABLE.steps[0]), factors: [[part(0), part(1)], [part(2), part(3)]] };
}

function mirrored({ edges, factors }) {
  const turned = parts => parts.map(values => [...values].reverse()).reverse();
  return { edges: edges.map(edge => -edge).reverse(), factors: [turned(factors[1]), turned(factors[0])] };
}

// the two parts of a corner's zone, from left to right: one in which the other corner touches too, one without
function parts([leftA, rightA, leftB, rightB], corner) {
  const meeting = corner ? Math.min(leftA, rightB) : Math.max(leftA, rightB);
  return corner ? [[leftB, meeting], [meeting, rightB]] : [[leftA, meeting], [meeting, rightA]];
}

// the polynomial of an angle through values at ANGLES
function polynomial(values, angle) {
  let above = 0, below = 0;
  for (let n = 0; n < NODES; n++) {
    if (angle === ANGLES[n]) return values[n];
    const weight = (n % 2 ? -1 : 1) * (n && n < NODES - 1 ? 1 : 0.5) / (angle - ANGLES[n]);
    above += weight * values[n];
    below += weight;
  }
  return above / below;
}

// the pressure at x of a corner, 0 for A and 1 for B
function pressure(state, corner, x) {
  const [left, right] = state.edges.slice(2 * corner, 2 * corner + 2), halves = parts(state.edges, corner);
  if (x <= left || x >= right) return 0;
  const part = halves[1][0] < halves[1][1] && x >= halves[1][0] ? 1 : 0, [start, end] = halves[part];
  const angle = Math.acos(Math.max(-1, Math.min(1, 1 - 2 * (x - start) / (end - start))));
  return Math.sqrt((x - left) * (right - x)) * polynomial(state.factors[corner][part], angle);
}

// places between which a corner's curve is drawn by straight lines
function places(state, corner) {
  const inside = parts(state.edges, corner).filter(([start, end]) => start < end).flatMap(([start, end]) =>
    Array.from({ length: TABLE.points + 1 }, (_, n) => start + (end - start) * (1 - Math.cos(Math.PI * n / TABLE.points)) / 2));
  return [-SIDE, ...inside, SIDE];
}

// points [x, pressure] of a corner's curve
const outline = (state, corner) => places(state, corner).map(x => [x, pressure(state, corner, x)]);

// points [x, pressure] of the sum of both corners
const total = state => [...places(state, 0), ...places(state, 1)].sort((x, y) => x - y).map(x => [x, pressure(state, 0, x) + pressure(state, 1, x)]);

// zones of A, of B, of both and of either
function zonesOf({ edges: [leftA, rightA, leftB, rightB] }) {
  const full = leftA < rightB;
  return {
    A: [[leftA, rightA]],
    B: [[leftB, rightB]],
    both: full ? [[leftA, rightB]] : [],
    contact: full ? [[leftB, rightA]] : [[leftB, rightB], [leftA, rightA]],
  };
}
