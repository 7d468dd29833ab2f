// In a page: two balls lit through three.js' XREstimatedLight, and the same balls lit by toThree() and cubeMap(). The
// second scene is in the probe's axes: camera and balls are turned, not the light, so that it does not depend on the
// rotation of light in lightwell/webxr.
import * as THREE from "three";
import { XREstimatedLight } from "three/addons/webxr/XREstimatedLight.js";
import { XRDevice, metaQuest3 } from "iwer";
import { cubeMap, toThree } from "lightwell";
import { provideLightEstimation } from "lightwell/webxr";

const edge = 16;

/** A white matt ball on the left, a mirror on the right, as those of examples/webxr.html. Without the mirror, frames
 *  take less time: three.js filters its cube map again whenever that changes. */
function balls(mirrors) {
  const group = new THREE.Group();
  const add = (x, options) => {
    const ball = new THREE.Mesh(new THREE.SphereGeometry(0.2, 64, 32), new THREE.MeshStandardMaterial(options));
    ball.position.set(x, 1.6, -1);
    group.add(ball);
    return ball.material;
  };
  add(-0.25, { color: "white", roughness: 1 });
  return { group, mirror: mirrors === "mirror" ? add(0.25, { color: "white", metalness: 1, roughness: 0.1 }) : null };
}

/** The texels of cubeMap() as three.js takes them: its cube textures are mirrored in x. */
function cubeTexture(texels) {
  const faces = [1, 0, 2, 3, 4, 5].map((face) => {
    const data = new Uint16Array(4 * edge * edge);
    for (let j = 0; j < edge; ++j)
      for (let i = 0; i < edge; ++i) {
        const from = 4 * ((face * edge + j) * edge + edge - 1 - i);
        data.set(texels.subarray(from, from + 4), 4 * (j * edge + i));
      }
    const texture = new THREE.DataTexture(data, edge, edge, THREE.RGBAFormat, THREE.HalfFloatType);
    texture.needsUpdate = true;
    return texture;
  });
  const cube = new THREE.CubeTexture(faces);
  cube.format = THREE.RGBAFormat;
  cube.type = THREE.HalfFloatType;
  cube.minFilter = cube.magFilter = THREE.LinearFilter;
  cube.generateMipmaps = false;
  cube.needsUpdate = true;
  return cube;
}

function pixelsOf(renderer) {
  const gl = renderer.getContext();
  const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
  const out = new Uint8Array(4 * width * height);
  gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, out);
  return { width, height, data: out };
}

const linear = (code) => (code <= 10.31475 ? code / 255 / 12.92 : ((code / 255 + 0.055) / 1.055) ** 2.4);

/** Differences of two pictures in linear light, relative to the second one: RMS, and the worst of pixels relative to
 *  the brightest, over the pixels that both show; left the matt ball, right the mirror. */
function difference(a, b) {
  const half = () => ({ error: 0, whole: 0, worst: 0, brightest: 0, pixels: 0 });
  const halves = [half(), half()];
  for (let i = 0; i < a.data.length; i += 4) {
    if (a.data[i + 3] !== 255 || b.data[i + 3] !== 255) continue;
    const sum = halves[(i / 4) % a.width < a.width / 2 ? 0 : 1];
    ++sum.pixels;
    for (let k = 0; k < 3; ++k) {
      const [x, y] = [linear(a.data[i + k]), linear(b.data[i + k])];
      sum.error += (x - y) ** 2;
      sum.whole += y * y;
      sum.worst = Math.max(sum.worst, Math.abs(x - y));
      sum.brightest = Math.max(sum.brightest, y);
    }
  }
  const [matt, mirror] = halves.map(({ error, whole, worst, brightest, pixels }) =>
    ({ rms: Math.sqrt(error / whole), worst: worst / brightest, brightest, pixels }));
  return { matt, mirror };
}

/** The balls lit by toThree() and, the mirror, cubeMap(). */
class Reference {
  constructor(mirrors) {
    this.renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true });
    this.scene = new THREE.Scene();
    this.balls = balls(mirrors);
    this.sun = new THREE.DirectionalLight();
    this.probe = new THREE.LightProbe();
    this.scene.add(this.balls.group, this.sun, this.probe);
    this.camera = new THREE.PerspectiveCamera();
    this.camera.matrixAutoUpdate = false;
  }

  /** rotation: of T_base_probe; view: the XR camera. */
  draw(light, rotation, scale, view, { width, height }) {
    this.renderer.setSize(width, height);
    const { value } = toThree(light, { color: [scale, 0, 0, 0, scale, 0, 0, 0, scale] });
    this.probe.sh.fromArray(value.sh);
    this.probe.intensity = value.lightProbeIntensity;
    this.sun.position.fromArray(value.position);
    this.sun.color.setRGB(...value.color);
    this.sun.intensity = value.intensity;
    // The sun lights the mirror itself; the other lights are part of its surroundings. One lamp is all that there is.
    if (light.lights.length > 1) throw new Error("the scene is made for one lamp at most");
    const { mirror } = this.balls;
    if (mirror && this.mirrored !== light.descriptor) {
      this.mirrored = light.descriptor;
      const { texels } = cubeMap(light, { edge, scale, lights: "excluded" });
      if (!this.texels?.every((v, i) => v === texels[i])) mirror.envMap = cubeTexture((this.texels = texels));
    }
    const toProbe = new THREE.Quaternion(...rotation).invert();
    this.balls.group.quaternion.copy(toProbe);
    this.camera.matrix.makeRotationFromQuaternion(toProbe).multiply(view.matrixWorld);
    this.camera.matrixWorldNeedsUpdate = true;
    this.camera.projectionMatrix.copy(view.projectionMatrix);
    this.camera.projectionMatrixInverse.copy(view.projectionMatrix).invert();
    this.renderer.render(this.scene, this.camera);
    return pixelsOf(this.renderer);
  }
}

