// Surfaces in space on one canvas, side by side, all seen by the same camera.

import { Box3, ColorManagement, LinearSRGBColorSpace, PerspectiveCamera, Plane, Vector3, WebGLRenderer } from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import { Pane } from './pane.js';

const depthBelow = 0.08; // of the width of the block, below its lowest place
const azimuth = Math.PI / 6; // of the eye, from -y towards -x
const elevation = (35 * Math.PI) / 180;

/** The block that holds all outputs, in nm. */
function blockOf(description) {
  const block = new Box3();
  for (const pane of description.panes) {
    for (const output of pane.outputs) {
      block.expandByPoint(new Vector3(...output.lower));
      block.expandByPoint(new Vector3(...output.upper));
    }
  }
  const size = block.getSize(new Vector3());
  block.min.z -= depthBelow * Math.max(size.x, size.y);
  return block;
}

export class View {
  /** Throws where the browser has no WebGL. */
  constructor(canvas, description) {
    ColorManagement.enabled = false;
    this.renderer = new WebGLRenderer({ canvas, antialias: true, alpha: true, stencil: true });
    this.renderer.outputColorSpace = LinearSRGBColorSpace;
    this.renderer.localClippingEnabled = true;
    this.renderer.setClearColor(0x000000, 0);
    this.renderer.autoClear = false;
    this.renderer.setScissorTest(true);
    this.canvas = canvas;
    this.onDraw = () => {};

    // Coordinates of about 1 around the middle: depth and clipping have few digits.
    this.block = blockOf(description);
    this.centre = this.block.getCenter(new Vector3());
    this.unit = this.block.getSize(new Vector3()).length() / 2;
    const lower = this.#inScene(this.block.min);
    const upper = this.#inScene(this.block.max);
    this.cutPlane = new Plane(new Vector3(0, 1, 0), 0);
    this.panes = description.panes.map(() => new Pane(lower, upper, this.cutPlane));

    this.camera = new PerspectiveCamera(24, 1, 0.05, 50);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.draw());
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
    this.reset();
  }

  #inScene(r) {
    return r.clone().sub(this.centre).divideScalar(this.unit);
  }

  /** The eye goes back to where it was at first. */
  reset() {
    const far = 1.12 / Math.sin(((this.camera.fov / 2) * Math.PI) / 180) / Math.min(1, this.camera.aspect);
    this.camera.position.set(
      -far * Math.cos(elevation) * Math.sin(azimuth),
      -far * Math.cos(elevation) * Math.cos(azimuth),
      far * Math.sin(elevation),
    );
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.draw();
  }

  /** Surfaces as unpack() gives them, one for each pane. */
  setSurfaces(surfaces, materials) {
    surfaces.forEach((surface, n) => {
      const positions = surface.positions.slice();
      for (let k = 0; k < positions.length; k += 3) {
        positions[k] = (positions[k] - this.centre.x) / this.unit;
        positions[k + 1] = (positions[k + 1] - this.centre.y) / this.unit;
        positions[k + 2] = (positions[k + 2] - this.centre.z) / this.unit;
      }
      this.panes[n].setSurface({ ...surface, positions });
      this.panes[n].setSolid(this.#solidOf(surface.volume, materials));
    });
  }

  /** What lies within, in the coordinates of the scene. */
  #solidOf(volume, materials) {
    if (!volume) return null;
    return {
      nodes: volume.nodes,
      bytes: volume.bytes,
      lower: this.#inScene(new Vector3(...volume.lower)),
      upper: this.#inScene(new Vector3(...volume.upper)),
      colours: volume.materials.map((number) => materials[number].colour),
    };
  }

  setColours(field, colourOf) {
    for (const pane of this.panes) pane.setColours(field, colourOf);
    this.draw();
  }

  setWireframe(isOn) {
    for (const pane of this.panes) pane.setWireframe(isOn);
    this.draw();
  }

  /** Where an axis cuts, in nm; what lies before it is taken away, along z what lies above. No axis: no cut. */
  setCut(axis, position, isFlipped) {
    if (axis) {
      const sign = (axis === 'z') === isFlipped ? 1 : -1;
      this.cutPlane.normal.set(0, 0, 0)[axis] = sign;
      this.cutPlane.constant = (-sign * (position - this.centre[axis])) / this.unit;
    }
    for (const pane of this.panes) pane.setCut(Boolean(axis));
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.canvas;
    if (clientWidth === 0) return;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / this.panes.length / clientHeight;
    this.camera.updateProjectionMatrix();
    this.draw();
  }

  /** Once before the next picture of the screen, however often it is asked for. */
  draw() {
    if (this.isAskedFor) return;
    this.isAskedFor = true;
    requestAnimationFrame(() => {
      this.isAskedFor = false;
      this.#drawNow();
    });
  }

  #drawNow() {
    const width = this.canvas.clientWidth / this.panes.length;
    const height = this.canvas.clientHeight;
    this.panes.forEach((pane, n) => {
      if (!pane.data) return;
      this.renderer.setViewport(n * width, 0, width, height);
      this.renderer.setScissor(n * width, 0, width, height);
      this.renderer.clear();
      pane.lookFrom(this.camera);
      this.renderer.render(pane.scene, this.camera);
    });
    this.onDraw();
  }
}
