// What colours stand for: materials, or numbers between two ends.

/** Viridis at nine places (Smith and van der Walt 2015): as light as the number is high, also for the colour-blind. */
const viridis = [
  [68, 1, 84],
  [71, 45, 123],
  [59, 82, 139],
  [44, 114, 142],
  [33, 145, 140],
  [39, 173, 129],
  [92, 200, 99],
  [170, 220, 50],
  [253, 231, 37],
];

/** Blue below zero, red above (after Moreland 2009). */
const blueToRed = [
  [40, 80, 170],
  [84, 130, 208],
  [140, 178, 232],
  [196, 212, 236],
  [225, 225, 222],
  [240, 204, 184],
  [232, 152, 122],
  [208, 92, 72],
  [172, 28, 40],
];

const unknown = [150, 150, 150];

function between(stops, part) {
  const place = Math.min(Math.max(part, 0), 1) * (stops.length - 1);
  const n = Math.min(Math.floor(place), stops.length - 2);
  return stops[n].map((low, c) => low + (place - n) * (stops[n + 1][c] - low));
}

/** Square roots on both sides of zero: what is small is seen beside what is large. */
const rooted = (x) => Math.sign(x) * Math.sqrt(Math.abs(x));
const squared = (x) => Math.sign(x) * x * x;
const plain = (x) => x;

/**
 * The scale of a field: a colour for each number, and the number at a part from 0 to 1 of the way; zero is in the
 * middle where a field has both signs.
 */
export function scaleOf(field) {
  const hasBothSigns = field.low < 0 && field.high > 0;
  const [bent, straight] = field.has_root_scale ? [rooted, squared] : [plain, plain];
  const far = Math.max(-field.low, field.high);
  const [low, high] = (hasBothSigns ? [-far, far] : [field.low, field.high]).map(bent);
  const stops = hasBothSigns ? blueToRed : viridis;
  const part = (value) => (high > low ? (bent(value) - low) / (high - low) : 0.5);
  return {
    stops,
    number: (at) => straight(low + at * (high - low)),
    colour: (value) => (Number.isNaN(value) ? unknown : between(stops, part(value))),
  };
}

/** A colour of three bytes for each of `corners` corners per facet. */
export function facetColours(values, facets, colourOf, corners = 3) {
  const colours = new Uint8Array(3 * corners * facets);
  for (let f = 0; f < facets; ++f) {
    const colour = values ? colourOf(values[f]) : unknown;
    for (let corner = 0; corner < corners; ++corner) colours.set(colour, 3 * (corners * f + corner));
  }
  return colours;
}

export const materialColour = (materials) => (number) => materials[number]?.colour ?? unknown;

export const css = ([red, green, blue]) => `rgb(${Math.round(red)} ${Math.round(green)} ${Math.round(blue)})`;
