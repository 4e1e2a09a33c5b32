// A view with its controls: one element of a page with class "scene".

import { materialColour, scaleOf } from './colours.js';
import { element, labelled } from './dom.js';
import { materialsLegend, numbersLegend, numberText } from './legend.js';
import { unpack, unpackVolume } from './unpack.js';
import { View } from './view.js';

const material = 'material';

const textOf = (id) => document.getElementById(id).textContent;

/** The surface of an output, with what lies below it as `volume`, where the page has that. */
async function readOutput(output) {
  const surface = await unpack(textOf(output.data), output);
  if (output.volume) {
    const bytes = await unpackVolume(textOf(output.volume.data), output.volume);
    surface.volume = { ...output.volume, bytes };
  }
  return surface;
}

export class Figure {
  /** root holds the description as JSON and the packed surfaces. Throws where the browser has no WebGL. */
  constructor(root) {
    this.description = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
    this.outputCount = Math.max(...this.description.panes.map((pane) => pane.outputs.length));
    this.canvas = element('canvas');
    this.view = new View(this.canvas, this.description);
    this.#makeControls();
    this.panel = this.#layout();
    root.prepend(this.panel);
    this.view.onDraw = () => {
      this.panel.dataset.pictures = Number(this.panel.dataset.pictures ?? 0) + 1;
    };
    this.view.resize();
    this.#setControls(new URLSearchParams(location.hash.slice(1)));
  }

  /** From the address of the page: #colour=flux&cut=y&wireframe=on shows it so. */
  #setControls(wanted) {
    for (const [name, control] of Object.entries({ colour: this.field, cut: this.axis, place: this.place })) {
      const before = control.value;
      if (wanted.has(name)) control.value = wanted.get(name);
      if (control.value === '') control.value = before; // there is no such choice
    }
    this.flip.checked = wanted.has('flip');
    this.wireframe.checked = wanted.has('wireframe');
    this.view.setWireframe(this.wireframe.checked);
    this.#enableCut();
    this.cut();
    const last = this.outputCount - 1;
    this.showOutput(Math.min(Math.max(Number(wanted.get('output') ?? last) || 0, 0), last));
  }

  #makeControls() {
    const { fields } = this.description;
    const options = fields.map(({ name, label }) => element('option', { value: name, textContent: label }));
    this.field = element('select', { name: 'colour', onchange: () => this.paint() }, ...options);
    this.field.value = fields.some(({ name }) => name === 'distance_spacings') ? 'distance_spacings' : fields[0].name;
    this.axis = element(
      'select',
      { name: 'cut', onchange: () => this.#chooseAxis() },
      ...['none', 'x', 'y', 'z'].map((axis) => element('option', { value: axis, textContent: axis })),
    );
    this.place = element('input', {
      type: 'range',
      name: 'place',
      min: 0,
      max: 1,
      step: 0.002,
      value: 0.5,
      oninput: () => this.cut(),
    });
    this.flip = element('input', { type: 'checkbox', name: 'flip', onchange: () => this.cut() });
    this.cutText = element('output');
    this.wireframe = element('input', {
      type: 'checkbox',
      name: 'wireframe',
      onchange: () => this.view.setWireframe(this.wireframe.checked),
    });
    this.time = element('input', {
      type: 'range',
      name: 'output',
      min: 0,
      max: this.outputCount - 1,
      step: 1,
      oninput: () => this.showOutput(Number(this.time.value)),
    });
    this.timeText = element('output');
    this.reset = element('button', { type: 'button', textContent: 'reset', onclick: () => this.view.reset() });
    this.legend = element('div', { className: 'legends' });
    this.names = this.description.panes.map(() => element('span'));
  }

  #layout() {
    this.cutGroup = labelled('at', this.place, this.cutText);
    this.flipGroup = labelled('other side', this.flip);
    this.#enableCut();
    return element(
      'div',
      { className: 'viewer' },
      element(
        'div',
        { className: 'controls' },
        labelled('colour', this.field),
        labelled('cut along', this.axis),
        this.cutGroup,
        this.flipGroup,
        labelled('mesh', this.wireframe),
        this.reset,
      ),
      element('div', { className: 'panes' }, this.canvas, element('div', { className: 'names' }, ...this.names)),
      element('div', { className: 'controls' }, labelled('output', this.time, this.timeText)),
      this.legend,
    );
  }

  #enableCut() {
    const isOn = this.axis.value !== 'none';
    for (const group of [this.cutGroup, this.flipGroup]) group.classList.toggle('off', !isOn);
    this.place.disabled = this.flip.disabled = !isOn;
  }

  #chooseAxis() {
    this.place.value = 0.5;
    this.#enableCut();
    this.cut();
  }

  cut() {
    const axis = this.axis.value;
    if (axis === 'none') {
      this.cutText.value = '';
      this.view.setCut(null, 0, false);
      return;
    }
    const { min, max } = this.view.block;
    const position = min[axis] + Number(this.place.value) * (max[axis] - min[axis]);
    this.cutText.value = `${axis} = ${numberText(position)} nm`;
    this.view.setCut(axis, position, this.flip.checked);
  }

  /** The outputs of a number, of all panes. */
  #outputs(number) {
    return this.description.panes.map(({ outputs }) => outputs[Math.min(number, outputs.length - 1)]);
  }

  async showOutput(number) {
    this.time.value = number;
    this.wanted = number;
    const outputs = this.#outputs(number);
    const surfaces = await Promise.all(outputs.map(readOutput));
    if (this.wanted !== number) return; // another one was asked for meanwhile
    this.surfaces = surfaces;
    this.view.setSurfaces(surfaces, this.description.materials);
    this.#describe(outputs);
    this.paint();
  }

  #describe(outputs) {
    const [{ time_s: time, moment }] = outputs;
    this.timeText.value = `t = ${numberText(time)} s${moment ? `, ${moment}` : ''}`;
    outputs.forEach(({ facets }, n) => {
      const { name } = this.description.panes[n];
      this.names[n].textContent = `${name ? `${name}: ` : ''}${facets.toLocaleString('en')} facets`;
    });
    this.panel.dataset.output = this.wanted;
  }

  /** Colours the surfaces that are shown. */
  paint() {
    const field = this.description.fields.find(({ name }) => name === this.field.value);
    const isMaterial = field.name === material;
    const scale = scaleOf(field);
    const materials = materialsLegend(this.description.materials, this.#materialsShown());
    this.view.setColours(field.name, isMaterial ? materialColour(this.description.materials) : scale.colour);
    this.legend.replaceChildren(...(isMaterial ? [materials] : [numbersLegend(field, scale), materials]));
    if (!this.surfaces.every(({ fields }) => fields.has(field.name)))
      this.legend.append(element('span', { textContent: `grey: without ${field.label} at this output` }));
  }

  #materialsShown() {
    const numbers = this.surfaces.flatMap(({ fields, volume }) => [
      ...new Set(fields.get(material) ?? []),
      ...(volume?.materials ?? []),
    ]);
    return new Set(numbers.sort((a, b) => a - b));
  }
}
