// Commands, the newest first, each with its chain: requested, sent, heard, accepted, completed.
import { age_s, age_words, newest, unwatch, watch } from "/static/ages.js";

export default {
  template: `<div class="commands" tabindex="0" role="region" aria-label="commands" :data-tick="tick"><p v-if="!rows.length" class="none">no command yet</p>
    <article v-for="row in rows" :key="row.id" :class="{ final: row.final, good: row.good, failed: row.final && !row.good }" :data-command="row.words">
      <header><b>{{ row.words }}</b><span class="who">#{{ row.id }} {{ row.asked_by }}</span></header>
      <ol v-if="row.live"><li v-for="step in row.steps" :key="step.name" :class="step.kind">{{ step.name }}<small>{{ step.at }}</small></li></ol>
      <p v-else class="earlier">{{ row.earlier }}</p>
      <p v-if="row.text" class="words">{{ row.text }}</p></article></div>`,
  data() { return { tick: 0 }; },
  mounted() { watch(this); },
  unmounted() { unwatch(this); },
  computed: {
    rows() {
      this.tick;
      const tree = newest();
      if (!tree) return [];
      return tree.commands.slice().reverse().slice(0, 25).map((row) => {
        const begun = row.steps[0][1];
        const last = row.steps.reduce((found, [, at], index) => (at === null ? found : index), 0);
        const steps = row.steps.map(([name, at], index) => {
          if (at === null && index < last && name === "sent") return { name, at: "time not stored", kind: "untimed" };
          if (at === null) return { name, at: "", kind: row.final ? "skipped" : "open" };
          const since = index === 0 ? age_words(age_s(at)) + " ago" : "+" + (at - begun).toFixed(1) + " s";
          return { name, at: since, kind: index === 4 && !row.good ? "failed" : "reached" };
        });
        const when = row.utc_s ? new Date(row.utc_s * 1000).toISOString().slice(0, 19).replace("T", " ") + " UTC" : "";
        return { ...row, live: begun !== null, steps, earlier: when + ", " + row.state.toLowerCase() + " (an earlier session)" };
      });
    },
  },
};
