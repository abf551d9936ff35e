// The link: state, delay, what is on its way, transfers; and the clock of what the rover knew when.
import { age_s, age_words, newest, unwatch, waited_s, watch } from "/static/ages.js";

const heard_words = (link) => { const heard = age_s(link.heard_s); return heard === null ? "never" : age_words(heard) + " before"; };

export default {
  template: `<div class="link-panel" :data-tick="tick">
    <p v-if="trouble" class="trouble" role="alert">{{ trouble }}</p>
    <dl><template v-for="row in rows" :key="row[0]"><dt>{{ row[0] }}</dt><dd>{{ row[1] }}</dd></template></dl>
    <p v-if="link && link.pace" class="pace">{{ link.pace }}</p>
    <p class="delay">{{ delay }}</p>
    <div v-for="one in transfers" :key="one.name" class="transfer"><span>{{ one.name }}</span>
      <progress :value="one.have" :max="one.total" :aria-label="'transfer of ' + one.name"></progress><span>{{ one.have }} of {{ one.total }}</span></div>
    <ul v-if="says.length" class="says"><li v-for="(line, at) in says" :key="at">{{ line }}</li></ul></div>`,
  data() { return { tick: 0 }; },
  mounted() { watch(this); },
  unmounted() { unwatch(this); },
  computed: {
    link() { this.tick; return (newest() || { link: null }).link; },
    trouble() {
      if (waited_s() > 3) return "this page has heard nothing of its server for " + age_words(waited_s()) + ": all values are old";
      return this.link ? this.link.trouble || this.link.mismatch : "";
    },
    rows() {
      const link = this.link;
      if (!link) return [];
      if (newest().past) return [["shown", "a past run: " + newest().past], ["last heard then", heard_words(link)], ["rover's boot", String(link.boot_id || "–")]];
      const refused = Object.entries(link.refused).map(([kind, n]) => kind + " " + n).join(", ") || "none";
      const heard = age_s(link.heard_s);
      return [["last heard", heard === null ? "never" : age_words(heard) + " ago"],
        ["round trip", link.rtt_s ? link.rtt_s.toFixed(2) + " s" : "not measured yet"],
        ["datagrams", link.received + " in, " + link.sent + " out; refused: " + refused],
        ["on its way", link.on_its_way.join(", ") || "nothing"],
        ["contact", link.contact || "–"], ["onboard time", link.clock || "–"],
        ["rover's boot", String(link.boot_id || "–")]];
    },
    delay() {
      const link = this.link;
      if (!link || !link.rtt_s || link.state !== "heard") return "";
      return "What you see is at least " + (link.rtt_s / 2).toFixed(2) + " s old; the earliest answer to a command comes in "
        + link.rtt_s.toFixed(2) + " s.";
    },
    transfers() { return this.link ? this.link.transfers.map(([name, have, total]) => ({ name, have, total })) : []; },
    says() { return this.link ? this.link.says.slice(-4) : []; },
  },
};
