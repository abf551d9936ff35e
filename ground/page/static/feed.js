// Carries the trees of the server to all other parts of the page. Draws nothing.
import { take } from "/static/ages.js";

export default {
  template: `<span class="feed"></span>`,
  props: { first: Object },
  mounted() { if (this.first) take(this.first); },
  methods: { show(tree) { take(tree); } },
};
