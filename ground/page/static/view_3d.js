// The 3D panel: the last scan's cloud, the terrain and the rover with its wheels, in the map frame (x east, y north, z up).
// Drawn only when something has changed, and never while the tab or the panel is out of sight.
import { age_words, newest, stale, unwatch, utc_now_s, watch } from "/static/ages.js";
import { cloud_of, terrain_of } from "/static/buffers.js";

const OLD_S = 600;  // as the map's
const COLOURS = { ground: 0x20292f, terrain: 0x8a8178, terrain_old: 0x565b60, old: 0x9aa4ab, body: 0xff5c49, wheel: 0x62b6ff, nose: 0xffd23f };
const WHEELS = { 1: [1, 1], 2: [-1, 1], 3: [-1, -1], 4: [1, -1] };  // front left, rear left, rear right, front right
const NO_WEBGL = "This browser has no WebGL, so there is no 3D view. All other parts of the page work.";

export default {
  template: `<div class="view-3d" :data-tick="tick" :data-scan="shown_scan" :data-points="points" :data-frames="frames">
    <canvas ref="canvas" tabindex="0" role="img" :aria-label="spoken" v-show="!missing"></canvas>
    <p v-if="missing" class="no-3d">{{ missing }}</p>
    <div v-if="!missing" class="map-tools"><button type="button" @click="look('all')" title="show all">all</button><button type="button" @click="look('above')">from above</button>
      <button type="button" @click="look('rover')">behind the rover</button><button type="button" @click="zoom(1.3)" aria-label="nearer">+</button><button type="button" @click="zoom(1 / 1.3)" aria-label="further">−</button></div>
    <div v-if="!missing && cloud_words" class="map-words"><span class="cloud-words" :class="{ stale: cloud_old }">{{ cloud_words }}</span><span class="terrain-words" :class="{ stale: terrain_old }">{{ terrain_words }}</span></div></div>`,
  props: { rover: Object },
  emits: ["ready"],
  data() {
    return { tick: 0, missing: "", points: 0, frames: 0, shown_scan: "", cloud_words: "", cloud_old: true, terrain_words: "", terrain_old: true, spoken: "3D view" };
  },
  mounted() {
    Object.assign(this, { maps: {}, loaded: {}, parts: {}, gl: null, sight: false, drawn: "" });
    this.refresh = () => this.sync();
    this.eye = new IntersectionObserver((seen) => { this.sight = seen.at(-1).isIntersecting; this.sync(); });
    this.eye.observe(this.$el);
    this.size = new ResizeObserver(() => { this.resize(); this.draw(); });
    this.size.observe(this.$el);
    document.addEventListener("visibilitychange", this.refresh);
    window.addEventListener("station", this.refresh);
    this.slow = setInterval(this.refresh, 500);
    watch(this);
    this.$emit("ready");
  },
  unmounted() {
    unwatch(this); this.eye.disconnect(); this.size.disconnect(); clearInterval(this.slow);
    document.removeEventListener("visibilitychange", this.refresh); window.removeEventListener("station", this.refresh);
    if (this.gl) this.gl.renderer.dispose();
  },
  methods: {
    show(maps) { this.maps = maps; this.sync(); },
    in_sight() { return this.sight && !document.hidden; },
    // Brings the panel up to date if it is seen: library, buffers, rover, words.
    sync() {
      if (!this.in_sight() || this.missing) return;
      if (!this.gl) { this.prepare(); return; }
      this.load("cloud", this.maps.scan && this.maps.scan.buffer); this.load("terrain", this.maps.ldem && this.maps.ldem.terrain);
      this.tell();
      const mark = JSON.stringify([this.rover_now(), this.cloud_old, this.terrain_old]);
      if (mark !== this.drawn) { this.drawn = mark; this.draw(); }
    },
    async prepare() {
      if (this.preparing) return;
      this.preparing = true;
      const canvas = this.$refs.canvas, context = canvas.getContext("webgl2", { antialias: true });
      if (!context) { this.missing = NO_WEBGL; return; }
      try {
        const { THREE, OrbitControls } = await import("nicegui-scene");  // 800 kB, so not before the panel is seen
        this.build(THREE, OrbitControls, canvas, context);
      } catch (error) { this.missing = "The 3D view could not be started: " + error.message + ". All other parts of the page work."; return; }
      canvas.addEventListener("webglcontextlost", () => { this.missing = "The browser has ended the 3D view; load the page again to see it. All other parts of the page work."; });
      this.resize(); this.look("all"); this.sync();
    },
    build(THREE, OrbitControls, canvas, context) {
      const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(50, 1, 0.05, 500), sun = new THREE.DirectionalLight(0xffffff, 2.2);
      const renderer = new THREE.WebGLRenderer({ canvas, context, antialias: true });
      scene.background = new THREE.Color(COLOURS.ground); camera.up.set(0, 0, 1); sun.position.set(-3, 2, 4);
      scene.add(sun, new THREE.AmbientLight(0xffffff, 0.9), new THREE.AxesHelper(1));
      const controls = new OrbitControls(camera, canvas);
      controls.addEventListener("change", () => this.draw()); controls.listenToKeyEvents(canvas);
      this.gl = { THREE, scene, camera, renderer, controls, rover: this.build_rover(THREE) };
      scene.add(this.gl.rover.group);
    },
    build_rover(THREE) {
      const size = this.rover, group = new THREE.Group(), wheels = {}, of = (colour) => new THREE.MeshLambertMaterial({ color: colour });
      const body = new THREE.Mesh(new THREE.BoxGeometry(1.6 * size.half_wheelbase_m, 2 * size.half_track_m - size.wheel_width_m, 0.14), of(COLOURS.body));
      const nose = new THREE.Mesh(new THREE.ConeGeometry(0.09, 0.22, 12), of(COLOURS.nose));
      body.position.z = size.belly_m + 0.07; nose.position.set(0.8 * size.half_wheelbase_m + 0.11, 0, size.belly_m + 0.07); nose.rotation.z = -Math.PI / 2;
      for (const n in WHEELS) {
        wheels[n] = new THREE.Mesh(new THREE.CylinderGeometry(size.wheel_radius_m, size.wheel_radius_m, size.wheel_width_m, 18), of(COLOURS.wheel));
        wheels[n].position.set(WHEELS[n][0] * size.half_wheelbase_m, WHEELS[n][1] * size.half_track_m, size.wheel_radius_m); group.add(wheels[n]);
      }
      group.add(body, nose);
      return { group, body, nose, wheels };
    },
    // -- buffers of the server
    async load(name, address) {
      const wanted = address || "";
      if (this.loaded[name] === wanted) return;
      this.loaded[name] = wanted;
      let fresh = null, trouble = "";
      if (wanted) {
        const answer = await fetch(wanted).catch(() => null);
        if (this.loaded[name] !== wanted) return;  // a newer one came meanwhile
        if (answer && answer.ok) fresh = await answer.arrayBuffer();
        else if (answer) trouble = (await answer.text()).trim();
        else { this.loaded[name] = null; return; }  // the server is silent: again later
        if (this.loaded[name] !== wanted) return;
      }
      this.replace(name, fresh, trouble, wanted);
    },
    replace(name, buffer, trouble, address) {
      const { THREE, scene } = this.gl, before = this.parts[name], geometry = new THREE.BufferGeometry();
      if (before && before.drawn) { scene.remove(before.drawn); before.drawn.geometry.dispose(); before.drawn.material.dispose(); }
      const part = { trouble };
      if (buffer && name === "cloud") {
        Object.assign(part, cloud_of(buffer));
        geometry.setAttribute("position", new THREE.BufferAttribute(part.positions, 3)); geometry.setAttribute("color", new THREE.BufferAttribute(part.colours, 3));
        part.drawn = new THREE.Points(geometry, new THREE.PointsMaterial({ size: 2.5, sizeAttenuation: false, vertexColors: true }));
      } else if (buffer) {
        const { positions, triangles } = terrain_of(buffer);
        geometry.setAttribute("position", new THREE.BufferAttribute(positions, 3)); geometry.setIndex(triangles); geometry.computeVertexNormals();
        part.drawn = new THREE.Mesh(geometry, new THREE.MeshLambertMaterial({ color: COLOURS.terrain, side: THREE.DoubleSide, polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1 }));
      }
      const first = part.drawn && !(before && before.drawn);
      this.parts[name] = part;
      if (part.drawn) scene.add(part.drawn);
      if (name === "cloud") { this.points = part.points || 0; this.shown_scan = part.drawn ? address : ""; }
      this.tell();
      if (first) this.look("all");
      this.draw();
    },
    // -- view
    resize() {
      if (!this.gl || !this.$el.clientWidth) return;
      const { renderer, camera } = this.gl;
      renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1)); renderer.setSize(this.$el.clientWidth, this.$el.clientHeight, false);
      camera.aspect = this.$el.clientWidth / this.$el.clientHeight; camera.updateProjectionMatrix();
    },
    look(from) {
      if (!this.gl) return;
      const { THREE, camera, controls, rover } = this.gl, box = new THREE.Box3();
      this.place_rover();
      for (const one of [this.parts.terrain, this.parts.cloud]) if (one && one.drawn && box.isEmpty()) box.setFromObject(one.drawn);
      box.expandByObject(rover.group);
      const ball = box.getBoundingSphere(new THREE.Sphere()), reach = Math.max(2, Math.min(ball.radius, 20));
      const at = from === "rover" ? rover.group.position.clone() : ball.center, yaw = rover.group.rotation.z;
      const away = { all: [-0.5 * reach, -1.2 * reach, 0.95 * reach], above: [0, -0.001, 2.2 * reach], rover: [-3 * Math.cos(yaw), -3 * Math.sin(yaw), 1.8] }[from];
      controls.target.copy(at); camera.position.copy(at).add(new THREE.Vector3(...away)); controls.update(); this.draw();
    },
    zoom(factor) {
      if (!this.gl) return;
      const { camera, controls } = this.gl;
      camera.position.sub(controls.target).divideScalar(factor).add(controls.target); controls.update(); this.draw();
    },
    // -- drawing
    draw() {
      if (!this.gl || this.waiting || !this.in_sight()) return;
      this.waiting = true;
      requestAnimationFrame(() => { this.waiting = false; if (this.gl && this.in_sight()) this.paint(); });
    },
    paint() {
      const { scene, camera, renderer } = this.gl, cloud = this.parts.cloud && this.parts.cloud.drawn, terrain = this.parts.terrain && this.parts.terrain.drawn;
      if (cloud && cloud.material.vertexColors === this.cloud_old) {
        Object.assign(cloud.material, { vertexColors: !this.cloud_old, transparent: this.cloud_old, opacity: this.cloud_old ? 0.45 : 1, needsUpdate: true });
        cloud.material.color.set(this.cloud_old ? COLOURS.old : 0xffffff);
      }
      if (terrain) terrain.material.color.set(this.terrain_old ? COLOURS.terrain_old : COLOURS.terrain);
      this.place_rover(); renderer.render(scene, camera); this.frames += 1;
    },
    // Returns place, attitude and steering of the rover as the station knows them; null: no place is known.
    rover_now() {
      const tree = newest(), pose = tree && tree.pose;
      if (!pose) return null;
      const steer = [1, 2, 3, 4].map((n) => tree.values["steer_" + n + "_rad"]).map((value) => (value && typeof value.number === "number" ? value.number : 0));
      return { at: [pose.x_m, pose.y_m, pose.z_m || 0], turn: [pose.roll_rad || 0, pose.pitch_rad || 0, pose.yaw_rad || 0], steer, old: stale(pose) };
    },
    place_rover() {
      const { group, body, nose, wheels } = this.gl.rover, now = this.rover_now();
      group.visible = now !== null;
      if (!now) return;
      group.position.set(...now.at); group.rotation.set(...now.turn, "ZYX");
      body.material.color.set(now.old ? COLOURS.old : COLOURS.body); nose.material.color.set(now.old ? COLOURS.old : COLOURS.nose);
      for (const n in wheels) { wheels[n].rotation.z = now.steer[n - 1]; wheels[n].material.color.set(now.old ? COLOURS.old : COLOURS.wheel); }
    },
    tell() {
      const { cloud, terrain } = this.parts, utc = utc_now_s(), ago = (at) => (utc && at && utc >= at ? utc - at : null), words = (age) => (age === null ? "at an unknown time" : age_words(age) + " ago");
      const taken = cloud && cloud.drawn ? ago(cloud.taken_utc_s) : null, arrived = this.maps.ldem ? ago(this.maps.ldem.utc_s) : null;
      this.cloud_old = taken === null || taken > OLD_S; this.terrain_old = arrived === null || arrived > OLD_S;
      if (cloud && cloud.trouble) this.cloud_words = "the last scan cannot be shown: " + cloud.trouble;
      else if (!cloud || !cloud.drawn) this.cloud_words = "no scan was fetched yet";
      else this.cloud_words = "cloud of stop " + cloud.stop + ", " + cloud.points + " of " + cloud.whole + " points: measured " + words(taken) + (taken === null && this.maps.scan ? ", received " + words(ago(this.maps.scan.utc_s)) : "");
      this.terrain_words = terrain && terrain.trouble ? "the map cannot be shown: " + terrain.trouble : terrain && terrain.drawn ? "terrain: received " + words(arrived) : "no map of the rover yet";
      this.spoken = "3D view. " + this.cloud_words + ". " + this.terrain_words + ". Drag turns it, the wheel zooms, arrow keys move it.";
    },
  },
};
