// The map: the rover's map over the orbiter's, as pictures of the server; rover, trail, paths, goal drawn over them.
// Metres in the map frame: x east, y north. Drag or arrow keys move, wheel or + and - zoom, F shows all, a click names a goal.
import { age_s, age_words, newest, stale, unwatch, utc_now_s, watch } from "/static/ages.js";

const BODY = [[0.6, 0], [0.45, 0.38], [-0.5, 0.38], [-0.5, -0.38], [0.45, -0.38]];
const COLOURS = { rover: "#ff5c49", old: "#9aa4ab", path: "#ff7d33", beyond: "#62b6ff", trail: "#ffffff", goal: "#ffd23f",
  proposed: "#f0e442", candidate: "#cc79a7", sigma: "#ffd23f" };

export default {
  template: `<div class="map"><canvas ref="canvas" tabindex="0" role="application" :aria-label="spoken"
      @pointerdown="down" @pointermove="move" @pointerup="up" @pointercancel="drag = null" @wheel.prevent="wheel" @keydown="key" @dblclick.prevent></canvas>
    <div class="map-tools"><button type="button" @click="follow = !follow; draw()" :aria-pressed="follow" title="keep the rover in the middle">follow</button>
      <button type="button" @click="fit" title="show all (F)">all</button><button type="button" @click="zoom(1.4)" aria-label="zoom in">+</button>
      <button type="button" @click="zoom(1 / 1.4)" aria-label="zoom out">−</button></div>
    <div class="map-words"><span>{{ cursor }}</span><span :class="{ stale: old }">{{ about }}</span></div></div>`,
  props: { layer: String, operator: Boolean },
  emits: ["goal"],
  data() { return { tick: 0, cursor: "", about: "", spoken: "map of the rover", old: true, follow: false, drag: null }; },
  mounted() {
    Object.assign(this, { maps: {}, trail: [], plan: null, goalAsked: null, pictures: {}, scale: 40, x: 0, y: 0, fitted: false });
    this.size = new ResizeObserver(() => this.resize());
    this.size.observe(this.$refs.canvas);
    watch(this);
    this.redraw = () => this.draw();
    window.addEventListener("station", this.redraw);
    this.slow = setInterval(this.redraw, 500);
    this.resize();
    this.$emit("ready");
  },
  unmounted() { unwatch(this); this.size.disconnect(); clearInterval(this.slow); window.removeEventListener("station", this.redraw); },
  watch: { layer() { this.load(); } },
  methods: {
    // -- from the server
    show_maps(maps) { const first = maps.ldem && !this.maps.ldem; this.maps = maps; this.load(); if (first || !this.fitted) this.fit(); this.draw(); },
    show_trail(places, whole) { this.trail = whole ? places : this.trail.concat(places); if (this.trail.length > 8000) this.trail = this.trail.filter((_, k) => k % 2 === 0); this.draw(); },
    show_plan(plan) { this.plan = plan; this.goalAsked = plan ? plan.goal : null; this.draw(); },
    show_goal(goal) { this.goalAsked = goal; this.plan = null; this.draw(); },
    // -- pictures
    picture(name, address) {
      const known = this.pictures[name];
      if (known && known.address === address) return known.image;
      const image = new Image();
      const entry = { address, image: known ? known.image : null };
      this.pictures[name] = entry;
      image.onload = () => { entry.image = image; this.draw(); };
      image.src = address;
      return entry.image;
    },
    load() {
      if (this.maps.gdem) this.picture("gdem", "/map/gdem.png");
      if (this.maps.ldem) {
        const tree = newest(), utc = tree && tree.utc_s ? tree.utc_s : 0;  // the picture of ages is made anew each minute
        const age = this.layer === "age" ? "&utc_s=" + 60 * Math.floor(utc / 60) : "";
        this.picture("ldem", this.maps.ldem.picture + "&layer=" + encodeURIComponent(this.layer) + age);
      }
    },
    // -- view
    resize() {
      const canvas = this.$refs.canvas, ratio = window.devicePixelRatio || 1;
      canvas.width = Math.max(1, Math.round(canvas.clientWidth * ratio)); canvas.height = Math.max(1, Math.round(canvas.clientHeight * ratio));
      this.ratio = ratio; this.width = canvas.clientWidth; this.height = canvas.clientHeight;
      if (!this.fitted) this.fit(); this.draw();
    },
    fit() {
      const all = [];
      for (const one of [this.maps.ldem, this.maps.ldem ? null : this.maps.gdem]) if (one) all.push([one.bounds[0], one.bounds[2]], [one.bounds[1], one.bounds[3]]);
      const tree = newest();
      if (tree && tree.pose) all.push([tree.pose.x_m - 2, tree.pose.y_m - 2], [tree.pose.x_m + 2, tree.pose.y_m + 2]);
      if (!all.length || !this.width) return;
      const xs = all.map((p) => p[0]), ys = all.map((p) => p[1]);
      const left = Math.min(...xs), right = Math.max(...xs), low = Math.min(...ys), high = Math.max(...ys);
      this.scale = Math.max(2, 0.94 * Math.min(this.width / Math.max(1, right - left), this.height / Math.max(1, high - low)));
      this.x = (left + right) / 2; this.y = (low + high) / 2; this.fitted = Boolean(this.maps.ldem || this.maps.gdem); this.draw();
    },
    px(x, y) { return [this.width / 2 + (x - this.x) * this.scale, this.height / 2 - (y - this.y) * this.scale]; },
    place(px, py) { return [this.x + (px - this.width / 2) / this.scale, this.y - (py - this.height / 2) / this.scale]; },
    zoom(factor, px = this.width / 2, py = this.height / 2) {
      const [x, y] = this.place(px, py);
      this.scale = Math.min(600, Math.max(2, this.scale * factor));
      const [x2, y2] = this.place(px, py);
      this.x += x - x2; this.y += y - y2; this.draw();
    },
    // -- hands
    at(event) { const box = this.$refs.canvas.getBoundingClientRect(); return [event.clientX - box.left, event.clientY - box.top]; },
    down(event) { this.$refs.canvas.setPointerCapture(event.pointerId); const [px, py] = this.at(event); this.drag = { px, py, x: this.x, y: this.y, far: false }; },
    move(event) {
      const [px, py] = this.at(event), [x, y] = this.place(px, py);
      this.cursor = "x " + x.toFixed(2) + " m  y " + y.toFixed(2) + " m";
      if (!this.drag) return;
      const dx = px - this.drag.px, dy = py - this.drag.py;
      if (Math.hypot(dx, dy) > 5) this.drag.far = true;
      if (this.drag.far) { this.follow = false; this.x = this.drag.x - dx / this.scale; this.y = this.drag.y + dy / this.scale; this.draw(); }
    },
    up(event) { const drag = this.drag; this.drag = null; if (drag && !drag.far && this.operator) this.name_goal(...this.place(...this.at(event))); },
    name_goal(x, y) { this.goalAsked = [x, y]; this.plan = null; this.draw(); this.$emit("goal", { x_m: x, y_m: y }); },
    wheel(event) { this.zoom(Math.exp(-event.deltaY * 0.0015), ...this.at(event)); },
    key(event) {
      const step = 60 / this.scale, moves = { ArrowLeft: [-step, 0], ArrowRight: [step, 0], ArrowUp: [0, step], ArrowDown: [0, -step] };
      if (moves[event.key]) { this.follow = false; this.x += moves[event.key][0]; this.y += moves[event.key][1]; this.draw(); }
      else if (event.key === "+" || event.key === "=") this.zoom(1.25);
      else if (event.key === "-") this.zoom(0.8);
      else if (event.key === "f" || event.key === "F") this.fit();
      else if (event.key === "Enter" && this.operator) this.name_goal(this.x, this.y);
      else return;
      event.preventDefault();
    },
    // -- drawing
    draw() { if (!this.waiting) { this.waiting = true; requestAnimationFrame(() => { this.waiting = false; this.paint(); }); } },
    paint() {
      const canvas = this.$refs.canvas;
      if (!canvas || !this.width) return;
      const g = canvas.getContext("2d"), tree = newest(), pose = tree && tree.pose;
      if (this.follow && pose) { this.x = pose.x_m; this.y = pose.y_m; }
      if (this.layer === "age") this.load();
      g.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
      g.fillStyle = "#20292f"; g.fillRect(0, 0, this.width, this.height);
      for (const name of ["gdem", "ldem"]) this.paint_picture(g, name);
      this.paint_grid(g);
      this.line(g, this.trail, COLOURS.trail, 2.5, [], "#000");
      if (this.maps.way) { this.line(g, this.maps.way.beyond, COLOURS.beyond, 2.5, [7, 6]); this.line(g, this.maps.way.path, COLOURS.path, 3.5, [], "#000"); }
      if (this.maps.fences) for (const fence of this.maps.fences.fences) this.paint_fence(g, fence);
      if (this.maps.nsp) this.paint_choice(g, this.maps.nsp);
      if (tree && tree.goal && tree.values.goal_x_m.live) this.cross(g, tree.goal, COLOURS.goal, "goal");
      if (this.plan) { this.line(g, this.plan.beyond, COLOURS.proposed, 2.5, [3, 6]); this.line(g, this.plan.path, COLOURS.proposed, 4, [10, 5], "#000"); }
      if (this.goalAsked) this.cross(g, this.goalAsked, COLOURS.proposed, "proposed goal");
      if (pose) this.paint_rover(g, pose);
      if (this.operator && document.activeElement === canvas) { g.strokeStyle = "#fff"; g.lineWidth = 1; g.beginPath(); const [cx, cy] = [this.width / 2, this.height / 2]; g.moveTo(cx - 9, cy); g.lineTo(cx + 9, cy); g.moveTo(cx, cy - 9); g.lineTo(cx, cy + 9); g.stroke(); }
      this.tell(pose);
    },
    paint_picture(g, name) {
      const map = this.maps[name], entry = this.pictures[name];
      if (!map || !entry || !entry.image) return;
      const [left, right, low, high] = map.bounds, [px, py] = this.px(left, high), [qx, qy] = this.px(right, low);
      g.imageSmoothingEnabled = name === "gdem"; g.globalAlpha = name === "gdem" ? 0.75 : 1;
      g.drawImage(entry.image, px, py, qx - px, qy - py); g.globalAlpha = 1;
      if (name === "ldem") { g.strokeStyle = "#c8d4dc"; g.setLineDash([5, 5]); g.lineWidth = 1; g.strokeRect(px, py, qx - px, qy - py); g.setLineDash([]); }
    },
    paint_grid(g) {
      const step = [0.5, 1, 2, 5, 10, 20, 50].find((s) => s * this.scale > 60) || 100;
      const [x0, y1] = this.place(0, 0), [x1, y0] = this.place(this.width, this.height);
      const rule = () => { g.lineWidth = 1; g.strokeStyle = "rgba(255,255,255,0.16)"; g.beginPath(); };
      g.font = "11px system-ui, sans-serif"; g.textAlign = "left";
      for (let x = Math.ceil(x0 / step) * step; x <= x1; x += step) { const [px] = this.px(x, 0); rule(); g.moveTo(px, 0); g.lineTo(px, this.height); g.stroke(); this.text(g, x.toFixed(step < 1 ? 1 : 0), px + 3, this.height - 5); }
      for (let y = Math.ceil(y0 / step) * step; y <= y1; y += step) { const [, py] = this.px(0, y); rule(); g.moveTo(0, py); g.lineTo(this.width, py); g.stroke(); this.text(g, y.toFixed(step < 1 ? 1 : 0), 4, py - 3); }
      const bar = step * this.scale, bx = this.width - bar - 16, by = this.height - 16;
      g.fillStyle = "#000a"; g.fillRect(bx - 6, by - 18, bar + 12, 26); g.fillStyle = "#fff"; g.fillRect(bx, by, bar, 3); this.text(g, step + " m", bx, by - 5);
      g.beginPath(); g.moveTo(this.width - 22, 14); g.lineTo(this.width - 15, 36); g.lineTo(this.width - 22, 30); g.lineTo(this.width - 29, 36); g.closePath(); g.fill(); this.text(g, "N", this.width - 26, 50);
    },
    text(g, words, x, y) { g.lineWidth = 3; g.strokeStyle = "rgba(0,0,0,0.7)"; g.strokeText(words, x, y); g.fillStyle = "#fff"; g.fillText(words, x, y); },
    line(g, places, colour, width, dash, rim) {
      if (!places || places.length < 2) return;
      g.beginPath(); places.forEach((p, k) => { const [px, py] = this.px(p[0], p[1]); if (k) g.lineTo(px, py); else g.moveTo(px, py); });
      g.lineJoin = "round"; g.setLineDash(dash);
      if (rim) { g.strokeStyle = rim; g.lineWidth = width + 2; g.stroke(); }
      g.strokeStyle = colour; g.lineWidth = width; g.stroke(); g.setLineDash([]);
    },
    cross(g, place, colour, words) {
      const [px, py] = this.px(place[0], place[1]);
      for (const [style, width] of [["#000", 6], [colour, 3]]) { g.strokeStyle = style; g.lineWidth = width; g.beginPath(); g.arc(px, py, 9, 0, 7); g.moveTo(px - 14, py); g.lineTo(px + 14, py); g.moveTo(px, py - 14); g.lineTo(px, py + 14); g.stroke(); }
      g.font = "12px system-ui, sans-serif"; this.text(g, words, px + 14, py - 10);
    },
    paint_fence(g, fence) {
      const out = fence.kind === "keep_out", corners = fence.corners.concat([fence.corners[0]]);
      g.beginPath(); fence.corners.forEach((p, k) => { const [px, py] = this.px(p[0], p[1]); if (k) g.lineTo(px, py); else g.moveTo(px, py); }); g.closePath();
      if (out) { g.fillStyle = "rgba(213,94,0,0.35)"; g.fill("evenodd"); }
      this.line(g, corners, out ? "#ff9a4d" : "#3fc79a", 2.5, out ? [] : [9, 4], "#000");
      const [px, py] = this.px(...fence.corners[0]); g.font = "600 11px system-ui, sans-serif"; this.text(g, (out ? "keep out: " : "goals within: ") + fence.name, px + 5, py - 5);
    },
    paint_choice(g, choice) {
      choice.places.forEach((one, k) => { const [px, py] = this.px(one.x_m, one.y_m); g.fillStyle = COLOURS.candidate; g.strokeStyle = "#000"; g.lineWidth = 1.5; g.beginPath(); g.arc(px, py, k ? 6 : 9, 0, 7); g.fill(); g.stroke(); g.font = "11px system-ui, sans-serif"; this.text(g, k ? String(k + 1) : "1: gain " + one.gain_term.toFixed(2) + ", distance " + one.distance_term.toFixed(2), px + 12, py + 4); });
      const [px, py] = this.px(choice.end[0], choice.end[1]); g.strokeStyle = COLOURS.candidate; g.lineWidth = 2.5; g.beginPath(); g.arc(px, py, 12, 0, 7); g.stroke();
    },
    outline(g, pose, fill, stroke, dash) {
      g.save(); const [px, py] = this.px(pose.x_m, pose.y_m); g.translate(px, py); g.rotate(-(pose.yaw_rad || 0)); g.scale(this.scale, -this.scale);
      g.beginPath(); BODY.forEach(([x, y], k) => (k ? g.lineTo(x, y) : g.moveTo(x, y))); g.closePath(); g.restore();
      if (fill) { g.fillStyle = fill; g.fill(); }
      g.setLineDash(dash); g.strokeStyle = "#000"; g.lineWidth = 4; g.stroke(); g.strokeStyle = stroke; g.lineWidth = 2; g.stroke(); g.setLineDash([]);
    },
    paint_rover(g, pose) {
      const old = stale(pose), colour = old ? COLOURS.old : COLOURS.rover;
      if (pose.ellipse) { const [px, py] = this.px(pose.x_m, pose.y_m), size = (m) => Math.max(2, 2 * m * this.scale); g.beginPath(); g.ellipse(px, py, size(pose.ellipse.major_m), size(pose.ellipse.minor_m), -pose.ellipse.axis_rad, 0, 7); g.setLineDash([4, 3]); g.strokeStyle = COLOURS.sigma; g.lineWidth = 2; g.stroke(); g.setLineDash([]); }
      this.outline(g, pose, old ? "#9aa4ab55" : "#ff5c4988", colour, old ? [5, 4] : []);
      if (pose.predicted && !old) this.outline(g, pose.predicted, null, "#fff", [4, 4]);
      const [px, py] = this.px(pose.x_m, pose.y_m);
      g.font = "600 12px system-ui, sans-serif"; this.text(g, (old ? "rover, old: " : "rover, ") + age_words(age_s(pose.at_s)) + (pose.predicted && !old ? " (dashed: predicted now)" : ""), px + 16, py + 26);
    },
    tell(pose) {
      const map = this.maps.ldem, utc = utc_now_s();
      const age = map && map.utc_s && utc ? utc - map.utc_s : null;
      this.old = age === null || age > 600 || age < 0;
      this.about = map ? "rover's map: received " + (age === null || age < 0 ? "at an unknown time" : age_words(age) + " ago") : "no map of the rover yet";
      this.spoken = "Map of the rover. " + (pose ? "Rover at x " + pose.x_m.toFixed(1) + ", y " + pose.y_m.toFixed(1) + " m. " : "") + "Arrow keys move, plus and minus zoom, Enter names the middle as goal.";
    },
  },
};
