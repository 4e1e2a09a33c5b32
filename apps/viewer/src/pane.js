// One surface as a block of the wafer: the surface itself, and where the block is cut, by the sides of the domain or
// by the reader, the solid within.

import {
  AlwaysStencilFunc,
  BackSide,
  BufferAttribute,
  BufferGeometry,
  DecrementWrapStencilOp,
  DoubleSide,
  FrontSide,
  Group,
  IncrementWrapStencilOp,
  LineBasicMaterial,
  LineSegments,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  NotEqualStencilFunc,
  Plane,
  PlaneGeometry,
  ReplaceStencilOp,
  Scene,
  Vector3,
  DirectionalLight,
  HemisphereLight,
} from 'three';
import { facetColours } from './colours.js';
import { cornerNormals, edges } from './mesh.js';
import { setSolid, solidMaterial, solidUniforms } from './solid.js';

/** The corners of all facets, one after the other. */
function cornerPositions(positions, triangles) {
  const corners = new Float32Array(3 * triangles.length);
  triangles.forEach((v, n) => {
    corners.set(positions.subarray(3 * v, 3 * v + 3), 3 * n);
  });
  return corners;
}

/**
 * The surface, closed by walls below its rim and a floor: the number of its back faces behind a place less that of its
 * front faces is 1 in the solid and 0 outside, however the rim winds.
 */
function closedBody(surface, rim, floor) {
  const { positions, triangles } = surface;
  const parts = [cornerPositions(positions, triangles)];
  const walls = new Float32Array(27 * (rim.length / 2));
  let next = 0;
  const add = (...corners) => {
    for (const corner of corners) {
      walls.set(corner, next);
      next += 3;
    }
  };
  for (let n = 0; n < rim.length; n += 2) {
    const a = [...positions.subarray(3 * rim[n], 3 * rim[n] + 3)];
    const b = [...positions.subarray(3 * rim[n + 1], 3 * rim[n + 1] + 3)];
    const belowA = [a[0], a[1], floor];
    const belowB = [b[0], b[1], floor];
    add(b, a, belowA, b, belowA, belowB);
    add(belowB, belowA, [0, 0, floor]); // together they are the floor, whatever the place they share
  }
  parts.push(walls);
  const all = new Float32Array(parts[0].length + walls.length);
  all.set(parts[0]);
  all.set(walls, parts[0].length);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(all, 3));
  return geometry;
}

/** Counts the faces of the body behind a plane. */
function counter(geometry, side, operation, plane) {
  const material = new MeshBasicMaterial({
    side,
    clippingPlanes: [plane],
    colorWrite: false,
    depthWrite: false,
    depthTest: false,
    stencilWrite: true,
    stencilFunc: AlwaysStencilFunc,
    stencilFail: operation,
    stencilZFail: operation,
    stencilZPass: operation,
  });
  return new Mesh(geometry, material);
}

/** The solid where a plane cuts it. What the normal of the plane points to stays. */
class Cap {
  constructor(plane, size, uniforms, order) {
    this.plane = plane;
    this.group = new Group();
    this.back = counter(new BufferGeometry(), BackSide, IncrementWrapStencilOp, plane);
    this.front = counter(new BufferGeometry(), FrontSide, DecrementWrapStencilOp, plane);
    this.face = new Mesh(
      new PlaneGeometry(size, size),
      solidMaterial(uniforms, {
        side: DoubleSide,
        stencilWrite: true,
        stencilRef: 0,
        stencilFunc: NotEqualStencilFunc,
        stencilFail: ReplaceStencilOp,
        stencilZFail: ReplaceStencilOp,
        stencilZPass: ReplaceStencilOp,
      }),
    );
    this.face.frustumCulled = false;
    this.face.onAfterRender = (renderer) => renderer.clearStencil();
    this.back.renderOrder = this.front.renderOrder = order;
    this.face.renderOrder = order + 0.5;
    this.group.add(this.back, this.front, this.face);
    this.place();
  }

  /** After the plane has moved. */
  place() {
    this.plane.coplanarPoint(this.face.position);
    this.face.lookAt(this.face.position.clone().sub(this.plane.normal));
  }

  setBody(geometry) {
    this.back.geometry = this.front.geometry = geometry;
  }

  /** Planes that look away are not drawn. */
  showTo(eye) {
    this.group.visible = this.isOn !== false && this.plane.distanceToPoint(eye) < 0;
  }
}

