// Spheres lit by three.js (release 111, Debian's libjs-three) with the values of toThree(). Without three.js or WebGL:
// spheres_flat.js.
import { columns, rows } from "./panorama.js";
import { toThree } from "./sdk/three.js";

const release = "111";
const spacing = 2.25;

/** null where there is no WebGL, and where the probe was built without three.js or with another release. */
async function loadThree() {
  // Asked on another canvas, because three.js would complain in the console.
  if (!document.createElement("canvas").getContext("webgl")) return null;
  const { three } = await import("./three/load.js");
  return three?.REVISION === release ? three : null;
}

/** Mirror: the panorama, which has the colours of the display already. */
const mirrorVertex = `
varying vec3 vNormal;
varying vec3 vView;
void main() {
  vec4 world = modelMatrix * vec4(position, 1.0);
  vNormal = normalize(mat3(modelMatrix) * normal);
  vView = world.xyz - cameraPosition;
  gl_Position = projectionMatrix * viewMatrix * world;
}`;
const mirrorFragment = `
uniform sampler2D panorama;
varying vec3 vNormal;
varying vec3 vView;
void main() {
  vec3 d = reflect(normalize(vView), normalize(vNormal));
  float u = atan(d.x, -d.z) / 6.28318530718 + 0.5;
  float v = asin(clamp(d.y, -1.0, 1.0)) / 3.14159265359 + 0.5;
  gl_FragColor = vec4(texture2D(panorama, vec2(u, v)).rgb * 0.94, 1.0);
}`;

class ThreeSpheres {
  constructor(canvas, three) {
    this.canvas = canvas;
    this.three = three;
    const renderer = (this.renderer = new three.WebGLRenderer({ canvas, antialias: true, alpha: true }));
    renderer.gammaOutput = true;
    renderer.shadowMap.enabled = true;
    renderer.shadowMap.type = three.PCFShadowMap;
    renderer.toneMapping = three.ACESFilmicToneMapping;
    renderer.toneMappingExposure = 1.25;
    this.scene = new three.Scene();
    this.camera = new three.PerspectiveCamera(24, 1.6, 0.1, 60);
    this.camera.position.set(0, 2.4, 14);
    this.camera.lookAt(0, -0.25, 0);
    this.probe = new three.LightProbe();
    this.sun = new three.DirectionalLight(0xffffff, 0);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(512, 512);
    this.sun.shadow.radius = 2;
    this.sun.shadow.bias = -0.002;
    Object.assign(this.sun.shadow.camera, { left: -6, right: 6, top: 6, bottom: -6, near: 1, far: 40 });
    this.scene.add(this.probe, this.sun, this.sun.target);
    this.addObjects();
  }

  addObjects() {
    const { three, scene } = this;
    const geometry = new three.SphereBufferGeometry(1, 64, 48);
    this.panoramaCanvas = document.createElement("canvas");
    this.panoramaCanvas.width = 4 * columns;
    this.panoramaCanvas.height = 4 * rows;
    this.texture = new three.CanvasTexture(this.panoramaCanvas);
    this.texture.generateMipmaps = false;
    this.texture.minFilter = three.LinearFilter;
    this.texture.wrapS = three.RepeatWrapping;
    const materials = [
      new three.MeshStandardMaterial({ color: 0xe8e8e8, roughness: 1, metalness: 0 }),
      new three.MeshStandardMaterial({ color: 0xe2a33a, roughness: 0.32, metalness: 0 }),
      new three.ShaderMaterial({
        uniforms: { panorama: { value: this.texture } }, vertexShader: mirrorVertex, fragmentShader: mirrorFragment,
      }),
    ];
    materials.forEach((material, i) => {
      const sphere = new three.Mesh(geometry, material);
      sphere.position.x = (i - 1) * spacing;
      sphere.castShadow = true;
      sphere.receiveShadow = i < 2;
      scene.add(sphere);
    });
    const fade = document.createElement("canvas");
    fade.width = fade.height = 256;
    const c = fade.getContext("2d");
    const gradient = c.createRadialGradient(128, 128, 20, 128, 128, 128);
    gradient.addColorStop(0, "#bbb");
    gradient.addColorStop(1, "#000");
    c.fillStyle = gradient;
    c.fillRect(0, 0, 256, 256);
    const ground = new three.Mesh(new three.PlaneBufferGeometry(15, 10), new three.MeshStandardMaterial({
      color: 0x9a9a9a, roughness: 1, metalness: 0, transparent: true, alphaMap: new three.CanvasTexture(fade),
    }));
    ground.rotation.x = -Math.PI / 2;
    ground.position.y = -1;
    ground.receiveShadow = true;
    scene.add(ground);
  }

  draw(lighting, panorama, exposure) {
    const { probe, sun, renderer, canvas, camera } = this;
    const { value } = toThree(lighting, {
      lights: "legacy", color: [exposure, 0, 0, 0, exposure, 0, 0, 0, exposure], residual: "left_out",
    });
    probe.sh.fromArray(value.sh);
    probe.intensity = value.lightProbeIntensity;
    sun.position.fromArray(value.position.map((v) => 12 * v));
    sun.color.setRGB(...value.color);
    sun.intensity = value.intensity;
    if (this.painted !== panorama.version) this.paintPanorama(panorama, lighting.lights);
    renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
    const [w, h] = [canvas.clientWidth, canvas.clientHeight];
    if (this.width !== w || this.height !== h) {
      Object.assign(this, { width: w, height: h });
      renderer.setSize(w, h, false);
      camera.aspect = w / Math.max(1, h);
      // The three spheres fill the width.
      camera.fov = (2 * 180 / Math.PI) * Math.atan(0.255 / camera.aspect);
      camera.updateProjectionMatrix();
    }
    renderer.render(this.scene, camera);
  }

  paintPanorama(panorama, lights) {
    const c = this.panoramaCanvas.getContext("2d");
    const [w, h] = [this.panoramaCanvas.width, this.panoramaCanvas.height];
    c.imageSmoothingQuality = "high";
    c.drawImage(panorama.canvas, 0, 0, w, h);
    c.fillStyle = "#fff";
    for (const light of lights) {
      const d = light.direction;
      const v = 0.5 - Math.asin(Math.min(1, Math.max(-1, d[1]))) / Math.PI;
      const u = Math.atan2(d[0], -d[2]) / (2 * Math.PI) + 0.5;
      const radius = Math.max(light.angularRadius, 0.035);
      const stretch = Math.min(8, 1 / Math.max(0.05, Math.hypot(d[0], d[2])));
      for (const shift of [-1, 0, 1]) {
        c.beginPath();
        c.ellipse((u + shift) * w, v * h, (radius / (2 * Math.PI)) * w * stretch, (radius / Math.PI) * h, 0, 0,
                  2 * Math.PI);
        c.fill();
      }
    }
    this.texture.needsUpdate = true;
    this.painted = panorama.version;
  }
}

/** The best view of the spheres that this browser and this probe allow; `note` says which one it is. */
export async function makeSpheres(canvas) {
  const three = await loadThree();
  if (three) return { view: new ThreeSpheres(canvas, three), note: "three.js" };
  const { FlatSpheres } = await import("./spheres_flat.js");
  return { view: new FlatSpheres(canvas), note: "2-D view" };
}