/** One session: the balls lit through XREstimatedLight. */
export class XrScene {
  /** mirrors: "mirror" or "none". */
  static async start(address, options, mirrors) {
    const it = new XrScene();
    it.device = new XRDevice(metaQuest3);
    it.device.installRuntime({ forceInstall: true });
    it.estimation = await provideLightEstimation(address, options);
    it.scale = options.scale ?? 1;
    const renderer = (it.renderer = new THREE.WebGLRenderer({ antialias: false, alpha: true }));
    renderer.xr.enabled = true;
    document.body.append(renderer.domElement);
    it.scene = new THREE.Scene();
    it.balls = balls(mirrors);
    it.scene.add(it.balls.group);
    it.light = new XREstimatedLight(renderer, mirrors === "mirror");
    it.reference = new Reference(mirrors);
    const started = new Promise((resolve) => it.light.addEventListener("estimationstart", resolve));
    it.session = await navigator.xr.requestSession("immersive-ar", {
      requiredFeatures: ["light-estimation"], optionalFeatures: ["local-floor"],
    });
    await renderer.xr.setSession(it.session);
    renderer.setAnimationLoop(() => it.draw());
    await started;
    it.scene.add(it.light);
    if (it.balls.mirror) {
      it.balls.mirror.envMap = it.light.environment;
      it.balls.mirror.needsUpdate = true;
    }
    // XREstimatedLight takes an estimate in each frame, which the next frame shows. This callback comes right after it.
    const note = () => {
      it.session.requestAnimationFrame(note);
      const light = it.estimation.probe.latest();
      // On a busy machine the light may be too old for an estimate: XREstimatedLight then keeps the last one.
      if (light.ageMs <= 400) it.shown = { light, rotation: it.estimation.pose.rotation };
    };
    it.session.requestAnimationFrame(note);
    return it;
  }

  draw() {
    this.renderer.render(this.scene, new THREE.PerspectiveCamera());
    if (!this.compared || !this.shown) return;
    const { light, rotation } = this.shown;
    const [view] = this.renderer.xr.getCamera().cameras;
    const xr = pixelsOf(this.renderer);
    const reference = this.reference.draw(light, rotation, this.scale, view, xr);
    this.compared({ ...difference(xr, reference), lights: light.lights.length, direction: light.lights[0]?.direction });
    this.compared = null;
  }

  /** Differences of the next frame from the same scene lit by toThree(). */
  compare() {
    return new Promise((compared) => (this.compared = compared));
  }

  /** The last picture of both scenes, side by side, as a data URL. */
  async picture() {
    const canvas = document.createElement("canvas");
    const sources = [this.renderer.domElement, this.reference.renderer.domElement];
    [canvas.width, canvas.height] = [2 * sources[0].width, sources[0].height];
    const context = canvas.getContext("2d");
    await new Promise((drawn) => (this.compared = () => {
      sources.forEach((source, i) => context.drawImage(source, i * source.width, 0));
      drawn();
    }));
    return canvas.toDataURL();
  }

  /** Difference of a screenshot of examples/webxr.html, as a data URL, from this scene lit by toThree(). */
  async compareScreenshot(url) {
    const image = await createImageBitmap(await (await fetch(url)).blob());
    const canvas = document.createElement("canvas");
    [canvas.width, canvas.height] = [image.width, image.height];
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, image.width, image.height);
    const reference = await new Promise((drawn) => (this.compared = () => drawn(pixelsOf(this.reference.renderer))));
    if (reference.width !== image.width || reference.height !== image.height)
      throw new Error(`${image.width} x ${image.height} is not ${reference.width} x ${reference.height}`);
    // WebGL's rows begin at the bottom. The page's antialiasing mixes pixels at outlines with white: they are left out.
    const rows = { ...reference, data: reference.data.slice() };
    const row = 4 * image.width;
    for (let j = 0; j < image.height; ++j)
      rows.data.set(reference.data.subarray(row * (image.height - 1 - j), row * (image.height - j)), row * j);
    const alpha = rows.data.slice();
    for (let i = 0; i < alpha.length; i += 4)
      if ([-2 * row, 2 * row, -8, 8].some((step) => alpha[i + step + 3] !== 255)) rows.data[i + 3] = 0;
    return difference({ width: image.width, data }, rows);
  }

}
