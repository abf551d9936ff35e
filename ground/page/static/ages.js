// The newest tree of the station and the age of its values. Ages grow here too while nothing arrives from the server.
let tree = null, ticks = 0, clock = 0;

// Takes a whole tree, or the difference to the one before. Returns false if a tree was missed: the server sends a whole one then.
export function take(fresh) {
  if (fresh.whole) tree = fresh;
  else if (!tree || tree.number !== fresh.number - 1) return false;
  else {
    const values = { ...tree.values };
    for (const name in fresh.values || {}) values[name] = { ...values[name], ...fresh.values[name] };
    tree = { ...tree, ...fresh, values };
  }
  ticks = performance.now(); clock = Date.now();
  window.dispatchEvent(new Event("station"));
  return true;
}
export const newest = () => tree;

// Time since the tree arrived, s; 0 for a past run, whose time stands still. A computer that slept stops performance.now, a clock set back stops Date: the larger.
export function waited_s() {
  return tree && !tree.past ? Math.max(performance.now() - ticks, Date.now() - clock, 0) / 1000 : 0;
}
// UTC now, s; 0: the station has none.
export function utc_now_s() { return tree && tree.utc_s ? tree.utc_s + waited_s() : 0; }
export function now_s() { return tree ? tree.now_s + waited_s() : 0; }
export function age_s(at_s) { return at_s === null || at_s === undefined ? null : Math.max(0, now_s() - at_s); }
export function stale(value) {
  const age = age_s(value.at_s);
  return age === null || age > value.stale_s || !value.live;
}
export function age_words(age) {
  if (age === null) return "age unknown";
  if (age < 9.95) return age.toFixed(1) + " s";
  if (age < 120) return age.toFixed(0) + " s";
  if (age < 7200) return (age / 60).toFixed(0) + " min";
  if (age < 172800) return (age / 3600).toFixed(0) + " h";
  return (age / 86400).toFixed(0) + " d";
}
export function watch(component) {
  component._draw = () => { component.tick += 1; };
  component._timer = setInterval(component._draw, 500);
  window.addEventListener("station", component._draw);
}
export function unwatch(component) {
  clearInterval(component._timer);
  window.removeEventListener("station", component._draw);
}
