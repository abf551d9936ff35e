// Carries the trees of the server to all other parts of the page. Draws nothing.
import { take } from "/static/ages.js";

const MOST_POINTS = 1800;  // 15 minutes at 2 Hz

export default {
  template: `<span class="feed"></span>`,
  props: { first: Object },
  emits: ["lost"],
  mounted() { if (this.first) take(this.first); },
  methods: {
    show(text) { if (text && !take(JSON.parse(text))) this.$emit("lost"); },
    // Adds the newest values to a plot; whole: it has these already.
    plot(id, points, whole) {
      this.points = whole ? points : (this.points || []).concat(points).slice(-MOST_POINTS);
      const chart = getElement(id);
      if (chart && !whole) chart.run_chart_method("setOption", { series: [{ data: this.points }] });
    },
  },
};