export class Pane {
  /**
   * lower and upper are the corners of the block, its floor included; cutPlane is the reader's, or null, and shared by
   * all panes.
   */
  constructor(lower, upper, cutPlane) {
    this.lower = lower;
    this.scene = new Scene();
    this.sky = new HemisphereLight(0xffffff, 0xd8dadf, 1.9);
    this.sky.position.set(0, 0, 1);
    this.light = new DirectionalLight(0xffffff, 1.4);
    this.scene.add(this.sky, this.light, this.light.target);
    this.cutPlane = cutPlane;
    this.surface = new Mesh(
      new BufferGeometry(),
      new MeshLambertMaterial({
        vertexColors: true,
        side: DoubleSide,
        polygonOffset: true,
        polygonOffsetFactor: 1,
        polygonOffsetUnits: 1,
      }),
    );
    this.lines = new LineSegments(
      new BufferGeometry(),
      new LineBasicMaterial({ color: 0x101418, transparent: true, opacity: 0.55 }),
    );
    this.lines.visible = false;
    this.surface.renderOrder = 10;
    this.lines.renderOrder = 11;
    this.scene.add(this.surface, this.lines);
    this.#addCaps(lower, upper);
  }

  #addCaps(lower, upper) {
    const size = 3 * lower.distanceTo(upper);
    const inset = 1e-4 * lower.distanceTo(upper);
    const sides = [
      new Plane(new Vector3(1, 0, 0), -lower.x - inset),
      new Plane(new Vector3(-1, 0, 0), upper.x - inset),
      new Plane(new Vector3(0, 1, 0), -lower.y - inset),
      new Plane(new Vector3(0, -1, 0), upper.y - inset),
      new Plane(new Vector3(0, 0, 1), -lower.z - inset),
    ];
    this.solid = solidUniforms();
    this.sideCaps = sides.map((plane, n) => new Cap(plane, size, this.solid, n));
    this.cutCap = new Cap(this.cutPlane, size, this.solid, sides.length);
    this.caps = [...this.sideCaps, this.cutCap];
    for (const cap of this.caps) this.scene.add(cap.group);
    this.setCut(false);
  }

  setSurface(surface) {
    this.data = surface;
    const { positions, triangles } = surface;
    const { all, rim } = edges(triangles, positions.length / 3);
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(cornerPositions(positions, triangles), 3));
    geometry.setAttribute('normal', new BufferAttribute(cornerNormals(positions, triangles), 3));
    this.#replace(this.surface, geometry);
    const lines = new BufferGeometry();
    lines.setAttribute('position', new BufferAttribute(positions, 3));
    lines.setIndex(all);
    this.#replace(this.lines, lines);
    const body = closedBody(surface, rim, this.lower.z);
    this.cutCap.back.geometry.dispose();
    for (const cap of this.caps) cap.setBody(body);
  }

  /** What lies within: see setSolid of solid.js. */
  setSolid(solid) {
    setSolid(this.solid, solid);
  }

  #replace(object, geometry) {
    object.geometry.dispose();
    object.geometry = geometry;
  }

  /** field is the name of what is coloured. */
  setColours(field, colourOf) {
    const facets = this.data.triangles.length / 3;
    const colours = facetColours(this.data.fields.get(field), facets, colourOf);
    this.surface.geometry.setAttribute('color', new BufferAttribute(colours, 3, true));
  }

  setWireframe(isOn) {
    this.lines.visible = isOn;
  }

  /** After the shared plane was moved, switched on or off. */
  setCut(isOn) {
    const planes = isOn ? [this.cutPlane] : [];
    this.surface.material.clippingPlanes = planes;
    this.lines.material.clippingPlanes = planes;
    for (const cap of this.sideCaps) cap.face.material.clippingPlanes = planes;
    this.cutCap.isOn = isOn;
    this.cutCap.place();
  }

  /** Ready to be drawn by this camera: light comes over the reader's shoulder. */
  lookFrom(camera) {
    this.light.position.copy(camera.position);
    this.light.position.addScaledVector(camera.up, camera.position.length() * 0.6);
    const right = new Vector3(1, 0, 0).applyQuaternion(camera.quaternion);
    this.light.position.addScaledVector(right, -camera.position.length() * 0.5);
    for (const cap of this.caps) cap.showTo(camera.position);
  }
}
