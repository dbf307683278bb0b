// Loads a .vrm in three-vrm in headless Chromium: its T-pose, its springs while a leg is raised, and a picture.
//
// usage: node benches/peers/vrm.mjs FIGURE.vrm PICTURE.png     (in a folder where npm has installed
//        three @pixiv/three-vrm playwright-core gltf-validator; Chromium from the system)
import { createServer } from 'node:http';
import { readFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { extname, join, resolve } from 'node:path';

const [file, picture] = process.argv.slice(2);
const here = process.cwd();
const require = createRequire(join(here, 'package.json'));
const { chromium } = require('playwright-core');
const validator = require('gltf-validator');

const report = await validator.validateBytes(new Uint8Array(await readFile(file)));
const { numErrors, numWarnings, numInfos, messages } = report.issues;
console.log(`glTF validator: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} infos`);
for (const message of messages.filter((m) => m.severity < 2)) console.log('  ', message.code, message.pointer);

const page = `<!doctype html><body style="margin:0"><script type="importmap">{"imports":{"three":"/node_modules/three/build/three.module.js",
"three/addons/":"/node_modules/three/examples/jsm/","@pixiv/three-vrm":"/node_modules/@pixiv/three-vrm/lib/three-vrm.module.js"}}</script>
<script type="module">
import * as THREE from 'three';
import { GLTFLoader } from 'three/addons/loaders/GLTFLoader.js';
import { VRMLoaderPlugin } from '@pixiv/three-vrm';
const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
renderer.setSize(900, 600); document.body.append(renderer.domElement);
const scene = new THREE.Scene(); scene.background = new THREE.Color(0xdddddd);
scene.add(new THREE.HemisphereLight(0xffffff, 0x888888, 2.5));
const sun = new THREE.DirectionalLight(0xffffff, 1.5); sun.position.set(1, 2, 3); scene.add(sun);
const camera = new THREE.PerspectiveCamera(30, 1.5, 0.1, 20); camera.position.set(0.8, 1.1, 3.9); camera.lookAt(0, 0.9, 0);
const loader = new GLTFLoader(); loader.register((parser) => new VRMLoaderPlugin(parser));
const gltf = await loader.loadAsync('/figure.vrm'); const vrm = gltf.userData.vrm; scene.add(vrm.scene);
const place = (name) => vrm.humanoid.getRawBoneNode(name).getWorldPosition(new THREE.Vector3());
vrm.scene.updateMatrixWorld(true);
const degrees = (from, to, axis) => place(to).sub(place(from)).normalize().angleTo(new THREE.Vector3(...axis)) * 180 / Math.PI;
const result = { angles: {}, meta: vrm.meta.name };
for (const [side, x] of [['left', 1], ['right', -1]]) {
  result.angles[side + 'Arm'] = degrees(side + 'UpperArm', side + 'LowerArm', [x, 0, 0]);
  result.angles[side + 'ForeArm'] = degrees(side + 'LowerArm', side + 'Hand', [x, 0, 0]);
  result.angles[side + 'Thigh'] = degrees(side + 'UpperLeg', side + 'LowerLeg', [0, -1, 0]);
}
const box = new THREE.Box3().setFromObject(vrm.scene); result.floor = box.min.y; result.top = box.max.y;
const springs = vrm.springBoneManager ? [...vrm.springBoneManager.joints] : []; result.joints = springs.length;
const tips = () => springs.map((j) => (j.child ?? j.bone).getWorldPosition(new THREE.Vector3()));
const colliders = vrm.springBoneManager ? vrm.springBoneManager.colliders : [];
const rest = tips(); let most = 0, deepest = -1;
for (let frame = 0; frame < 120; frame++) {
  const angle = 0.6 * Math.sin(frame / 60 * Math.PI);
  vrm.humanoid.getNormalizedBoneNode('leftUpperLeg').rotation.x = -angle;
  vrm.humanoid.getNormalizedBoneNode('rightUpperLeg').rotation.x = angle;
  vrm.update(1 / 60); vrm.scene.updateMatrixWorld(true);
  tips().forEach((p, k) => {
    most = Math.max(most, p.distanceTo(rest[k]));
    for (const collider of colliders) {
      const toward = new THREE.Vector3();
      const out = collider.shape.calculateCollision(collider.colliderMatrix ?? collider.matrixWorld, p, springs[k].settings.hitRadius, toward);
      deepest = Math.max(deepest, -out);
    }
  });
  if (frame === 40) { renderer.render(scene, camera); result.shot = renderer.domElement.toDataURL(); }
}
result.most = most; result.deepest = deepest; window.result = result;
</script>`;
const types = { '.js': 'text/javascript', '.html': 'text/html' };
const server = createServer(async (request, response) => {
  const path = new URL(request.url, 'http://x').pathname;
  try {
    const body = path === '/' ? page : await readFile(path === '/figure.vrm' ? resolve(file) : join(here, path));
    response.setHeader('content-type', path === '/' ? 'text/html' : types[extname(path)] ?? 'application/octet-stream');
    response.end(body);
  } catch {
    response.statusCode = 404; response.end();
  }
}).listen(0, '127.0.0.1');
await new Promise((done) => server.once('listening', done));
const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-background-networking'],
});
const tab = await browser.newPage();
const words = [];
tab.on('console', (message) => words.push(`${message.type()}: ${message.text()}`));
tab.on('pageerror', (error) => words.push(`error: ${error.message}`));
await tab.goto(`http://127.0.0.1:${server.address().port}/`);
await tab.waitForFunction(() => window.result, null, { timeout: 120000 }).catch(() => {});
const result = await tab.evaluate(() => window.result);
await browser.close(); server.close();
words.filter((word) => !word.includes('GL Driver')).forEach((word) => console.log('  ', word));
if (!result) { console.log('three-vrm did not load the file'); process.exit(1); }
const { writeFile } = await import('node:fs/promises');
await writeFile(picture, Buffer.from(result.shot.split(',')[1], 'base64'));
delete result.shot;
console.log(JSON.stringify(result, null, 1));
const worst = Math.max(...Object.values(result.angles));
const is_good = numErrors === 0 && worst < 1 && Math.abs(result.floor) < 0.002 && (result.joints === 0 || result.most > 0.02);
console.log(is_good ? 'good' : 'NOT GOOD');
process.exit(is_good ? 0 : 1);
