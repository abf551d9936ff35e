// The four wheels from above, forward is up: reported filled, ordered dashed; rates as bars; each with its age.
import { age_s, age_words, newest, stale, unwatch, watch } from "/static/ages.js";

const PLACES = { 1: [75, 62], 2: [75, 168], 3: [165, 168], 4: [165, 62] };  // front left, rear left, rear right, front right
const NAMES = { 1: "front left", 2: "rear left", 3: "rear right", 4: "front right" };
const FULL_RADPS = 4.2, BAR = 34;

export default {
  template: `<div class="wheels" :data-tick="tick"><svg viewBox="0 0 240 236" role="img" :aria-label="spoken">
      <path d="M86 40 L154 40 L160 60 L160 180 L80 180 L80 60 Z" class="hull"/><path d="M120 20 l8 14 h-16 Z" class="nose"/>
      <g v-for="one in wheels" :key="one.n" :class="{ stale: one.old, bad: one.off }" :data-wheel="one.n">
        <rect v-if="one.steer !== null" class="reported" x="-9" y="-20" width="18" height="40" rx="4" :transform="one.at + ' rotate(' + one.turn + ')'"/>
        <rect v-if="one.steer_ordered !== null" class="ordered" x="-11" y="-22" width="22" height="44" rx="5" :transform="one.at + ' rotate(' + one.turn_ordered + ')'"/>
        <line class="axis" :x1="one.bar" :x2="one.bar" :y1="one.y - 34" :y2="one.y + 34"/>
        <line v-if="one.rate !== null" class="rate" :x1="one.bar" :x2="one.bar" :y1="one.y" :y2="one.y - one.rate_px"/>
        <line v-if="one.rate_ordered !== null" class="rate-ordered" :x1="one.bar - 6" :x2="one.bar + 6" :y1="one.y - one.ordered_px" :y2="one.y - one.ordered_px"/>
      </g></svg>
    <table><thead><tr><th scope="col">wheel</th><th scope="col">steering<small>reported / ordered</small></th><th scope="col">rate<small>reported / ordered</small></th><th scope="col">age</th></tr></thead>
      <tbody><tr v-for="one in wheels" :key="one.n" :class="{ stale: one.old, bad: one.off }"><th scope="row">{{ one.n }} {{ one.name }}</th>
        <td>{{ one.steer_words }}</td><td>{{ one.rate_words }}</td><td class="age">{{ one.age }}</td></tr></tbody></table>
    <p class="slip" :class="{ stale: slip.old }">slip {{ slip.text }} <span class="age">{{ slip.age }}</span></p></div>`,
  data() { return { tick: 0 }; },
  mounted() { watch(this); },
  unmounted() { unwatch(this); },
  computed: {
    wheels() {
      this.tick;
      const tree = newest();
      if (!tree) return [];
      return [1, 2, 3, 4].map((n) => {
        const of = (what, unit) => tree.values[what + "_" + n + "_" + unit];
        const steer = of("steer", "rad"), rate = of("rate", "radps"), asked = of("steer_ordered", "rad"), turns = of("rate_ordered", "radps");
        const [x, y] = PLACES[n], left = n < 3, known = (value) => (typeof value.number === "number" ? value.number : null);
        const degrees = (value) => (known(value) === null ? 0 : -value.number * 180 / Math.PI), px = (value) => BAR * Math.max(-1, Math.min(1, (known(value) || 0) / FULL_RADPS));
        return { n, name: NAMES[n], y, at: "translate(" + x + " " + y + ")", bar: left ? x - 42 : x + 42, steer: known(steer), steer_ordered: known(asked), rate: known(rate), rate_ordered: known(turns),
          turn: degrees(steer), turn_ordered: degrees(asked), rate_px: px(rate), ordered_px: px(turns), old: stale(steer) || stale(rate), off: steer.bad || rate.bad,
          steer_words: steer.text + " / " + asked.text, rate_words: rate.text + " / " + turns.text, age: steer.text === "–" ? "never" : age_words(age_s(steer.at_s)) };
      });
    },
    slip() { this.tick; const value = newest() && newest().values.slip_ratio; return value ? { text: value.text, old: stale(value), age: value.text === "–" ? "never received" : age_words(age_s(value.at_s)) } : { text: "–", old: true, age: "" }; },
    spoken() { return "Wheels: " + this.wheels.map((one) => one.name + " steering " + one.steer_words + ", rate " + one.rate_words).join("; "); },
  },
};
