// One line: what the rover does, where it is, how far to go, battery, link; each with its age.
import { age_s, age_words, newest, stale, unwatch, waited_s, watch } from "/static/ages.js";

const SHOWN = [["mode", "mode"], ["phase", "phase"], ["goal_distance_m", "to the goal"], ["speed_mps", "speed"],
  ["yaw_rad", "heading"], ["voltage_v", "battery"], ["faults", "faults"]];
const LINK = { heard: "link up", silent: "SILENT", never: "nothing heard yet", closed: "LINK CLOSED", "no contact": "no contact window" };

export default {
  template: `<div class="headline" :data-tick="tick" role="status" aria-live="off">
    <div v-for="one in shown" :key="one.name" class="big" :class="{ stale: one.stale, bad: one.bad }">
      <span class="name">{{ one.label }}</span><span class="text">{{ one.text }}</span>
      <span class="age">{{ one.age }}</span></div>
    <div class="big link" :class="link.kind"><span class="name">link</span><span class="text">{{ link.text }}</span>
      <span class="age">{{ link.age }}</span></div>
  </div>`,
  data() { return { tick: 0 }; },
  mounted() { watch(this); },
  unmounted() { unwatch(this); },
  computed: {
    shown() {
      this.tick;
      const tree = newest();
      if (!tree) return [];
      return SHOWN.map(([name, label]) => {
        const value = tree.values[name];
        const old = stale(value);
        return { name, label, text: value.text, stale: old, bad: value.bad, age: value.text === "–" && !value.live ? "never received" : (old ? "old: " : "") + age_words(age_s(value.at_s)) };
      });
    },
    link() {
      this.tick;
      const tree = newest();
      if (!tree) return { kind: "bad", text: "no data yet", age: "" };
      if (tree.past) return { kind: "bad", text: "PAST RUN", age: tree.past };
      if (waited_s() > 3) return { kind: "bad", text: "SERVER SILENT", age: age_words(waited_s()) };
      const link = tree.link;
      const heard = age_s(link.heard_s);
      return { kind: link.state === "heard" ? "good" : "bad", text: LINK[link.state],
        age: heard === null ? (link.trouble || "never heard") : "heard " + age_words(heard) + " ago" };
    },
  },
};
