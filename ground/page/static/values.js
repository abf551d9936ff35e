// Values in groups, each with its age at the rover; dimmed when stale, marked when out of its limits.
import { age_s, age_words, newest, stale, unwatch, watch } from "/static/ages.js";

export default {
  template: `<div class="values" :data-tick="tick">
    <section v-for="group in groups" :key="group.title"><h3>{{ group.title }}</h3>
      <table><caption class="unseen">{{ group.title }}</caption>
        <thead class="unseen"><tr><th scope="col">item</th><th scope="col">value</th><th scope="col">age</th></tr></thead>
        <tbody><tr v-for="item in group.items" :key="item.name" :class="{ stale: of(item.name).stale, bad: of(item.name).bad }">
        <th scope="row" :title="item.meaning + ' (' + item.name + ')'">{{ item.label }}</th>
        <td class="text" :data-item="item.name">{{ of(item.name).text }}<span v-if="of(item.name).bad" class="mark"> out of limits</span></td>
        <td class="age">{{ of(item.name).age }}</td></tr></tbody></table></section></div>`,
  props: { groups: Array },
  data() { return { tick: 0 }; },
  mounted() { watch(this); },
  unmounted() { unwatch(this); },
  methods: {
    of(name) {
      this.tick;
      const tree = newest();
      const value = tree && tree.values[name];
      if (!value) return { text: "–", age: "", stale: true, bad: false };
      if (value.text === "–") return { text: "–", age: "never", stale: true, bad: false };
      return { text: value.text, age: age_words(age_s(value.at_s)), stale: stale(value), bad: value.bad };
    },
  },
};
