// STOP by key and button. Stands alone: no other script of the page is needed, and none can switch it off.
"use strict";
(() => {
  const button = document.getElementById("stop-button");
  const words = document.getElementById("stop-words");
  if (!button || button.disabled) return;
  let press = null, pressedAt = 0, timer = null, running = false, unanswered = 0;

  const say = (kind, text) => { words.className = kind; words.textContent = text; };
  const ago = () => ((performance.now() - pressedAt) / 1000).toFixed(1) + " s";
  const newPress = () => "press-" + Array.from(crypto.getRandomValues(new Uint8Array(12)), (b) => b.toString(16).padStart(2, "0")).join("");

  async function once() {
    const abort = new AbortController();
    const limit = setTimeout(() => abort.abort(), 2000);
    try {
      const answer = await fetch("/stop", { method: "POST", credentials: "same-origin", cache: "no-store", signal: abort.signal,
        headers: { "Content-Type": "application/x-www-form-urlencoded", "Accept": "application/json" },
        body: "press=" + encodeURIComponent(press) });
      if (answer.status === 401 || answer.status === 403) {
        say("bad", "STOP WAS NOT SENT: signed out. Sign in again, or use `ground stop` in a terminal");
        return true;
      }
      if (!answer.ok) throw new Error("status " + answer.status);
      const told = await answer.json();
      unanswered = 0;
      const kind = told.good ? "good" : told.final ? "bad" : "asking";
      say(kind, "STOP, pressed " + ago() + " ago: " + told.words);
      return told.final;
    } catch (error) {
      unanswered += 1;
      if (unanswered >= 2) {
        say("bad", "STOP, pressed " + ago() + " ago: THE SERVER DOES NOT ANSWER. Tried again until it does; use `ground stop` in a terminal");
      }
      return false;
    } finally { clearTimeout(limit); }
  }

  async function follow() {
    if (running) return;
    running = true;
    const followed = press;
    const final = await once();
    running = false;
    if (press !== followed) { follow(); return; }
    if (!final) timer = setTimeout(follow, 300);
  }

  function stop() {
    press = newPress(); pressedAt = performance.now(); unanswered = 0;
    clearTimeout(timer);
    say("asking", "STOP pressed: on its way to the station");
    follow();
  }

  button.form.addEventListener("submit", (event) => { event.preventDefault(); stop(); });
  // In the capturing phase of the window: before any other code of the page.
  window.addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || event.repeat) return;
    stop();
  }, true);
  words.dataset.ready = "yes";
})();
