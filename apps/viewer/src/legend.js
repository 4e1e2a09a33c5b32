// What the colours of a view mean.

import { css } from './colours.js';
import { element } from './dom.js';

const tickCount = 5;

/** Three digits, none that say nothing. */
export const numberText = (value) => String(Number(value.toPrecision(3)));

function bar(scale) {
  const stops = scale.stops.map(css).join(', ');
  const node = element('div', { className: 'bar' });
  node.style.background = `linear-gradient(to right, ${stops})`;
  return node;
}

/** Ends are those of 99 % of the facets: what is beyond has the colour of the end. */
export function numbersLegend(field, scale) {
  const ticks = Array.from({ length: tickCount }, (_, n) => {
    const value = scale.number(n / (tickCount - 1));
    // What rounding leaves of zero is zero.
    const isZero = Math.abs(value) < 1e-3 * Math.abs(scale.number(1) - scale.number(0));
    return element('span', { textContent: numberText(isZero ? 0 : value) });
  });
  const title = field.unit ? `${field.label} [${field.unit}]` : field.label;
  return element(
    'div',
    { className: 'legend' },
    element('div', { textContent: title }),
    bar(scale),
    element('div', { className: 'ticks' }, ...ticks),
  );
}

/** Those that are on a surface. */
export function materialsLegend(materials, numbers) {
  const names = [...numbers].map((number) => {
    const swatch = element('i');
    swatch.style.background = css(materials[number].colour);
    return element('span', {}, swatch, materials[number].name);
  });
  return element('div', { className: 'legend materials' }, ...names);
}
