// What a replay shows in three dimensions: robots made of their collision shapes, the environment, contacts.
import * as three from 'three';
import {column} from './data.js';

/** A geometry in the shape's own frame; sizes as the simulator has them (z is the axis of cylinders and capsules). ground: heights that are the trace's own. */
function geometryOf(collider, size, scene, ground) {
  const [a, b, c] = size;
  switch (collider.kind) {
    case 'box': return new three.BoxGeometry(a, b, c);
    case 'sphere': return new three.SphereGeometry(a, 24, 16);
    case 'cylinder': return new three.CylinderGeometry(a, a, b, 28).rotateX(Math.PI / 2);
    case 'capsule': return new three.CapsuleGeometry(a, b, 8, 20).rotateX(Math.PI / 2);
    case 'mesh': return meshGeometry(scene.meshes[collider.mesh], size);
    case 'heightfield': {
      const grid = scene.grids[collider.grid];
      return terrainGeometry(ground ? {...grid, height: ground} : grid, size);
    }
    default: return null; // planes are drawn apart
  }
}

function meshGeometry(mesh, size) {
  const points = column(mesh.vertices), flat = new Float32Array(3 * mesh.triangles.length);
  mesh.triangles.forEach((vertex, i) => {
    for (let k = 0; k < 3; ++k) flat[3 * i + k] = points[3 * vertex + k] * size[k];
  });
  const out = new three.BufferGeometry();
  out.setAttribute('position', new three.BufferAttribute(flat, 3));
  out.computeVertexNormals();
  return out;
}

function terrainGeometry({nx, ny, height}, [sx, sy, factor]) {
  const heights = column(height);
  const out = new three.PlaneGeometry(sx, sy, nx - 1, ny - 1); // rows from +y downwards
  const place = out.attributes.position;
  for (let iy = 0; iy < ny; ++iy) {
    for (let ix = 0; ix < nx; ++ix) place.setZ(iy * nx + ix, heights[(ny - 1 - iy) * nx + ix] * factor);
  }
  out.computeVertexNormals();
  return out;
}

/** A trace that is shown: its poses, its contacts, and its robot. */
export class Player {
  constructor(trace, scene) {
    this.trace = trace;
    this.time = trace.time;
    this.poses = trace.bodies.poses.map(column);
    this.group = new three.Group();
    this.bodies = scene.bodies.map(() => new three.Group());
    this.group.add(...this.bodies);
    this.fixed = []; // meshes of the environment
    this.moving = []; // meshes of bodies
    this.readContacts(trace.bodies.contacts);
    scene.colliders.forEach((collider, k) => this.addCollider(collider, trace.bodies.shapes[k], scene, trace.bodies.grounds[k]));
  }

  addCollider(collider, [a, b, c, x, y, z, qx, qy, qz, qw], scene, ground) {
    const geometry = geometryOf(collider, [a, b, c], scene, ground);
    if (!geometry) return;
    const mesh = new three.Mesh(geometry);
    mesh.position.set(x, y, z);
    mesh.quaternion.set(qx, qy, qz, qw);
    mesh.userData = {name: collider.name, object: collider.object, player: this};
    if (collider.body < 0) {
      this.fixed.push(mesh);
      return;
    }
    this.moving.push(mesh);
    this.bodies[collider.body].add(mesh);
  }

  readContacts({frame, pairs, points, normals, impulses}) {
    const [p, n, j] = [points, normals, impulses].map(column);
    this.contacts = new Map();
    frame.forEach((f, i) => {
      if (!this.contacts.has(f)) this.contacts.set(f, []);
      this.contacts.get(f).push({a: pairs[2 * i], b: pairs[2 * i + 1], point: [p[3 * i], p[3 * i + 1], p[3 * i + 2]], normal: [n[3 * i], n[3 * i + 1], n[3 * i + 2]], impulse: j[i]});
    });
  }

  get end() {
    return this.time[this.time.length - 1];
  }

