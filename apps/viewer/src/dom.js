// Elements in one expression.

/** <tag ...properties>children</tag> */
export function element(tag, properties = {}, ...children) {
  const node = Object.assign(document.createElement(tag), properties);
  node.append(...children);
  return node;
}

/** An input or a list with its name before it. */
export const labelled = (text, ...inputs) => element('label', {}, element('span', { textContent: text }), ...inputs);
