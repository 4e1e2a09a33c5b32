// Fills every scene of a page. Where a browser cannot, the picture that is there stays.

import { element } from './dom.js';
import { Figure } from './figure.js';
import style from './viewer.css';

document.head.append(element('style', { textContent: style }));

for (const root of document.querySelectorAll('.scene')) {
  try {
    new Figure(root);
    root.classList.add('live');
  } catch (error) {
    root.append(element('p', { textContent: `No view in space: ${error.message}` }));
  }
}