  /** The frame at or before a time. */
  frameAt(t) {
    let low = 0, high = this.time.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (this.time[middle] <= t) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  pose(body, frame, p, q) {
    const at = (i) => this.poses[7 * body + i][frame];
    p.set(at(0), at(1), at(2));
    q.set(at(3), at(4), at(5), at(6)).normalize();
  }

  /** Puts the bodies where they are at a time, between frames by interpolation. */
  show(t) {
    const frame = this.frameAt(t), next = Math.min(frame + 1, this.time.length - 1);
    const span = this.time[next] - this.time[frame];
    const share = span > 0 ? Math.min(1, Math.max(0, (t - this.time[frame]) / span)) : 0;
    this.bodies.forEach((group, k) => {
      this.pose(k, frame, group.position, group.quaternion);
      this.pose(k, next, scratch.p, scratch.q);
      group.position.lerp(scratch.p, share);
      group.quaternion.slerp(scratch.q, share);
    });
  }

  /** Contacts of the frame that a time belongs to, with their mean force in N. */
  contactsAt(t) {
    let frame = this.frameAt(t);
    if (this.time[frame] < t - 1e-9) frame = Math.min(frame + 1, this.time.length - 1);
    const span = frame > 0 ? this.time[frame] - this.time[frame - 1] : 0;
    return (this.contacts.get(frame) ?? []).map((one) => ({...one, force: span > 0 ? one.impulse / span : 0}));
  }

  /** Where the base, or whatever body stands for the robot, goes. */
  path() {
    const out = [];
    for (let i = 0; i < this.time.length; ++i) out.push(new three.Vector3(this.poses[0][i], this.poses[1][i], this.poses[2][i]));
    return out;
  }

  paint(material) {
    for (const mesh of this.moving) mesh.material = material;
  }
}
const scratch = {p: new three.Vector3(), q: new three.Quaternion()};

/** The box around what moves, over a whole trace, and the robot's own size at the start. */
export function bounds(players) {
  const box = new three.Box3(), robot = new three.Box3(), one = new three.Box3();
  for (const player of players) {
    player.path().forEach((point) => Number.isFinite(point.x) && box.expandByPoint(point));
    player.show(0);
    player.group.updateMatrixWorld(true);
    for (const mesh of player.moving) {
      one.setFromObject(mesh);
      if (!mesh.userData.object) robot.union(one);
      box.union(one);
    }
  }
  const size = robot.isEmpty() ? 1 : robot.getSize(new three.Vector3()).length();
  return {box, size: Math.max(size, 1e-3)};
}

/** Arrows from contact points: along the normal, onto the body that moves, as long as the force is large. */
export class ContactArrows {
  constructor(size, weight) {
    this.group = new three.Group();
    this.size = size;
    this.weight = weight > 0 ? weight : 10;
    this.material = new three.MeshBasicMaterial({depthTest: false, transparent: true}); // seen through legs and ground
    this.shaft = new three.CylinderGeometry(0.008 * size, 0.008 * size, 1, 10).translate(0, 0.5, 0);
    this.tip = new three.ConeGeometry(0.022 * size, 0.05 * size, 14).translate(0, 0.025 * size, 0);
    this.point = new three.SphereGeometry(0.014 * size, 12, 8);
    this.free = [];
  }

  show(contacts, colliders) {
    this.free.push(...this.group.children);
    this.group.clear();
    for (const contact of contacts) {
      const arrow = this.free.pop() ?? this.make();
      const sign = colliders[contact.a].body >= 0 ? 1 : -1;
      const direction = new three.Vector3(...contact.normal).multiplyScalar(sign);
      arrow.position.set(...contact.point);
      arrow.quaternion.setFromUnitVectors(UP, direction.lengthSq() > 0 ? direction.normalize() : UP);
      const length = Math.min(1.5, 0.5 * contact.force / this.weight) * this.size;
      arrow.children[0].scale.y = Math.max(length, 1e-6);
      arrow.children[1].position.y = length;
      arrow.children[1].visible = arrow.children[0].visible = length > 0.01 * this.size;
      this.group.add(arrow);
    }
  }

  make() {
    const arrow = new three.Group();
    arrow.add(new three.Mesh(this.shaft, this.material), new three.Mesh(this.tip, this.material), new three.Mesh(this.point, this.material));
    arrow.children.forEach((one) => { one.renderOrder = 2; });
    return arrow;
  }
}
const UP = new three.Vector3(0, 1, 0);
